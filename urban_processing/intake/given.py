"""Layers that constrain a layout: streets, obstacles, locked land, the rim and its entries."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.features import Features
from urban_processing.intake.polygons import Note, clean_each, clean_polygons
from urban_processing.intake.projection import Projection
from urban_processing.mesh.build import canonical_rings
from urban_processing.site import (
    GRID,
    FixedStreet,
    FloatArray,
    Issue,
    LockedLand,
    Site,
    snap_to_grid,
)

C = TypeVar("C")

RIM_REACH = 0.02
"""Entries, and lines that say which part of the rim is street, may lie this far off the rim,
relative to √area of the land."""

CLASS_COLUMNS = ("class", "street_class")
WIDTH_COLUMNS = ("width_m", "width")
USE_COLUMNS = ("land_use", "landuse", "use")
"""Attributes that are looked for, the first that is there is taken."""

GIVEN_COLUMNS = (*CLASS_COLUMNS, *WIDTH_COLUMNS, *USE_COLUMNS)

_MAX_NAMED = 5


@dataclass(frozen=True)
class GivenLayers(Generic[C]):
    """Features as they were read; None where a layer was not given.

    Parameters
    ----------
    fixed_streets
        Lines of streets; their attributes may say class and width.
    obstacles
        Polygons that no cut and no street crosses.
    locked
        Polygons that stay parcels; an attribute may say their land use.
    rim_lines
        Lines along the rim.
    entries
        Points on the rim.
    """

    fixed_streets: Features[C] | None = None
    obstacles: Features[C] | None = None
    locked: Features[C] | None = None
    rim_lines: Features[C] | None = None
    entries: Features[C] | None = None

    def problems(self) -> list[str]:
        """Return what is wrong with the kinds of geometry and with coordinates."""
        return [
            *wrong_kind(self.fixed_streets, "Fixed streets", "line"),
            *wrong_kind(self.rim_lines, "Rim lines", "line"),
            *wrong_kind(self.entries, "Entries", "point"),
            *wrong_kind(self.obstacles, "Obstacles", "polygon"),
            *wrong_kind(self.locked, "Locked land", "polygon"),
        ]

    def put_into(self, site: Site, projection: Projection[C]) -> Site:
        """Return the site with all that was given, in its local coordinates.

        Raises
        ------
        BoundaryError
            With everything that is wrong with the layers.
        """
        problems: list[str] = []
        issues: list[Issue] = []
        local = _Local(projection, site.frame.origin, problems, issues)
        whole = dataclasses.replace(
            site,
            fixed_streets=tuple(local.streets(self.fixed_streets)),
            obstacles=tuple(local.obstacles(self.obstacles)),
            locked=tuple(local.locked(self.locked)),
            rim_lines=tuple(local.rim_lines(self.rim_lines, site)),
            entries=local.entries(self.entries, site),
        )
        if problems:
            raise BoundaryError(problems)
        layers = [getattr(self, field.name) for field in dataclasses.fields(self)]
        layers = [features for features in layers if features is not None]
        return dataclasses.replace(
            whole,
            issues=(*site.issues, *issues),
            input_sha256=layers_digest(site.input_sha256, layers) if layers else site.input_sha256,
        )


def wrong_kind(features: Features[Any] | None, name: str, kind: str) -> list[str]:
    """Say if a layer has no geometry, another kind of geometry, or coordinates without value."""
    if features is None:
        return []
    usable = features.geometry[features.present()]
    if not len(usable):
        return [f"{name}: {features.name} has no {kind}s: leave it out, or give another layer."]
    parts = flat_geometries(list(usable))
    found = {g.geom_type for g in parts}
    wanted = {"line": {"LineString", "LinearRing"}, "point": {"Point"}, "polygon": {"Polygon"}}
    if found - wanted[kind]:
        return [f"{name} must be {kind}s; {features.name} has {', '.join(sorted(found))}."]
    if not np.isfinite(shapely.get_coordinates(usable)).all():
        return [f"{name}: a coordinate is not finite (NaN or infinite): correct the data."]
    return []


def flat_geometries(geometry: Sequence[shapely.Geometry]) -> list[shapely.Geometry]:
    """Single geometries of possibly nested collections."""
    out: list[shapely.Geometry] = []
    for g in geometry:
        out += flat_geometries(list(g.geoms)) if hasattr(g, "geoms") else [g]
    return out


@dataclass
class _Local(Generic[C]):
    """Layers to local coordinates; what is wrong and what should be known is collected."""

    projection: Projection[C]
    origin: tuple[float, float]
    problems: list[str]
    issues: list[Issue]

    def _geometry(self, features: Features[C], geometry: shapely.Geometry) -> shapely.Geometry:
        mapped = self.projection.of(features).geometry(shapely.force_2d(geometry))
        if not np.isfinite(shapely.get_coordinates(mapped)).all():
            raise BoundaryError(
                f"{features.name}: some coordinates have no place in the CRS of the layout. Check "
                "the CRS of the layer."
            )
        return shapely.transform(mapped, lambda xy: snap_to_grid(xy - self.origin))

    def _lines(
        self, features: Features[C] | None, name: str
    ) -> Iterator[tuple[int, shapely.LineString]]:
        if features is None:
            return
        for row in features.present():
            for line in flat_geometries([features.geometry[row]]):
                try:
                    local = self._geometry(features, shapely.LineString(line.coords))
                except BoundaryError as error:
                    self.problems += [f"{name}: {problem}" for problem in error.problems]
                    return
                if local.length > 0:
                    yield row, local

    def streets(self, features: Features[C] | None) -> list[FixedStreet]:
        """Lines of fixed streets with class and width."""
        lines = list(self._lines(features, "Fixed streets"))
        if features is None or not lines:
            return []
        names, widths = features.column(*CLASS_COLUMNS), features.column(*WIDTH_COLUMNS)
        width = _positive_numbers(widths, len(features.geometry))
        bad = (
            0
            if widths is None
            else sum(math.isnan(width[i]) and not is_blank(widths[i]) for i in features.present())
        )
        if bad:
            self.issues.append(
                Issue(
                    "width_ignored",
                    f"{bad} width(s) of fixed streets are no positive numbers: the nominal width "
                    "is taken.",
                    value=float(bad),
                )
            )
        return [
            FixedStreet(line, "" if names is None else text(names[row]), float(width[row]))
            for row, line in lines
        ]

    def rim_lines(self, features: Features[C] | None, site: Site) -> list[shapely.LineString]:
        """Lines along the rim, checked to lie near it."""
        lines = [line for _, line in self._lines(features, "Rim lines")]
        rim = _rim(site)
        for i, line in enumerate(lines):
            ends = shapely.get_coordinates(line)[[0, len(line.coords) // 2, -1]]
            self._check_near("Rim line", i, shapely.MultiPoint(ends), site, rim)
        return lines

    def _check_near(
        self, name: str, i: int, places: shapely.Geometry, site: Site, rim: shapely.Geometry
    ) -> None:
        reach = RIM_REACH * site.area**0.5
        distance = float(shapely.distance(shapely.get_parts(places), rim).max())
        if not distance <= reach:
            self.problems.append(
                f"{name} {i + 1} lies {distance:.3g} m from the rim of the land; it must lie on "
                f"it, or within {reach:.3g} m. Check its place and its CRS."
            )

    def entries(self, features: Features[C] | None, site: Site) -> FloatArray:
        """Places of entries, checked to lie near the rim."""
        if features is None:
            return np.empty((0, 2))
        points = flat_geometries(list(features.geometry[features.present()]))
        try:
            local = [self._geometry(features, p) for p in points]
        except BoundaryError as error:
            self.problems += [f"Entries: {problem}" for problem in error.problems]
            return np.empty((0, 2))
        rim = _rim(site)
        for i, point in enumerate(local):
            self._check_near("Entry", i, point, site, rim)
        return np.asarray(shapely.get_coordinates(local))

    def obstacles(self, features: Features[C] | None) -> list[shapely.Polygon]:
        """Obstacles, united and valid."""
        if features is None:
            return []
        try:
            cleaned = clean_polygons(features)
            united = self._polygonal(features, cleaned.land)
        except BoundaryError as error:
            self.problems += [f"Obstacles: {problem}" for problem in error.problems]
            return []
        self._note("obstacle", cleaned.notes)
        return united

    def locked(self, features: Features[C] | None) -> list[LockedLand]:
        """Locked polygons with their uses; where two overlap the first has the land."""
        if features is None:
            return []
        uses = features.column(*USE_COLUMNS)
        out: list[LockedLand] = []
        try:
            each = clean_each(features)
            for polygon, row in zip(each.valid, each.row.tolist(), strict=True):
                use = "" if uses is None else text(uses[row])
                taken = shapely.union_all([other.polygon for other in out])
                for piece in self._polygonal(features, polygon):
                    rest = shapely.difference(piece, taken, grid_size=GRID)
                    out += [LockedLand(p, use) if use else LockedLand(p) for p in _polygons(rest)]
        except BoundaryError as error:
            self.problems += [f"Locked land: {problem}" for problem in error.problems]
            return []
        self._note("locked land", each.notes)
        return out

    def _polygonal(
        self, features: Features[C], geometry: shapely.Geometry
    ) -> list[shapely.Polygon]:
        mapped = shapely.make_valid(self._geometry(features, geometry))
        return _polygons(shapely.set_precision(shapely.union_all(_polygons(mapped)), GRID))

    def _note(self, what: str, notes: Sequence[Note]) -> None:
        self.issues += [Issue(n.code, f"Of the {what}: {n.message}", value=n.value) for n in notes]


def _rim(site: Site) -> shapely.Geometry:
    return shapely.union_all([p.exterior for p in site.parts])


def _polygons(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    """Polygons of any geometry, in the order of their coordinates."""
    parts = [p for p in flat_geometries([geometry]) if p.geom_type == "Polygon" and p.area > 0]
    canonical = canonical_rings(np.array(parts, dtype=object))
    return sorted(canonical, key=lambda p: (p.bounds, p.wkb))


def _positive_numbers(values: npt.NDArray[Any] | None, n: int) -> FloatArray:
    """(n,) values that are positive finite numbers, NaN for all others."""
    out = np.full(n, math.nan)
    for i, value in enumerate([] if values is None else values.tolist()):
        try:
            number = float(value)
        except (TypeError, ValueError):
            continue
        if math.isfinite(number) and number > 0:
            out[i] = number
    return out


def is_blank(value: Any) -> bool:
    """Whether an attribute has no value: None, an empty text or NaN."""
    return value is None or value == "" or (isinstance(value, float) and math.isnan(value))


def text(value: Any) -> str:
    """Return an attribute as text, empty where there is none."""
    return "" if is_blank(value) else str(value).strip()


def layers_digest(before: str, layers: Sequence[Features[Any]]) -> str:
    """Hash of all that was given, whatever the order of features."""
    found = hashlib.sha256(before.encode())
    for features in layers:
        wkb = shapely.to_wkb(features.geometry[features.present()], byte_order=1)
        found.update(b"|" + b"".join(sorted(wkb)))
    return found.hexdigest()
