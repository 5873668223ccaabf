"""Parcels before and after an edit, as layers of any origin, made ready to be compared."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import CrsLibrary, choose_crs, crs_label
from urban_processing.intake.features import Features
from urban_processing.intake.polygons import clean_each
from urban_processing.intake.projection import Projection
from urban_processing.persistence.editions import Edition, Editions
from urban_processing.site import Frame, Issue

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True)
class EditionLayers(Generic[C]):
    """Layers of one state as they were read; blocks are polygons, or lines around them."""

    parcels: Features[C]
    blocks: Features[C] | None = None


def build_editions(
    before: EditionLayers[C], after: EditionLayers[C], *, library: CrsLibrary[C]
) -> Editions:
    """Bring two states of a layout into one metric CRS.

    It is that of the parcels after the edit where it is metric and true to area. A layer
    without a CRS is taken to be in that of the other parcels; the issues say so.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    crs = before.parcels.crs if after.parcels.crs is None else after.parcels.crs
    layers = {"Parcels before": before.parcels, "Parcels after": after.parcels}
    if crs is None and not all(layer.bare for layer in layers.values()):
        raise BoundaryError(
            f"{before.parcels.name} and {after.parcels.name} have no CRS: assign it in the data."
        )
    cleaned: dict[str, _Cleaned] = {}
    problems: list[str] = []
    issues: list[Issue] = []
    for called, layer in layers.items():
        try:
            cleaned[called] = _Cleaned(layer)
            issues += cleaned[called].issues(called)
        except BoundaryError as error:
            problems += [f"{called}: {problem}" for problem in error.problems]
    if problems:
        raise BoundaryError(problems)
    target = crs
    if crs is not None:
        xy = shapely.get_coordinates(cleaned["Parcels after"].polygons)
        target = choose_crs(crs, xy, library).crs
    projection = Projection(crs, target, library)
    issues += _reprojected(layers, target, library)
    low = np.floor(shapely.total_bounds(projected(cleaned["Parcels after"].polygons, projection)))
    frame = Frame("" if target is None else library.text(target), (float(low[0]), float(low[1])))
    made = [
        _edition(cleaned[called], edition, projection, frame)
        for called, edition in (("Parcels before", before), ("Parcels after", after))
    ]
    return Editions(made[0], made[1], frame, tuple(issues), _digest(made))


class _Cleaned:
    """Valid parcels of a layer, one for each row that has a polygon."""

    def __init__(self, layer: Features[Any]) -> None:
        each = clean_each(layer)
        some = ~shapely.is_empty(each.valid)
        if not some.any():
            raise BoundaryError(f"{layer.name}: its polygons have no area.")
        self.notes = each.notes
        self.layer = layer
        valid = each.valid[some]
        self.rows, first, count = np.unique(each.row[some], return_index=True, return_counts=True)
        self.polygons = valid[first]
        several = (count > 1) | (shapely.get_type_id(valid[first]) != shapely.GeometryType.POLYGON)
        for i in np.flatnonzero(several):
            self.polygons[i] = _one(valid[first[i] : first[i] + count[i]])

    def issues(self, called: str) -> Iterator[Issue]:
        """What was repaired or left out."""
        for note in self.notes:
            yield Issue(note.code, f"{called}: {note.message}", value=note.value)


def _one(parts: ObjectArray) -> shapely.Geometry:
    whole = parts[0] if len(parts) == 1 else shapely.union_all(parts)
    if whole.geom_type in ("Polygon", "MultiPolygon"):
        return whole
    areas = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon"]
    return areas[0] if len(areas) == 1 else shapely.MultiPolygon(areas)


def projected(geometries: ObjectArray, projection: Projection[Any]) -> ObjectArray:
    """(n,) geometries in the target of a projection."""
    if projection.is_identity:
        return geometries
    return np.array([projection.geometry(g) for g in geometries], dtype=object)


def _edition(
    cleaned: _Cleaned,
    layers: EditionLayers[Any],
    projection: Projection[Any],
    frame: Frame,
) -> Edition:
    def local(geometries: ObjectArray, features: Features[Any]) -> ObjectArray:
        mapped = projected(geometries, projection.of(features))
        if not np.isfinite(shapely.get_coordinates(mapped)).all():
            raise BoundaryError(
                f"Some coordinates of {features.name} have no place in the CRS of the parcels: "
                "check the CRS of both."
            )
        return np.asarray(shapely.transform(mapped, lambda xy: xy - np.asarray(frame.origin)))

    blocks = None
    if layers.blocks is not None:
        blocks = local(_blocks_of(layers.blocks), layers.blocks)
    return Edition(
        local(cleaned.polygons, layers.parcels),
        {name: values[cleaned.rows] for name, values in layers.parcels.columns.items()},
        blocks,
        layers.parcels.name,
    )


def _blocks_of(features: Features[Any]) -> ObjectArray:
    """Polygons of blocks: as given, or the faces between lines such as streets."""
    present = features.geometry[features.present()]
    kinds = {g.geom_type for g in present}
    if kinds and kinds <= {"LineString", "MultiLineString", "LinearRing"}:
        noded = shapely.union_all(shapely.force_2d(present))
        blocks = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    else:
        blocks = shapely.get_parts(clean_each(features).valid)
        blocks = blocks[shapely.area(blocks) > 0]
    if not len(blocks):
        raise BoundaryError(f"{features.name} has no polygon, and no lines that surround one.")
    return np.asarray(blocks, dtype=object)


def _reprojected(
    layers: Mapping[str, Features[C]], target: C | None, library: CrsLibrary[C]
) -> Iterator[Issue]:
    """Say which layers are in another CRS than the result, and which have none."""
    if target is None:
        return
    label = crs_label(target, library)
    for called, layer in layers.items():
        if layer.crs is None:
            message = f"{called}: {layer.name} has no CRS; it was taken to be that of the other."
            yield Issue("crs_missing", message)
        elif layer.crs != target:
            own = crs_label(layer.crs, library)
            yield Issue("crs_changed", f"{called}: reprojected from {own} to {label}.")


def _digest(editions: list[Edition]) -> str:
    digest = hashlib.sha256()
    for edition in editions:
        for geometries in (edition.polygons, edition.blocks):
            if geometries is not None:
                digest.update(b"".join(shapely.to_wkb(geometries).tolist()))
        for name, values in sorted(edition.columns.items()):
            digest.update(f"{name}={values.tolist()!r}".encode())
    return digest.hexdigest()
