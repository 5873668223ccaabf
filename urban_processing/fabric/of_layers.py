"""The fabric that layers of parcels and streets are, whatever program made them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.centrelines import clean_centrelines
from urban_processing.blocks.noding import NODE_GRID, Centrelines
from urban_processing.blocks.streets import StreetLines, chosen_streets, street_lines
from urban_processing.errors import BoundaryError
from urban_processing.fabric.described import describe_parcels
from urban_processing.fabric.land_use import StreetLand, gross_street_land, net_street_land
from urban_processing.fabric.model import (
    Fabric,
    FabricBlocks,
    FabricParcels,
)
from urban_processing.fabric.observed import ObservedParcels, street_parcels
from urban_processing.fabric.outline import town_outline
from urban_processing.fabric.streets_in_land import StreetsInLand, streets_in_land
from urban_processing.mesh.planar import FloatArray
from urban_processing.params.measure import MeasureParams
from urban_processing.site import Frame, Issue
from urban_processing.streets.classes import NodeKind

Geometries = npt.NDArray[np.object_]

INSIDE_SHARE = 0.5
"""Parcels stay, whole, if the land has more than this share of them."""

OVERLAP_SHARE = 1e-3
"""Parcels that overlap by more than this share of their area are told of."""


def fabric_of_layers(
    streets: StreetLines | None,
    parcels: ObservedParcels | None,
    land: Sequence[shapely.Polygon] | None = None,
    params: MeasureParams | None = None,
) -> Fabric:
    """Make a fabric of layers of streets and parcels.

    Streets are noded and mended (`clean_centrelines`), but none is left out for its width; what
    is outside the land is cut off. Parcels may run to the centreline, as those of layouts do, or
    stop at the right-of-way, as in cadastres; parcels that are streets are told apart
    (`street_parcels`). What had to be decided is said in the issues.

    Parameters
    ----------
    streets
        Centrelines; None where only parcels are known.
    parcels
        Parcels in the frame of the streets; None where only streets are known.
    land
        Polygons that meet at points at most, the largest first. By default the land is what
        parcels and streets cover (`town_outline`); of streets alone their convex hull.
    params
        Widths and tolerances.

    Raises
    ------
    BoundaryError
        If there is nothing in the land.

    Examples
    --------
    >>> import shapely
    >>> from urban_processing.blocks.streets import street_lines
    >>> from urban_processing.fabric.observed import observed_parcels
    >>> street = street_lines([shapely.LineString([(-9, 0), (49, 0)])], width=12)
    >>> parcels = observed_parcels([shapely.box(0, 6, 20, 36), shapely.box(20, 6, 40, 36)])
    >>> fabric_of_layers(street, parcels).parcels.rings.frontage.tolist()
    [20.0, 20.0]
    """
    reading = _Reading(streets, parcels, land, params or MeasureParams())
    return reading.fabric()


@dataclass(eq=False)
class _Reading:
    """Layers on their way to a fabric."""

    streets: StreetLines | None
    parcels: ObservedParcels | None
    given: Sequence[shapely.Polygon] | None
    params: MeasureParams
    issues: list[Issue] = field(default_factory=list)

    def fabric(self) -> Fabric:
        """Return the fabric."""
        if self.streets is None and self.parcels is None:
            raise BoundaryError("Give parcels, streets, or both.")
        lines, work = self._centrelines()
        parcels, roads = self._parcels_and_roads(lines, work)
        land = self._land(lines, work, parcels)
        if self.parcels is not None and parcels is None:
            raise BoundaryError("All parcels are streets: give the layer of parcels.")
        ground = streets_in_land(work, lines, land, snap=self.params.snap_tolerance)
        self._tell_of_streets(ground)
        parcels = None if parcels is None else self._in_land(parcels, ground.land)
        known = None
        taken: StreetLand | None = None
        if parcels is not None:
            known, taken = self._described(parcels, ground, roads)
        elif self.streets is not None:
            taken = gross_street_land(ground, np.empty(0, dtype=object), np.empty(0, np.int64))
        source = self.streets if self.parcels is None else self.parcels
        known_blocks = len(ground.faces.polygons) if ground.network.n_edges else 0
        return Fabric(
            frame=Frame() if source is None else source.frame,
            land=ground.land,
            land_part=np.arange(len(ground.land)),
            lines=ground.lines,
            network=ground.network,
            blocks=FabricBlocks(
                ground.faces.polygons[:known_blocks],
                ground.faces.part[:known_blocks],
            ),
            parcels=known,
            right_of_way=None if taken is None else taken.polygons,
            right_of_way_part=None if taken is None else taken.part,
            issues=tuple(self.issues),
        )

    def _centrelines(self) -> tuple[StreetLines, Centrelines]:
        """Lines near the land or the parcels with their widths, and their segments, mended."""
        if self.streets is None:
            return street_lines([]), Centrelines(np.empty((0, 2, 2)), np.empty(0, dtype=np.int64))
        self.issues += self.streets.issues
        usable, said = chosen_streets(self.streets, self.params.of_streets)
        self.issues += said
        shapes = self.given
        if shapes is None and self.parcels is not None:
            shapes = [shapely.convex_hull(shapely.GeometryCollection(list(self.parcels.polygons)))]
        if shapes is not None:
            ground = shapely.union_all(list(shapes))
            shapely.prepare(ground)
            reach = usable.width / 2 + max(self.params.street_reach, self.params.snap_tolerance)
            usable = usable.take(shapely.dwithin(ground, usable.lines, reach))
        work, mended = clean_centrelines(
            usable, snap=self.params.snap_tolerance, dead_ends=True, short_ends=True
        )
        # dead ends are counted in the land, later
        self.issues += [issue for issue in mended if issue.code != "dead_ends"]
        return usable, work

    def _parcels_and_roads(
        self, lines: StreetLines, work: Centrelines
    ) -> tuple[ObservedParcels | None, Geometries]:
        """Parcels without those that are streets, and the polygons of these."""
        if self.parcels is None:
            return None, np.empty(0, dtype=object)
        self.issues += self.parcels.issues
        snap = max(self.params.snap_tolerance, NODE_GRID)
        width = lines.width[work.line]
        found = street_parcels(self.parcels.polygons, work, width, snap=snap)
        roads = self.parcels.polygons[found]
        if found.any():
            area = float(shapely.area(roads).sum())
            message = (
                f"{int(found.sum())} parcel(s) are streets ({area:.0f} m²): centrelines run "
                "through them. They count as land of streets."
            )
            places = shapely.MultiPolygon(roads.tolist())
            self.issues.append(
                Issue("street_parcels", message, value=float(found.sum()), geometry=places)
            )
        return (None if found.all() else self.parcels.take(~found)), roads

    def _land(
        self, lines: StreetLines, work: Centrelines, parcels: ObservedParcels | None
    ) -> list[shapely.Polygon]:
        if self.given is not None:
            return list(self.given)
        if parcels is not None:
            land = town_outline(
                parcels.polygons,
                parcels.union,
                (work, lines.width[work.line]),
                reach=self.params.street_reach,
            )
            area = sum(polygon.area for polygon in land)
            message = (
                f"No land was given: it is what the parcels and the streets among them cover, in "
                f"{len(land)} piece(s), {area / 1e4:.4g} ha. Its rim is the centreline where a "
                "street runs around the parcels; what has neither parcels nor streets is no land."
            )
        else:
            hull = shapely.convex_hull(shapely.multilinestrings(list(work.segments)))
            if not len(work.line) or hull.area <= 0:
                raise BoundaryError(
                    "The streets have no extent: give the land that they lie in, or more streets."
                )
            land = (hull,)
            message = (
                "No land was given: it is the convex hull of the streets "
                f"({hull.area / 1e4:.4g} ha), those on it are streets of the rim."
            )
        self.issues.append(Issue("land_assumed", message, value=float(sum(p.area for p in land))))
        return list(land)

    def _tell_of_streets(self, ground: StreetsInLand) -> None:
        if self.streets is None:
            message = (
                "There are no streets: frontage, blocks and whatever else depends on streets are "
                "not known."
            )
            self.issues.append(Issue("no_streets_given", message))
            return
        if not ground.network.n_edges:
            message = (
                "No street enters the land: check that both layers are of one place, and that "
                "the streets are no footpaths (see footpaths)."
            )
            if self.parcels is None:
                raise BoundaryError(message)
            self.issues.append(Issue("no_street_enters", message))
        elif not (ground.network.node_kind == NodeKind.ENTRY).any() and self.given is not None:
            inner = ~ground.network.edge_rim
            if not inner.any():
                message = "No street enters the land: streets run along its rim alone."
                self.issues.append(Issue("no_street_enters", message))
        if self.given is not None and ground.outside > self.params.snap_tolerance:
            message = f"{ground.outside:.0f} m of streets are outside the land and count not."
            self.issues.append(Issue("streets_outside", message, value=ground.outside))

    def _in_land(self, parcels: ObservedParcels, land: Geometries) -> ObservedParcels:
        """Parcels of which the land has more than `INSIDE_SHARE`."""
        if self.given is None:
            return parcels
        ground = shapely.union_all(land)
        shapely.prepare(ground)
        inside = shapely.contains_properly(ground, parcels.polygons)
        rows = np.flatnonzero(~inside)
        area = shapely.area(parcels.polygons[rows])
        shared = np.zeros(len(rows))
        touches = shapely.intersects(ground, parcels.polygons[rows])
        shared[touches] = shapely.area(
            shapely.intersection(parcels.polygons[rows[touches]], ground)
        )
        inside[rows] = shared > INSIDE_SHARE * area
        cut = inside[rows] & (area - shared > OVERLAP_SHARE * area)
        out = int((~inside).sum())
        if out == len(parcels):
            raise BoundaryError(
                "No parcel lies in the land: check that both layers are of one place."
            )
        if out:
            message = f"{out} parcel(s) lie outside the land, or for the most part, and count not."
            self.issues.append(Issue("parcels_outside", message, value=float(out)))
        if cut.any():
            message = (
                f"{int(cut.sum())} parcel(s) reach beyond the land "
                f"({(area - shared)[cut].sum():.0f} m²) and count whole."
            )
            self.issues.append(Issue("parcels_cut", message, value=float(cut.sum())))
        return parcels.take(inside)

    def _described(
        self, parcels: ObservedParcels, ground: StreetsInLand, roads: Geometries
    ) -> tuple[FabricParcels, StreetLand | None]:
        """The parcels with what streets and neighbours make of them, and the land of streets."""
        known, gross = describe_parcels(
            parcels, ground, self.params, streets_known=self.streets is not None
        )
        self._tell_of_overlaps(parcels, known.rings.area)
        if self.streets is None:
            return known, None
        if gross:
            message = (
                "Parcels run to the centreline of streets: their net areas are less the nominal "
                "widths of these."
            )
            self.issues.append(Issue("gross_parcels", message))
            taken = gross_street_land(ground, parcels.polygons, known.block)
        else:
            taken = net_street_land(
                ground,
                parcels.union,
                known.rings.area,
                roads,
                reach=self.params.street_reach,
            )
        return replace(known, net_area=taken.net_area), taken

    def _tell_of_overlaps(self, parcels: ObservedParcels, area: FloatArray) -> None:
        total = float(area.sum())
        twice = total - float(shapely.area(parcels.union))
        if twice > OVERLAP_SHARE * total:
            message = f"Parcels overlap: {twice:.0f} m² of them are there twice or more."
            self.issues.append(Issue("parcels_overlap", message, value=twice))
