"""`AlgorithmSpec`: all that a shell needs to offer an algorithm.

The command line, the QGIS toolbox, the JSON Schema and the reference page are made from it;
none of them names a parameter a second time.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from urban_processing.params.base import ParamField, Params
from urban_processing.paths import GEOPACKAGE, MAPS
from urban_processing.schema import Layer


class InputKind(enum.StrEnum):
    """What an algorithm reads; a shell knows how to ask for each kind."""

    BOUNDARY = "boundary"
    """Polygons of the land; handed to the algorithm as a `Site`."""
    CORNER_POINTS = "corner points"
    """Points on the boundary that count as corners of the land; they become a part of the
    `Site` of the boundary, not a value of their own."""
    FIXED_STREETS = "lines of streets"
    """Streets that the network begins with; a part of the `Site`, as the four that follow."""
    OBSTACLES = "polygons of obstacles"
    """What no cut and no street crosses."""
    LOCKED_LAND = "polygons of locked land"
    """What stays a parcel."""
    RIM_LINES = "lines along the rim"
    """Lines that say which part of the rim is street, or is not."""
    ENTRY_POINTS = "entry points"
    """Where the network meets the outside."""
    LAYOUT = "layout"
    """A layout made before, as a file; handed over as a `Layout`."""
    STEERED = "layout or land to be edited"
    """What a session began with, as a file; handed over together with its edits, as `Steered`."""
    EDITS = "edits"
    """A saved session, or a list of edits."""
    PARCEL_LAYER = "parcel layer"
    """Polygons of parcels: with the streets they stand for the file of a layout, and are handed
    over in its place."""
    STREET_LAYER = "street layer"
    """Lines of streets that belong to a layer of parcels."""
    PARCELS_BEFORE = "parcels before an edit"
    """Polygons of parcels with all their columns; handed over with the three that follow, as
    `Editions`."""
    PARCELS_AFTER = "parcels after an edit"
    """Polygons of parcels with all their columns."""
    BLOCKS_BEFORE = "blocks before an edit"
    """Polygons of blocks, or lines around them."""
    BLOCKS_AFTER = "blocks after an edit"
    """Polygons of blocks, or lines around them."""

    CENTRELINES = "centrelines of streets"
    """Lines of streets that blocks are found between; handed over as `StreetsOnLand`."""
    LAND = "polygons of land"
    """Land that these blocks are cut at; a part of the `StreetsOnLand`."""
    BLOCK_LAYER = "block layer"
    """Polygons of blocks; handed over as `Blocks`."""
    BLOCK_STREETS = "lines of streets along blocks"
    """Streets that belong to a layer of blocks."""
    OBSERVED_PARCELS = "observed parcels"
    """Polygons of parcels as they are; handed over as `Observed`."""
    OBSERVED_BLOCKS = "blocks of observed parcels"
    """Polygons of the blocks of these parcels; a part of the `Observed`."""
    SUBDIVISION = "subdivision"
    """A subdivision made before, as a file; handed over as `Previous`."""

    FABRIC = "fabric"
    """Land with streets and parcels, of any origin, as a file; handed over as a `Fabric`. Layers
    of parcels, streets and land stand for it, too."""
    FABRICS = "fabrics"
    """Several of these; handed over as `ComparedFabrics`, with what is there as one of them if
    layers of parcels or streets, or OpenStreetMap, are given besides."""
    OPEN_STREET_MAP = "OpenStreetMap"
    """Streets of OpenStreetMap, from an extract or from its server."""

    @property
    def of_site(self) -> str:
        """Name of the argument of `read_boundary` that takes such an input; empty for others."""
        return _OF_SITE.get(self, "")

    @property
    def is_ground(self) -> bool:
        """Whether such an input is what the work is done on: it has a frame, and issues."""
        return self.chooses_crs or self is InputKind.PARCELS_BEFORE

    @property
    def chooses_crs(self) -> bool:
        """Whether the user may choose the CRS in which such an input is worked on."""
        return self.is_layer or self in (InputKind.FABRIC, InputKind.FABRICS)

    @property
    def is_layer(self) -> bool:
        """Whether such an input is one layer, of which the user may choose features."""
        return self in (
            InputKind.BOUNDARY,
            InputKind.STEERED,
            InputKind.CENTRELINES,
            InputKind.BLOCK_LAYER,
            InputKind.OBSERVED_PARCELS,
        )


_OF_SITE = {
    InputKind.CORNER_POINTS: "corners",
    InputKind.FIXED_STREETS: "streets",
    InputKind.OBSTACLES: "obstacles",
    InputKind.LOCKED_LAND: "locked",
    InputKind.RIM_LINES: "rim_lines",
    InputKind.ENTRY_POINTS: "entries",
}


class OutputKind(enum.StrEnum):
    """What an algorithm makes; a shell knows how to store each kind."""

    LAYOUT = "layout"
    """A `Layout`: a GeoPackage on the command line, sinks in QGIS."""
    LAYERS = "layers"
    """A `LayerSet` of the layers in `Output.layers`; stored as a layout is."""
    MAP = "map"
    """A picture of the layout or layers named in `Output.of`."""
    EXPORT = "export"
    """A folder of plain files: of what is named in `Output.of`, or of the `Layout` that an
    algorithm returns; then the algorithm has the parameters of `ExportParams`."""
    REPORT = "report"
    """A `Report`: a page of HTML with maps, tables and a glossary."""
    JSON = "JSON"
    """The figures of the report named in `Output.of`, as JSON."""
    CSV = "CSV"
    """The metrics of that report as a table."""

    @property
    def is_geopackage(self) -> bool:
        """Whether it is stored as one file with several layers."""
        return self in (OutputKind.LAYOUT, OutputKind.LAYERS)

    @property
    def endings(self) -> tuple[str, ...]:
        """What names of its files end in; nothing for a folder."""
        return _ENDINGS.get(self, ())


_ENDINGS = {
    OutputKind.LAYOUT: (GEOPACKAGE,),
    OutputKind.LAYERS: (GEOPACKAGE,),
    OutputKind.MAP: MAPS,
    OutputKind.REPORT: (".html",),
    OutputKind.JSON: (".json",),
    OutputKind.CSV: (".csv",),
}


@dataclass(frozen=True, kw_only=True)
class Input:
    """One thing that an algorithm reads.

    Parameters
    ----------
    name
        Its key in the mapping given to `AlgorithmSpec.run`.
    kind
        What it is.
    label
        Readable name, as in dialogs.
    help
        One sentence for the user.
    required
        Whether the algorithm runs without it.
    """

    name: str
    kind: InputKind
    label: str
    help: str
    required: bool = True


@dataclass(frozen=True, kw_only=True)
class Output:
    """One thing that an algorithm makes.

    Parameters
    ----------
    name
        Its key in the mapping that `AlgorithmSpec.run` returns, if `of` is empty.
    kind
        What it is.
    label
        Readable name, as in dialogs.
    help
        One sentence for the user.
    required
        Whether the user has to say where it goes.
    of
        Name of the output that this one is another view of, as a map is of a layout; the
        shell makes it, the algorithm does not.
    layers
        Layers that a layout or a set of layers can have, for all but views.
    """

    name: str
    kind: OutputKind
    label: str
    help: str
    required: bool = False
    of: str = ""
    layers: tuple[Layer, ...] = ()


class Estimate(Protocol):
    """What a run will make and take."""

    @property
    def parcels(self) -> int:
        """Number of parcels."""
        ...

    @property
    def seconds(self) -> float:
        """Time on one core."""
        ...


@dataclass(frozen=True, kw_only=True)
class AlgorithmSpec:
    """One algorithm, declared.

    Parameters
    ----------
    name
        Stable lowercase identifier: the command, the QGIS id, the name in provenance.
    title
        What a toolbox shows.
    group
        Where a toolbox shows it.
    summary
        One sentence.
    description
        Some paragraphs, separated by empty lines.
    params
        The parameter class.
    inputs, outputs
        What it reads and makes, in the order of asking.
    run
        ``run(inputs, params, progress)`` returns the outputs by name. It imports the engine
        when it is called, so that a list of algorithms costs nothing.
    estimate
        ``estimate(inputs, params)``, where a run may be long.
    parallel
        Whether `run` takes a keyword ``executor`` that runs parts of the work side by side.
    references
        The sources, as a reader would look them up.
    examples
        Arguments of the command line that work, without the program and the name.
    """

    name: str
    title: str
    group: str
    summary: str
    description: str
    params: type[Params]
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    run: Callable[..., Mapping[str, Any]]
    estimate: Callable[[Mapping[str, Any], Any], Estimate] | None = None
    parallel: bool = False
    references: tuple[str, ...] = ()
    examples: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        fields = [field.name for field in self.params.fields()]
        names = [i.name for i in self.inputs] + [o.name for o in self.outputs] + fields
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{self.name}: names used twice: {', '.join(twice)}")
        made = {output.name for output in self.outputs if not output.of}
        without = [bool(o.of) or o.kind is OutputKind.REPORT for o in self.outputs]
        bare = [o.name for o, w in zip(self.outputs, without, strict=True) if w == bool(o.layers)]
        if bare:
            raise ValueError(f"{self.name}: all but views and reports have layers: {bare}")
        lost = [output.name for output in self.outputs if output.of and output.of not in made]
        if lost:
            raise ValueError(f"{self.name}: views of no output: {', '.join(lost)}")

    def panels(self) -> dict[str, tuple[ParamField, ...]]:
        """Return the parameters by panel, as shells show them.

        Those without a group come after the groups, the advanced ones last.
        """
        fields = self.params.fields()
        plain = [field for field in fields if not field.param.advanced]
        named = dict.fromkeys(field.param.group for field in plain if field.param.group)
        panels = {group: [f for f in plain if f.param.group == group] for group in named}
        panels["General"] = [field for field in plain if not field.param.group]
        panels["Advanced"] = [field for field in fields if field.param.advanced]
        return {panel: tuple(members) for panel, members in panels.items() if members}
