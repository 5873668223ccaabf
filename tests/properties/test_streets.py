"""Streets on layouts that are cut level by level, as co-generation does."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from shapely import affinity

from urban_processing.access_rule import is_reached
from urban_processing.layout import EdgeKind, Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.edit import MeshEditor
from urban_processing.params import CogenerateParams, Preset
from urban_processing.site import Frame
from urban_processing.streets.blocks import LARGEST_BLOCK
from urban_processing.streets.generate import extend_streets
from urban_processing.streets.prune import prune_streets


def _quarters(outer: tuple[float, ...], inner: tuple[float, ...]) -> list[shapely.Polygon]:
    """Divide a box with a box-shaped hole into four polygons with shared vertices."""
    o = shapely.get_coordinates(shapely.box(*outer))[:4]
    i = shapely.get_coordinates(shapely.box(*inner))[:4]
    return [shapely.Polygon([o[k], o[k - 3], i[k - 3], i[k]]) for k in range(4)]


LANDS = {
    "rectangle": [shapely.box(0, 0, 300, 200)],
    "rotated": [affinity.rotate(shapely.box(0, 0, 300, 180), 27)],
    "triangle": [shapely.Polygon([(0, 0), (400, 30), (160, 330)])],
    "L": [shapely.Polygon([(0, 0), (300, 0), (300, 120), (130, 120), (130, 300), (0, 300)])],
    "hole": _quarters((0, 0, 300, 300), (120, 130, 190, 180)),
}


class CutError(Exception):
    """A straight cut left its bent parcel."""


def bisect(layout: Layout, rng: np.random.Generator) -> Layout:
    """Cut every parcel across its longer direction, near the middle."""
    editor = MeshEditor(layout.mesh)
    polygons = layout.mesh.face_polygons()
    for face in range(layout.mesh.n_faces):
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygons[face]))
        corners = box[:4] @ np.array([1.0, 1.0j])
        sides = corners[1:3] - corners[:2]
        along = sides[np.argmax(np.abs(sides))]
        middle = corners.mean() + rng.uniform(-0.06, 0.06) * along
        normal = along / abs(along) * np.exp(1j * rng.uniform(-0.12, 0.12))
        ring = editor.ring(int(layout.mesh.face_half_edges(face)[0]))
        _cut(editor, ring, middle, normal)
    mesh, remap = editor.commit()
    if not (mesh.face_area > 0).all() or not shapely.is_valid(mesh.face_polygons()).all():
        raise CutError
    return layout.with_mesh(mesh, remap)


def _cut(editor: MeshEditor, ring: list[int], middle: complex, normal: complex) -> None:
    z = np.array([complex(editor.x[v], editor.y[v]) for v in (editor.origin[h] for h in ring)])
    s = ((z - middle) * normal.conjugate()).real
    hits = []
    for k, h in enumerate(ring):
        n = (k + 1) % len(ring)
        if (s[k] < 0) != (s[n] < 0):
            t = s[k] / (s[k] - s[n])
            point = z[k] + t * (z[n] - z[k])
            place = ((point - middle) * normal.conjugate()).imag
            snapped = ring[k] if t < 0.12 else ring[n] if t > 0.88 else -1
            hits.append((place, h, point, snapped))
    hits.sort()
    i = min(range(0, len(hits), 2), key=lambda j: abs(hits[j][0] + hits[j + 1][0]))
    ends = []
    origins = [editor.origin[h] for h in ring]
    corner = [ring.index(hit[3]) if hit[3] >= 0 else -1 for hit in hits[i : i + 2]]
    adjacent = abs(corner[0] - corner[1]) in (0, 1, len(origins) - 1)
    for _, h, point, snapped in hits[i : i + 2]:
        keep = snapped >= 0 and not adjacent
        ends.append(snapped if keep else editor.split_edge(h, point.real, point.imag))
    editor.connect(ends[0], ends[1], [])


def layouts(
    land: str,
    levels: int,
    seed: int,
    params: CogenerateParams,
    *,
    keep_ends: bool,
    rim_is_street: bool = True,
) -> list[Layout]:
    """Return the layouts after each level of cuts and streets."""
    rng = np.random.default_rng(seed)
    polygons = LANDS[land]
    layout = layout_from_mesh(
        mesh_from_polygons(polygons),
        frame=Frame(),
        face_part=np.zeros(len(polygons), dtype=np.int64),
        min_area=1.0,
        vertex_corner=None,
        rim_is_street=rim_is_street,
    )
    layout = layout.replace(vertex_corner=np.ones(layout.mesh.n_vertices, dtype=bool))
    out = []
    for level in range(1, levels + 1):
        layout = bisect(layout, rng)
        layout = extend_streets(layout, params, level=level, keep_ends=keep_ends)
        out.append(layout)
    return out


def layouts_or_reject(
    land: str, levels: int, seed: int, params: CogenerateParams, *, keep_ends: bool
) -> list[Layout]:
    """Return the layouts, or reject hypothesis' example where a cut leaves its parcel."""
    try:
        return layouts(land, levels, seed, params, keep_ends=keep_ends)
    except CutError:
        reject()


def street_degree(layout: Layout) -> np.ndarray:
    """(V,) number of street edges at a vertex."""
    mesh = layout.mesh
    return np.bincount(
        mesh.origin, weights=np.repeat(layout.edge_street, 2), minlength=mesh.n_vertices
    ).astype(int)


def loose_ends(layout: Layout) -> np.ndarray:
    """(V,) dead ends, but for those at a hole, which no street can go round."""
    mesh = layout.mesh
    at_hole = np.zeros(mesh.n_vertices, dtype=bool)
    at_hole[mesh.origin[np.repeat(layout.edge_kind == EdgeKind.HOLE, 2)]] = True
    return (street_degree(layout) == 1) & ~at_hole


def n_components(layout: Layout) -> int:
    """Return the number of connected components of the streets."""
    mesh = layout.mesh
    ends = mesh.origin.reshape(-1, 2)[layout.edge_street]
    links = coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(mesh.n_vertices,) * 2)
    _, label = connected_components(links, directed=False)
    return len(np.unique(label[ends]))


def interior_length(layout: Layout) -> float:
    """Interior street length per parcel over the square root of the mean parcel area."""
    inside = layout.edge_street & (layout.edge_kind == EdgeKind.INTERIOR)
    side = math.sqrt(layout.mesh.face_area.mean())
    return float(layout.mesh.edge_length[inside].sum() / layout.mesh.n_faces / side)


@pytest.mark.parametrize("land", sorted(LANDS))
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 10_000), preset=st.sampled_from(list(Preset)))
def test_loops_reach_every_parcel_without_dead_ends(land: str, seed: int, preset: Preset) -> None:
    """All parcels reached, one component and no dead end after every level."""
    params = CogenerateParams(parcels=128, preset=preset)
    for layout in layouts_or_reject(land, 7, seed, params, keep_ends=False):
        assert is_reached(layout.frontage, layout.mesh.face_area).all()
        assert n_components(layout) == 1
        assert not loose_ends(layout).any()
        assert not (layout.edge_street & (layout.edge_kind == EdgeKind.HOLE)).any()
        assert ((layout.edge_level >= 0) == layout.edge_street).all()
    pruned = prune_streets(layout, params, keep_ends=False)
    assert is_reached(pruned.frontage, pruned.mesh.face_area).all()
    assert n_components(pruned) == 1
    assert not loose_ends(pruned).any()
    assert interior_length(pruned) <= interior_length(layout)


@pytest.mark.parametrize("land", sorted(LANDS))
@settings(max_examples=5, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 10_000), preset=st.sampled_from(list(Preset)))
def test_trees_are_connected_and_every_dead_end_is_needed(
    land: str, seed: int, preset: Preset
) -> None:
    """All parcels reached and one component; each last piece of a dead end serves a parcel."""
    params = CogenerateParams(parcels=128, preset=preset)
    layout = layouts_or_reject(land, 7, seed, params, keep_ends=True)[-1]
    assert is_reached(layout.frontage, layout.mesh.face_area).all()
    assert n_components(layout) == 1
    graph = layout.corner_graph
    street = layout.chain_street
    ends = np.bincount(graph.start, weights=street, minlength=graph.n_nodes) == 1
    assert ends.any()
    for chain in np.flatnonzero(street & ends[graph.start]):
        without = layout.frontage.copy()
        without[graph.face[[chain, chain ^ 1]]] -= graph.length[chain]
        assert not is_reached(without, layout.mesh.face_area).all()


@pytest.mark.parametrize("keep_ends", [False, True])
@pytest.mark.parametrize("land", ["rectangle", "rotated", "L"])
def test_first_access_becomes_the_network_where_the_rim_is_no_street(
    land: str, keep_ends: bool
) -> None:
    """One component that reaches all parcels and never runs along the rim."""
    params = CogenerateParams(parcels=128)
    layout = layouts(land, 7, 3, params, keep_ends=keep_ends, rim_is_street=False)[-1]
    assert is_reached(layout.frontage, layout.mesh.face_area).all()
    assert n_components(layout) == 1
    assert not (layout.edge_street & (layout.edge_kind != EdgeKind.INTERIOR)).any()


def test_loops_are_economical() -> None:
    """The recommended rules keep streets short and blocks of a moderate size."""
    params = CogenerateParams(parcels=512)
    layout = layouts("rectangle", 9, 0, params, keep_ends=False)[-1]
    layout = prune_streets(layout, params, keep_ends=False)
    assert layout.mesh.n_faces == 512
    assert interior_length(layout) <= 0.65
    parcels_of_block = np.bincount(_blocks(layout))
    assert parcels_of_block.max() <= LARGEST_BLOCK
    assert (parcels_of_block <= 3).mean() < 0.05


def _blocks(layout: Layout) -> np.ndarray:
    mesh = layout.mesh
    sides = mesh.face.reshape(-1, 2)
    open_ = ~layout.edge_street & (sides >= 0).all(axis=1)
    links = coo_matrix(
        (np.ones(int(open_.sum())), tuple(sides[open_].T)), shape=(mesh.n_faces,) * 2
    )
    return connected_components(links, directed=False)[1]


def test_look_ahead_saves_cost_over_the_published_rule() -> None:
    """Small blocks are fewer than with the shortest access of the paper."""
    small = {}
    for preset in Preset:
        params = CogenerateParams(parcels=256, preset=preset)
        n = 0
        for seed in range(3):
            layout = layouts("triangle", 8, seed, params, keep_ends=False)[-1]
            n += int((np.bincount(_blocks(layout)) <= 3).sum())
        small[preset] = n
    assert small[Preset.RECOMMENDED] < small[Preset.CHEN2024]


def test_junction_weight_straightens_streets() -> None:
    """A larger junction weight makes fewer turns within streets."""

    def turns(junction_weight: float) -> int:
        params = CogenerateParams(parcels=256, junction_weight=junction_weight)
        total = 0
        for seed in range(3):
            layout = layouts("L", 8, seed, params, keep_ends=False)[-1]
            total += _bends(layout)
        return total

    assert turns(4.0) < turns(0.0)


def _bends(layout: Layout) -> int:
    graph, street = layout.corner_graph, layout.chain_street
    count = 0
    for node in range(graph.n_nodes):
        out = graph.out[graph.out_offsets[node] : graph.out_offsets[node + 1]]
        on = out[street[out]]
        if len(on) == 2 and not (layout.chain_kind[on] == EdgeKind.RIM).any():
            a, b = graph.leaving[on]
            count += bool((a * b.conjugate()).real > -math.cos(math.radians(45)))
    return count


def test_same_input_gives_the_same_streets() -> None:
    """No order of hashing or of calls shows in the result."""
    params = CogenerateParams(parcels=128)
    first = layouts("triangle", 7, 5, params, keep_ends=False)[-1]
    again = layouts("triangle", 7, 5, params, keep_ends=False)[-1]
    assert np.array_equal(first.edge_street, again.edge_street)
    assert np.array_equal(first.edge_level, again.edge_level)


def test_input_layout_is_left_alone() -> None:
    """`extend_streets` returns a new layout and changes only the streets."""
    params = CogenerateParams(parcels=64)
    before = layouts("rectangle", 6, 1, params, keep_ends=False)[-1]
    bare = before.replace(
        edge_street=before.edge_kind == EdgeKind.RIM,
        edge_level=np.where(before.edge_kind == EdgeKind.RIM, 0, -1).astype(np.int16),
    )
    kept = bare.edge_street.copy()
    after = extend_streets(bare, params, level=6, keep_ends=False)
    assert np.array_equal(bare.edge_street, kept)
    assert after.edge_street.sum() > kept.sum()
    for field in dataclasses.fields(Layout):
        if field.name not in ("edge_street", "edge_level"):
            assert getattr(after, field.name) is getattr(bare, field.name)
