"""What must hold of every moment of a session, whatever was done."""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.access_rule import unreached_parcels_of
from urban_processing.layout import NOT_FIXED, EdgeKind, Layout
from urban_processing.mesh.components import components
from urban_processing.rebuild import canonical
from urban_processing.session.session import Session
from urban_processing.site import AREA_ROUNDING

SAME_M = 2e-6
"""What stays is within this many metres of where it was: coordinates are kept on a grid."""


def fingerprint(session: Session) -> str:
    """Hash of all that a session has now: every array, the numbers, and how far it has come."""
    layout = session.layout
    told = [str((session.parcels, session.level, session.finished, session.is_complete))]
    arrays = hashlib.sha256()
    for name in ("xy", "origin", "next", "face"):
        arrays.update(getattr(layout.mesh, name).tobytes())
    for each in dataclasses.fields(Layout):
        value = getattr(layout, each.name)
        if isinstance(value, np.ndarray):
            arrays.update(each.name.encode() + str(value.dtype).encode() + value.tobytes())
        elif each.name not in ("mesh", "history"):
            told.append(f"{each.name} {value!r}")
    history = [(step.algorithm, step.parameters, step.results) for step in layout.history]
    arrays.update(repr((told, history)).encode())
    return arrays.hexdigest()


@dataclass(frozen=True)
class Seen:
    """A moment of a session as it was seen."""

    layout: Layout
    parcels: tuple[int, ...]
    polygons: np.ndarray
    smallest: float

    @classmethod
    def of(cls, session: Session, *edits: str) -> Seen:
        """What there is now, or after some more edits."""
        for name in edits:
            session.do(name)
        layout = session.layout
        return cls(layout, session.parcels, layout.mesh.face_polygons(), layout.min_area)

    def polygon(self, number: int) -> shapely.Polygon:
        """A parcel by its number."""
        return self.polygons[self.parcels.index(number)]

    @property
    def unreached(self) -> set[int]:
        """Numbers of the parcels that no street reaches."""
        return {self.parcels[face] for face in unreached_parcels_of(self.layout).tolist()}

    @property
    def small(self) -> dict[int, float]:
        """Areas of the parcels under the smallest area that are not locked, by number."""
        area = self.layout.mesh.face_area
        low = (area < self.smallest * (1 - AREA_ROUNDING)) & ~self.layout.face_locked
        return {self.parcels[face]: float(area[face]) for face in np.flatnonzero(low).tolist()}

    @property
    def networks(self) -> list[int]:
        """Number of connected networks of streets of each part of the land."""
        layout, mesh = self.layout, self.layout.mesh
        edges = np.flatnonzero(layout.edge_street)
        ends = mesh.origin.reshape(-1, 2)[edges]
        label = components(mesh.n_vertices, ends)
        part = layout.face_part[mesh.face.reshape(-1, 2)[edges].max(axis=1)]
        return [
            len(np.unique(label[ends[part == each]])) for each in range(layout.face_part.max() + 1)
        ]

    def lines(self, chosen: np.ndarray) -> shapely.Geometry:
        """Edges of the mesh as one geometry."""
        ends = self.layout.mesh.xy[self.layout.mesh.origin.reshape(-1, 2)[chosen]]
        return shapely.union_all(shapely.linestrings(ends))


def assert_whole(seen: Seen, land: shapely.Geometry) -> None:
    """The layout is a mesh that is in order, and its parcels are the land."""
    layout, polygons = seen.layout, seen.polygons
    layout.mesh.validate()
    assert shapely.is_valid(polygons).all()
    assert shapely.coverage_is_valid(polygons)
    union = shapely.coverage_union_all(polygons)
    off = shapely.symmetric_difference(union, land).area
    assert off <= 1e-8 * land.area, f"{off} m² off the land"
    for each in dataclasses.fields(Layout):
        value = getattr(layout, each.name)
        if isinstance(value, np.ndarray):
            size = {
                "v": layout.mesh.n_vertices,
                "e": layout.mesh.n_edges,
                "f": layout.mesh.n_faces,
            }[each.name[0]]
            assert len(value) == size, each.name
    assert len(np.unique(layout.face_lineage)) == layout.mesh.n_faces
    assert len(set(seen.parcels)) == len(seen.parcels) == layout.mesh.n_faces
    assert ((layout.edge_fixed == NOT_FIXED) | layout.edge_street).all()
    assert layout.edge_fixed.max() < len(layout.fixed_streets)
    assert layout.face_use.max() < len(layout.land_uses)
    assert ((layout.edge_level >= 0) == layout.edge_street).all()


def assert_requirements(before: Seen, after: Seen, *, is_level: bool) -> None:
    """No design requirement that was kept is broken (Chen 2024, section 3).

    Where the rim is no street, or is none any more, a level may leave a parcel that only a way
    along the rim would reach: cuts of later levels open another way to it.
    """
    amiss = before.unreached
    lost = after.unreached - amiss
    if amiss:
        held = shapely.union_all([before.polygon(number) for number in amiss]).buffer(SAME_M)
        lost = {number for number in lost if not held.intersects(after.polygon(number))}
    bare_rim = (before.layout.edge_kind == EdgeKind.RIM) & ~before.layout.edge_street
    assert not lost or (is_level and bare_rim.any()), f"parcels {lost} are not reached any more"
    for part, (was, now) in enumerate(zip(before.networks, after.networks, strict=True)):
        assert now <= max(was, 1), f"part {part}: {was} networks, now {now}"
    was_small = before.small
    for number, area in after.small.items():
        known = number in before.parcels and before.layout.face_locked[before.parcels.index(number)]
        assert number in was_small or known, f"parcel {number} has {area} m²"


def assert_same(one: Seen, other: Seen) -> None:
    """Two layouts are the same but for the order of vertices and edges, and what is in words.

    Files know one level of a street from junction to junction, that of its oldest piece, so the
    levels of edges are not compared.
    """
    a, b = canonical(one.layout), canonical(other.layout)
    assert a.digest == b.digest
    for each in dataclasses.fields(Layout):
        value = getattr(a, each.name)
        if isinstance(value, np.ndarray) and each.name != "edge_level":
            assert np.array_equal(value, getattr(b, each.name)), each.name
    assert a.land_uses == b.land_uses
    assert str(a.fixed_streets) == str(b.fixed_streets)


def assert_numbers_stay(before: Seen, after: Seen) -> None:
    """Parcels that are where they were have the numbers that they had."""
    where = {
        shapely.normalize(p).wkb: n for p, n in zip(before.polygons, before.parcels, strict=True)
    }
    for polygon, number in zip(after.polygons, after.parcels, strict=True):
        was = where.get(shapely.normalize(polygon).wkb, number)
        assert was == number, f"parcel {was} is {number} now"


def assert_far_stay(before: Seen, after: Seen) -> None:
    """Parcels that do not touch what became another parcel are as they were, to the last digit."""
    changed = [
        p for p, n in zip(after.polygons, after.parcels, strict=True) if n not in before.parcels
    ]
    near = shapely.union_all(changed).buffer(SAME_M)
    for polygon, number in zip(after.polygons, after.parcels, strict=True):
        if number in before.parcels and not near.intersects(polygon):
            same = shapely.normalize(polygon) == shapely.normalize(before.polygon(number))
            assert same, f"parcel {number} changed, far from the edit"


def assert_locked_stay(before: Seen, after: Seen, *, within: float = SAME_M) -> None:
    """Locked parcels are there, and are the same polygons."""
    for face in np.flatnonzero(before.layout.face_locked).tolist():
        number = before.parcels[face]
        assert number in after.parcels, f"locked parcel {number} is gone"
        assert after.layout.face_locked[after.parcels.index(number)]
        off = shapely.hausdorff_distance(before.polygons[face], after.polygon(number))
        assert off <= within, f"locked parcel {number} moved by {off} m"


def assert_given_streets_stay(before: Seen, after: Seen) -> None:
    """Streets that were given are streets still, where they were."""
    given = before.layout.edge_fixed != NOT_FIXED
    if given.any():
        street = after.lines(after.layout.edge_fixed != NOT_FIXED).buffer(SAME_M)
        lost = before.lines(given).difference(street).length
        assert lost <= SAME_M * given.sum(), f"{lost} m of given streets are gone"
