"""Parameters of the hierarchical co-generation of parcels and streets."""

from __future__ import annotations

import enum
from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params
from urban_processing.params.dimensions import unfit_dimensions
from urban_processing.params.rules import RULES, Preset, Rules
from urban_processing.params.subdivide import STRATEGY_LABELS, Strategy
from urban_processing.street_rules import StreetRules


class StreetPattern(enum.StrEnum):
    """Pattern of the street network (Chen 2024, Fig. 14)."""

    LOOP = "loop"
    CUL_DE_SAC = "cul-de-sac"
    TREE = "tree"


class RimStreet(enum.StrEnum):
    """Which part of the land's rim is street (Chen 2024, Fig. 14)."""

    STREET = "street"
    NONE = "none"
    ALONG_LINES = "along-lines"
    EXCEPT_LINES = "except-lines"


class ObstacleRim(enum.StrEnum):
    """Whether there is a street around obstacles."""

    NONE = "none"
    STREET = "street"


class MinAreaBasis(enum.StrEnum):
    """Which area of a parcel the smallest area allowed is held against."""

    GROSS = "gross"
    NET = "net"


_SIZE, _SHAPE, _STREETS, _DIMENSIONS = "Size", "Parcel shape", "Streets", "Dimensions"
_WIDTHS = "Rights-of-way"


StopAtLevel = Annotated[
    int | None,
    Param(
        label="Stop at level",
        help="Stop after so many levels of cuts, for the layout to be looked at and edited; "
        "resume goes on with it.",
        minimum=0,
        advanced=True,
    ),
]
"""The parameter of algorithms that go through the levels."""

LEAST_WIDTH = 1.0
"""Smallest width in metres of a street inside the land."""


@dataclass(frozen=True, kw_only=True)
class CogenerateParams(Params):
    """Parameters of `cogenerate`; lengths in metres, areas in m², angles in degrees."""

    min_area: Annotated[
        float | None,
        Param(
            label="Smallest parcel",
            help="Smallest parcel allowed; give this or the number of parcels.",
            unit="m²",
            above=0,
            group=_SIZE,
        ),
    ] = None
    parcels: Annotated[
        int | None,
        Param(
            label="Number of parcels",
            help="Number of parcels wanted (reached within 3 %); give this or the smallest area.",
            minimum=1,
            group=_SIZE,
        ),
    ] = None
    min_area_basis: Annotated[
        MinAreaBasis,
        Param(
            label="Area that counts",
            help="Whether the smallest area allowed is gross, to the centreline of streets, or "
            "net, less right-of-way.",
            labels={"gross": "Gross, to the centreline", "net": "Net, less right-of-way"},
            group=_SIZE,
        ),
    ] = MinAreaBasis.GROSS
    pattern: Annotated[
        StreetPattern,
        Param(
            label="Street pattern",
            help="Street pattern: loops without dead ends, dead ends in the last levels, or a "
            "tree that keeps all its dead ends.",
            group=_STREETS,
            labels={
                "loop": "Loops, no dead ends",
                "cul-de-sac": "Cul-de-sacs in the last levels",
                "tree": "Tree",
            },
        ),
    ] = StreetPattern.LOOP
    right_of_way: Annotated[
        bool,
        Param(
            label="Lay out rights-of-way",
            help="Whether to cut the rights-of-way of streets out of the parcels: layers of "
            "right-of-way and net parcels.",
            group=_WIDTHS,
        ),
    ] = True
    rim_width: Annotated[
        float,
        Param(
            label="Width of rim streets",
            help="Width of the right-of-way of streets on the rim of the land, which take its "
            "inner half from the land; 0 where they lie outside.",
            unit="m",
            minimum=0,
            group=_WIDTHS,
        ),
    ] = StreetRules.rim
    collector_width: Annotated[
        float,
        Param(
            label="Width of collectors",
            help="Width of the right-of-way of collectors, the streets of the first levels.",
            unit="m",
            minimum=LEAST_WIDTH,
            group=_WIDTHS,
        ),
    ] = StreetRules.collector
    local_width: Annotated[
        float,
        Param(
            label="Width of local streets",
            help="Width of the right-of-way of local streets.",
            unit="m",
            minimum=LEAST_WIDTH,
            group=_WIDTHS,
        ),
    ] = StreetRules.local
    cul_de_sac_width: Annotated[
        float,
        Param(
            label="Width of cul-de-sacs",
            help="Width of the right-of-way of streets that lead to a street end alone.",
            unit="m",
            minimum=LEAST_WIDTH,
            group=_WIDTHS,
        ),
    ] = StreetRules.cul_de_sac
    corner_radius: Annotated[
        float,
        Param(
            label="Radius of corners",
            help="Radius of the corners of blocks at junctions; 0 leaves them sharp.",
            unit="m",
            minimum=0,
            group=_WIDTHS,
        ),
    ] = StreetRules.corner_radius
    turning_radius: Annotated[
        float,
        Param(
            label="Radius of turning heads",
            help="Radius of the turning heads at dead ends; 0 for none.",
            unit="m",
            minimum=0,
            group=_WIDTHS,
        ),
    ] = StreetRules.turning_radius
    strategy: Annotated[
        Strategy,
        Param(
            label="Strategy of the last levels",
            help="How the blocks between streets become parcels in the end: by streamlines like "
            "all levels, or by another strategy of subdivision.",
            group=_SHAPE,
            labels=STRATEGY_LABELS,
        ),
    ] = Strategy.STREAMLINE
    last_levels: Annotated[
        int,
        Param(
            label="Number of last levels",
            help="How many levels another strategy than streamlines stands for; each halves the "
            "parcels once.",
            minimum=1,
            maximum=8,
            group=_SHAPE,
        ),
    ] = 1
    optimize: Annotated[
        bool,
        Param(
            label="Optimize the geometry",
            help="Whether to smooth sides and streets and to make parcels and junctions more "
            "regular in the end.",
        ),
    ] = True
    stop_at_level: StopAtLevel = None
    rim: Annotated[
        RimStreet | None,
        Param(
            label="Streets on the rim",
            help="Which part of the rim of the land is street: all of it (the default), none, or, "
            "where rim lines are given, that along the lines (then the default) or all but that.",
            group=_STREETS,
            labels={
                "street": "All of the rim",
                "none": "None of it",
                "along-lines": "Along the rim lines",
                "except-lines": "All but along the rim lines",
            },
        ),
    ] = None
    obstacle_rim: Annotated[
        ObstacleRim,
        Param(
            label="Rims of obstacles",
            help="Whether a street runs around obstacles, such as along a lakeside.",
            group=_STREETS,
            labels={"none": "No street", "street": "Street"},
        ),
    ] = ObstacleRim.NONE
    seed: Annotated[
        int,
        Param(
            label="Random seed", help="Random seed; the same seed gives the same bytes.", minimum=0
        ),
    ] = 0
    simplify: Annotated[
        float | None,
        Param(
            label="Tolerance of the boundary",
            help="Tolerance of the simplification of the boundary; by default 0.3 of the side "
            "of the smallest parcel; 0 keeps every vertex.",
            unit="m",
            minimum=0,
            group=_SIZE,
        ),
    ] = None
    orientation: Annotated[
        float | None,
        Param(
            label="Direction of parcels",
            help="Preferred direction of the long side of parcels, counter-clockwise from "
            "east (0 = east-west, 90 = north-south).",
            unit="°",
            minimum=-180,
            maximum=180,
            group=_SHAPE,
        ),
    ] = None
    width_depth: Annotated[
        float | None,
        Param(
            label="Width : depth of parcels",
            help="Width of parcels along their street over their depth: with 0.5, parcels half as "
            "wide as deep are aimed at.",
            minimum=0.1,
            maximum=10,
            group=_DIMENSIONS,
        ),
    ] = None
    least_frontage: Annotated[
        float | None,
        Param(
            label="Least frontage",
            help="Length of street that every parcel is to have along its boundary.",
            unit="m",
            above=0,
            group=_DIMENSIONS,
        ),
    ] = None
    hard_frontage: Annotated[
        bool,
        Param(
            label="Least frontage is a hard limit",
            help="Whether the least frontage is a hard limit: streets are added for it, and each "
            "parcel that stays below is listed.",
            group=_DIMENSIONS,
        ),
    ] = False
    max_block_length: Annotated[
        float | None,
        Param(
            label="Longest block",
            help="Length that no block is to have on any of its sides, from corner to corner; "
            "longer blocks get a street across.",
            unit="m",
            above=0,
            group=_DIMENSIONS,
        ),
    ] = None
    hard_block_length: Annotated[
        bool,
        Param(
            label="Longest block is a hard limit",
            help="Whether the longest block is a hard limit: blocks are split even where that "
            "leaves very small ones, and each that stays longer is listed.",
            group=_DIMENSIONS,
        ),
    ] = False
    preset: Annotated[
        Preset,
        Param(
            label="Weights and rules",
            help="Weights and rules to start from: the recommended ones, or those printed in "
            "Chen et al. 2024.",
            labels={"recommended": "Recommended", "chen2024": "Chen et al. 2024, as printed"},
        ),
    ] = Preset.RECOMMENDED
    weight_size: Annotated[
        float | None,
        Param(
            label="Weight of equal size (λ1)",
            help="λ1: how much parcels of equal size count in choosing a cut.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = None
    weight_regularity: Annotated[
        float | None,
        Param(
            label="Weight of regular shape (λ2)",
            help="λ2: how much regular parcels count in choosing a cut.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = None
    weight_access: Annotated[
        float | None,
        Param(
            label="Weight of street access (λ3)",
            help="λ3: how much street access of both halves counts in choosing a cut.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = None
    weight_continuity: Annotated[
        float | None,
        Param(
            label="Weight of continued cuts",
            help="How much continuing a neighbour's cut counts in choosing a cut.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = None
    weight_orientation: Annotated[
        float,
        Param(
            label="Weight of the direction",
            help="How much the preferred orientation counts, where one is given: with 0.3, "
            "parcels of 1.6 : 1 along it are ideal.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = 0.3
    access_ratio: Annotated[
        float,
        Param(
            label="Access ratio (τ)",
            help="τ: street access over mean side length from which a half counts as reached.",
            minimum=0,
            advanced=True,
            group=_SHAPE,
        ),
    ] = 0.5
    candidates: Annotated[
        int,
        Param(
            label="Candidates per parcel",
            help="Number of streamline candidates for each parcel.",
            minimum=4,
            maximum=200,
            advanced=True,
            group=_SHAPE,
        ),
    ] = 20
    length_weight: Annotated[
        float,
        Param(
            label="Weight of street length",
            help="How much street length counts in connecting streets.",
            above=0,
            advanced=True,
            group=_STREETS,
        ),
    ] = 1.0
    junction_weight: Annotated[
        float,
        Param(
            label="Weight of street turns",
            help="How much a turn counts in connecting streets, in parcel sides of length.",
            minimum=0,
            advanced=True,
            group=_STREETS,
        ),
    ] = 6.0
    cul_de_sac_levels: Annotated[
        int,
        Param(
            label="Levels of cul-de-sacs",
            help="Number of last levels whose dead ends are kept in the cul-de-sac pattern.",
            minimum=1,
            advanced=True,
            group=_STREETS,
        ),
    ] = 3

    snap_tolerance: Annotated[
        float,
        Param(
            label="Tolerance of given lines",
            help="Ends of given streets join the rim and each other within this distance; what "
            "is closer together is taken for one line.",
            unit="m",
            above=0,
            advanced=True,
            group=_STREETS,
        ),
    ] = 1.0

    def contradictions(self, called: Naming) -> list[str]:
        """Return what contradicts: sizes, weights, dimensions, a net area without street."""
        problems = []
        area, number = called("min_area"), called("parcels")
        if self.min_area is None and self.parcels is None:
            problems.append(f"Give {area} (m²) or {number} (a number): one of the two is needed.")
        if self.min_area is not None and self.parcels is not None:
            problems.append(f"Give {area} or {number}, not both.")
        if self.parcels is not None and self.strategy is not Strategy.STREAMLINE:
            problems.append(
                f"{called('strategy')} {self.strategy} does not count parcels: give {area} instead "
                f"of {number}."
            )
        if self.weights == (0.0, 0.0, 0.0):
            size, shape, access = map(called, ("weight_size", "weight_regularity", "weight_access"))
            problems.append(
                f"{size}, {shape} and {access} are all zero: "
                "give at least one of them a positive value."
            )
        for hard, value in (
            ("hard_frontage", "least_frontage"),
            ("hard_block_length", "max_block_length"),
        ):
            if getattr(self, hard) and getattr(self, value) is None:
                problems.append(f"{called(hard)} needs a value: give {called(value)} (m).")
        if self.min_area is not None and self.min_area > 0:
            problems += unfit_dimensions(
                called,
                min_area=self.min_area,
                width_depth=self.width_depth,
                least_frontage=self.least_frontage,
                max_block_length=self.max_block_length,
            )
        if self.min_area_basis is MinAreaBasis.NET and not self.right_of_way:
            basis, streets = called("min_area_basis"), called("right_of_way")
            problems.append(
                f"{basis} net needs {streets}: without right-of-way there is no net area."
            )
        return problems

    def contradictions_with(self, layers: Collection[str], called: Naming) -> list[str]:
        """Return what contradicts the layers given: rims of what is not there, or twice said."""
        problems = []
        rim, lines = called("rim"), called("rim_lines")
        if "rim_lines" in layers and self.rim in (RimStreet.STREET, RimStreet.NONE):
            problems.append(
                f"{rim} {self.rim.value} speaks of the whole rim, {lines} of a part of it: give "
                f"one of the two, or {rim} along-lines or except-lines."
            )
        if "rim_lines" not in layers and self.rim in (
            RimStreet.ALONG_LINES,
            RimStreet.EXCEPT_LINES,
        ):
            problems.append(f"{rim} {self.rim.value} needs {lines}: give lines along the rim.")
        if "obstacles" not in layers and self.obstacle_rim is ObstacleRim.STREET:
            problems.append(
                f"{called('obstacle_rim')} street needs {called('obstacles')}: there is no rim."
            )
        return problems

    @property
    def frontage_limit(self) -> float:
        """Least frontage in metres where it is a hard limit, else 0."""
        return (self.least_frontage or 0.0) if self.hard_frontage else 0.0

    @property
    def street_rules(self) -> StreetRules:
        """What streets are to be: widths, radii, whether rights-of-way are laid out."""
        return StreetRules(
            rim=self.rim_width,
            collector=self.collector_width,
            local=self.local_width,
            cul_de_sac=self.cul_de_sac_width,
            corner_radius=self.corner_radius,
            turning_radius=self.turning_radius,
            laid_out=self.right_of_way,
            net_min_area=self.min_area_basis is MinAreaBasis.NET,
        )

    @property
    def rules(self) -> Rules:
        """The rules of the chosen preset."""
        return RULES[self.preset]

    @property
    def weights(self) -> tuple[float, float, float]:
        """λ1, λ2, λ3 of Eq. 2: what was given, else the preset's."""
        given = (self.weight_size, self.weight_regularity, self.weight_access)
        return tuple(  # type: ignore[return-value]
            default if value is None else value
            for value, default in zip(given, self.rules.weights, strict=True)
        )

    @property
    def continuity(self) -> float:
        """Weight of continuing a neighbour's cut: what was given, else the preset's."""
        given = self.weight_continuity
        return self.rules.continuity if given is None else given
