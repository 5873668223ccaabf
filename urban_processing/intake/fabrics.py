"""A fabric from layers of parcels, streets and land, whatever program made them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.streets import StreetLines
from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import Fabric
from urban_processing.fabric.observed import ObservedParcels
from urban_processing.fabric.of_layers import fabric_of_layers
from urban_processing.intake.crs_choice import CrsLibrary, crs_label
from urban_processing.intake.features import Features
from urban_processing.intake.given import USE_COLUMNS, layers_digest, text, wrong_kind
from urban_processing.intake.numbers import is_whole, numbered
from urban_processing.intake.polygons import CleanedEach, clean_each
from urban_processing.intake.projection import Projection
from urban_processing.intake.sites import build_site
from urban_processing.intake.street_lines import build_streets, street_lines_in
from urban_processing.intake.working import source_crs, working_crs
from urban_processing.layout import PARCEL_USE
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.planar import BoolArray, IntArray
from urban_processing.params.measure import MeasureParams
from urban_processing.site import GRID, Frame, Issue, Site

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]

PARCEL_ID = "parcel_id"
PARCEL_COLUMNS = (PARCEL_ID, *USE_COLUMNS)
"""Attributes of parcels that are looked for."""

FAR = 100.0
"""Layers whose bounds are further apart, in metres, are of different places."""

TINY = 1.0
"""Pieces of parcels below this many m² are left over from drawing."""

SAME = 0.01
"""Parcels are there twice if their coordinates are the same to so many metres."""

_NEED = (
    "Parcels must be polygons; closed lines can be turned into polygons first (in QGIS: Lines to "
    "Polygons)."
)


def build_fabric(
    parcels: Features[C] | None,
    streets: Features[C] | None,
    land: Features[C] | None = None,
    *,
    library: CrsLibrary[C],
    asked: C | None = None,
    params: MeasureParams | None = None,
    problems: Sequence[str] = (),
) -> Fabric:
    """Make a fabric of layers: see `fabric_of_layers`.

    All are brought into one projected, metric CRS: that of the land, else of the parcels, else of
    the streets, if it is fit.

    Parameters
    ----------
    parcels
        Polygons; ``parcel_id`` numbers them, ``land_use``, ``landuse`` or ``use`` says what they
        are used for.
    streets
        Lines; see `build_streets` for their columns.
    land
        Polygons of the land.
    library
        What knows the CRSs.
    asked
        Projected, metric CRS to work in; the CRS of layers that have none.
    params
        Widths and tolerances.
    problems
        What is wrong already: raised with all else that is.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    found = [*problems, *wrong_kind(streets, "Streets", "line")]
    if parcels is None and streets is None:
        raise BoundaryError(found or ["Give parcels, streets, or both."])
    cleaned = None if parcels is None else _cleaned(parcels, found)
    if found:
        raise BoundaryError(found)
    reading = _Reading(library, asked)
    site = None
    if land is not None:
        site = build_site(land, library=library, asked=asked)
        target = library.from_text(site.frame.crs) if site.frame.crs else None
        reading.start("land", land, target, site.frame)
    known = None
    if parcels is not None and cleaned is not None:
        known = reading.parcels(parcels, cleaned)
    lines = None if streets is None else reading.streets(streets)
    _must_meet(known, lines, site, reading)
    made = fabric_of_layers(lines, known, None if site is None else site.parts, params)
    layers = [layer for layer in (land, parcels, streets) if layer is not None]
    of_site = () if site is None else site.issues
    return replace(
        made,
        issues=(*of_site, *reading.issues, *made.issues),
        input_sha256=layers_digest("", layers),
    )


def _cleaned(features: Features[Any], problems: list[str]) -> CleanedEach | None:
    try:
        return clean_each(features, need=_NEED)
    except BoundaryError as error:
        problems += [f"Parcels: {problem}" for problem in error.problems]
        return None


@dataclass(eq=False)
class _Reading(Generic[C]):
    """Layers on their way into one frame: that of the first of them."""

    library: CrsLibrary[C]
    asked: C | None

    def __post_init__(self) -> None:
        self.issues: list[Issue] = []
        self.first = ""
        self.frame = Frame()
        self.projection: Projection[C] = Projection(None, None, self.library)

    def start(self, name: str, features: Features[C], target: C | None, frame: Frame) -> None:
        """Take the frame of a layer for all."""
        source = features.crs if features.crs is not None else self.asked
        self.first, self.frame = name, frame
        self.projection = Projection(source, target, self.library)

    def follow(self, name: str, features: Features[C]) -> Projection[C]:
        """The way into the frame of the first layer; it is said if that changes the CRS."""
        first = self.projection.source
        if features.crs is None and not features.bare and first is not None:
            message = (
                f"The {name} have no CRS: that of the {self.first}, "
                f"{crs_label(first, self.library)}, was taken for it."
            )
            self.issues.append(Issue("crs_assumed", message))
        target = self.projection.target
        if features.crs is not None and target is None:
            raise BoundaryError(
                f"The {name} have a CRS, {crs_label(features.crs, self.library)}, but the "
                f"{self.first} have none: give it with crs (--crs EPSG:code), or assign it in the "
                "data."
            )
        if features.crs is not None and target is not None and features.crs != first:
            message = (
                f"The {name} are in {crs_label(features.crs, self.library)}, not in the CRS of "
                f"the {self.first}: they were reprojected to {crs_label(target, self.library)}."
            )
            self.issues.append(Issue("layer_reprojected", message))
        return self.projection.of(features)

    def streets(self, features: Features[C]) -> StreetLines:
        """Lines of streets in the frame."""
        if self.first:
            self.follow("streets", features)
            return street_lines_in(features, self.projection, self.frame)
        found = build_streets(
            features, library=self.library, asked=self.asked, result="what is measured is"
        )
        return found.streets

    def parcels(self, features: Features[C], cleaned: CleanedEach) -> ObservedParcels:
        """Parcels in the frame."""
        self.issues += [Issue(n.code, n.message, value=n.value) for n in cleaned.notes]
        if self.first:
            mapped = self.follow("parcels", features).geometries(cleaned.valid)
        else:
            mapped = self._first_parcels(features, cleaned)
        local = shapely.transform(mapped, lambda xy: xy - self.frame.origin)
        polygons, row = self._single(local, cleaned.row, features.name)
        number, order = self._numbers(features, polygons, row)
        uses = features.column(*USE_COLUMNS)
        use = np.full(len(polygons), PARCEL_USE, dtype=object)
        if uses is not None:
            use[:] = [text(uses[i]) or PARCEL_USE for i in row.tolist()]
        return ObservedParcels(polygons[order], number, use[order], self.frame)

    def _first_parcels(self, features: Features[C], cleaned: CleanedEach) -> ObjectArray:
        """Parcels in a CRS that is chosen for them, whose frame is that of all layers."""
        problems: list[str] = []
        own = source_crs(features, self.asked, self.library, problems, self.issues)
        if problems:
            raise BoundaryError([f"Parcels: {problem}" for problem in problems])
        xy = shapely.get_coordinates(cleaned.valid)
        if not len(xy):
            raise BoundaryError(f"{features.name}: its polygons have no area.")
        target = working_crs(
            xy,
            own,
            self.asked,
            self.library,
            self.issues,
            what="The parcels are",
            result="what is measured is",
        )
        mapped = Projection(own, target, self.library).geometries(cleaned.valid)
        if not np.isfinite(shapely.get_coordinates(mapped)).all():
            raise BoundaryError(
                f"{features.name}: some coordinates have no place in the CRS asked for: choose "
                "one that covers the parcels, or leave crs (--crs) out."
            )
        west, south = shapely.total_bounds(mapped)[:2]
        crs = "" if target is None else self.library.text(target)
        frame = Frame(crs, (float(math.floor(west)), float(math.floor(south))))
        self.start("parcels", features, target, frame)
        return mapped

    def _single(
        self, local: ObjectArray, rows: IntArray, name: str
    ) -> tuple[ObjectArray, IntArray]:
        """Single polygons on the grid, each once, and the row of each."""
        if not np.isfinite(shapely.get_coordinates(local)).all():
            raise BoundaryError(
                f"{name}: some coordinates have no place in the CRS of the {self.first}. Check "
                "the CRS of the layer."
            )
        whole = shapely.set_precision(shapely.make_valid(local), GRID)
        parts, of = shapely.get_parts(whole, return_index=True)
        is_polygon = shapely.get_type_id(parts) == shapely.GeometryType.POLYGON
        parts, row = canonical_rings(parts[is_polygon]), rows[of[is_polygon]]
        tiny = shapely.area(parts) < TINY
        if tiny.all():
            raise BoundaryError(
                f"{name}: its polygons have no area. If their coordinates are degrees, give their "
                "CRS."
            )
        if tiny.any():
            message = f"{int(tiny.sum())} piece(s) of parcels below {TINY:g} m² were left out."
            self.issues.append(Issue("tiny_parcels", message, value=float(tiny.sum()), limit=TINY))
        parts, row = parts[~tiny], row[~tiny]
        twice = _repeated(parts, row)
        if twice.any():
            message = f"{int(twice.sum())} parcel(s) are there twice or more and count once."
            self.issues.append(Issue("parcels_twice", message, value=float(twice.sum())))
        return parts[~twice], row[~twice]

    def _numbers(
        self, features: Features[C], polygons: ObjectArray, row: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Numbers of the parcels, ascending, and the parcel of each."""
        given = _given_numbers(features, row)
        if given is None and PARCEL_ID in features.columns:
            message = (
                f"Column {PARCEL_ID} has not one whole number for each parcel: parcels were "
                "numbered by place."
            )
            self.issues.append(Issue("parcel_id_ignored", message))
        number, order, extra = numbered(polygons, row, given)
        if extra:
            message = (
                f"{extra} parcel(s) more than rows: polygons in several pieces are several parcels."
            )
            self.issues.append(Issue("parcels_of_parts", message, value=float(extra)))
        return number, order


def _repeated(polygons: ObjectArray, row: IntArray) -> BoolArray:
    """(P,) polygons that are there before, in a lower row."""
    rounded = shapely.normalize(
        shapely.transform(polygons, lambda xy: np.round(xy / SAME) * SAME + 0.0)
    )
    keys = np.array(shapely.to_wkb(rounded, byte_order=1), dtype=object)
    order = np.lexsort((np.arange(len(row)), row))
    _, first = np.unique(keys[order], return_index=True)
    out = np.ones(len(row), dtype=bool)
    out[order[first]] = False
    return out


def _given_numbers(features: Features[Any], row: IntArray) -> IntArray | None:
    """(n,) numbers of the rows; None where they are not whole numbers, each once."""
    values = features.columns.get(PARCEL_ID)
    if values is None:
        return None
    out = np.zeros(len(values), dtype=np.int64)
    for i in np.unique(row).tolist():
        if not is_whole(values[i]):
            return None
        out[i] = int(values[i])
    known = out[np.unique(row)]
    return out if len(np.unique(known)) == len(known) else None


def _must_meet(
    parcels: ObservedParcels | None,
    streets: StreetLines | None,
    site: Site | None,
    reading: _Reading[C],
) -> None:
    """Raise if layers lie in different places, and say where each is."""
    places = {
        "land": None if site is None else shapely.total_bounds(list(site.parts)),
        "parcels": None if parcels is None else shapely.total_bounds(parcels.polygons),
        "streets": None if streets is None else shapely.total_bounds(streets.lines),
    }
    there = [(name, box) for name, box in places.items() if box is not None]
    base, first = there[0]
    for name, box in there[1:]:
        gap = np.maximum(np.maximum(first[:2] - box[2:], box[:2] - first[2:]), 0.0)
        if math.hypot(*gap) <= FAR:
            continue
        crs = reading.frame.crs
        in_crs = f" in {crs}" if crs and len(crs) < 20 else ""
        raise BoundaryError(
            f"The {base} and the {name} do not overlap: the first lie within "
            f"{_where(first, reading.frame)}, the second within "
            f"{_where(box, reading.frame)}{in_crs}. "
            "Check the CRS of both layers, and that they are of one place."
        )


def _where(box: npt.NDArray[np.float64], frame: Frame) -> str:
    west, south, east, north = (box + np.tile(frame.origin, 2)).tolist()
    return f"x {west:.0f} to {east:.0f}, y {south:.0f} to {north:.0f}"
