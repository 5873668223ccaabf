"""The planar mesh, its construction and its edits."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from urban_processing.errors import TopologyError
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.corner_graph import build_corner_graph
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import OUTSIDE, PlanarMesh, rank_cycles

BOX = shapely.box


def two_over_one() -> PlanarMesh:
    """Two squares below one rectangle that has their common vertex on its side."""
    top = shapely.Polygon([(0, 1), (1, 1), (2, 1), (2, 2), (0, 2)])
    return mesh_from_polygons([BOX(0, 0, 1, 1), BOX(1, 0, 2, 1), top])


def vertex_at(mesh: PlanarMesh, x: float, y: float) -> int:
    (index,) = np.flatnonzero((mesh.xy == (x, y)).all(axis=1))
    return int(index)


def test_faces_keep_their_polygons() -> None:
    mesh = two_over_one()
    mesh.validate()
    assert mesh.face_area.tolist() == [1, 1, 2]
    expected = [BOX(0, 0, 1, 1), BOX(1, 0, 2, 1), BOX(0, 1, 2, 2)]
    assert shapely.equals(mesh.face_polygons(), expected).all()
    assert mesh.valence[vertex_at(mesh, 1, 1)] == 3


def test_offset_shifts_polygons_exactly() -> None:
    mesh = mesh_from_polygons([BOX(0.5, 0.25, 1, 1)])
    (polygon,) = mesh.face_polygons((500000.0, 5400000.0))
    assert polygon.bounds == (500000.5, 5400000.25, 500001.0, 5400001.0)


def test_holes_are_loops_of_their_face() -> None:
    lake = BOX(3, 3, 6, 6)
    mesh = mesh_from_polygons([BOX(0, 0, 9, 9).difference(lake)])
    mesh.validate()
    assert mesh.face_n_loops.tolist() == [2]
    assert mesh.face_area.tolist() == [72]
    assert shapely.equals(mesh.face_polygons()[0], BOX(0, 0, 9, 9).difference(lake))


def test_island_in_a_hole_is_a_face_of_its_own() -> None:
    mesh = mesh_from_polygons([BOX(0, 0, 9, 9).difference(BOX(3, 3, 6, 6)), BOX(4, 4, 5, 5)])
    mesh.validate()
    assert mesh.face_n_loops.tolist() == [2, 1]


def test_parts_that_touch_at_a_point_get_a_vertex_each() -> None:
    mesh = mesh_from_polygons([BOX(0, 0, 1, 1), BOX(1, 1, 2, 2)])
    mesh.validate()
    assert (mesh.xy == (1, 1)).all(axis=1).sum() == 2


def test_overlapping_polygons_are_refused() -> None:
    with pytest.raises(TopologyError, match="overlap"):
        mesh_from_polygons([BOX(0, 0, 1, 1), BOX(0, 0, 1, 1)])


def test_validate_sees_a_broken_link() -> None:
    mesh = two_over_one()
    broken = mesh.next.copy()
    broken[[0, 2]] = broken[[2, 0]]
    with pytest.raises(TopologyError):
        PlanarMesh(mesh.xy, mesh.origin, broken, mesh.face, mesh.n_faces).validate()


def test_arrays_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        two_over_one().xy[0, 0] = 1.0


@pytest.mark.parametrize("seed", range(20))
def test_rank_cycles_agrees_with_walking(seed: int) -> None:
    successor = np.random.default_rng(seed).permutation(40)
    leader, position = rank_cycles(successor)
    for start in range(40):
        cycle, at = [start], int(successor[start])
        while at != start:
            cycle.append(at)
            at = int(successor[at])
        assert leader[start] == min(cycle)
        steps = (cycle.index(min(cycle)) * -1) % len(cycle)
        assert position[start] == steps


def test_split_edge_and_connect_make_two_faces() -> None:
    mesh = mesh_from_polygons([BOX(0, 0, 4, 2)])
    editor = MeshEditor(mesh)
    low, high = (
        next(
            h
            for h in mesh.face_half_edges(0)
            if mesh.xy[mesh.origin[h], 1] == y == mesh.xy[mesh.target[h], 1]
        )
        for y in (0, 2)
    )
    a = editor.split_edge(int(low), 2, 0)
    b = editor.split_edge(int(high), 2, 2)
    new = editor.connect(a, b, [(2.5, 1.0)])
    cut, remap = editor.commit()
    cut.validate()
    assert new == 1
    # the left of the cut, which runs upward, keeps the face
    assert cut.face_area.tolist() == [4.5, 3.5]
    assert remap.face.tolist() == [0, 0]
    assert (
        sorted(remap.edge.tolist()) == [-1, -1, 0, 1, 2, 2, 3, 3] or (remap.edge == -1).sum() == 2
    )
    assert mesh.n_faces == 1


def test_dissolve_undoes_split_edge() -> None:
    mesh = two_over_one()
    for h in range(len(mesh.origin)):
        editor = MeshEditor(mesh)
        middle = mesh.xy[[mesh.origin[h], mesh.target[h]]].mean(axis=0)
        new = editor.origin[editor.split_edge(h, *middle)]
        editor.dissolve_vertex(new)
        back, _ = editor.commit()
        back.validate()
        assert np.array_equal(back.origin, mesh.origin)
        assert np.array_equal(back.next, mesh.next)


def test_collapse_merges_the_target_into_the_origin() -> None:
    mesh = two_over_one()
    shared = next(
        h
        for h in range(len(mesh.origin))
        if {tuple(mesh.xy[mesh.origin[h]]), tuple(mesh.xy[mesh.target[h]])} == {(1, 0), (1, 1)}
        and mesh.face[h] != OUTSIDE
        and tuple(mesh.xy[mesh.origin[h]]) == (1, 1)
    )
    editor = MeshEditor(mesh)
    editor.collapse_edge(shared)
    merged, _ = editor.commit()
    merged.validate()
    assert merged.n_vertices == mesh.n_vertices - 1
    assert merged.face_area.tolist() == [0.5, 0.5, 2]


def test_cut_between_two_loops_joins_them() -> None:
    mesh = mesh_from_polygons([BOX(0, 0, 9, 9).difference(BOX(3, 3, 6, 6))])
    editor = MeshEditor(mesh)
    corner = {tuple(mesh.xy[mesh.origin[h]]): h for h in np.flatnonzero(mesh.face == 0).tolist()}
    assert editor.connect(corner[3, 3], corner[0, 0], []) == -1
    joined, _ = editor.commit()
    joined.validate()
    assert joined.face_n_loops.tolist() == [1]
    assert joined.face_area.tolist() == [72]


def test_corner_graph_contracts_to_corners() -> None:
    mesh = two_over_one()
    graph = build_corner_graph(mesh, np.zeros(mesh.n_vertices, dtype=bool))
    # every valence-3 vertex: (1, 0), (0, 1), (1, 1), (2, 1)
    assert graph.n_nodes == 4
    assert graph.n_chains == 2 * 6
    assert (graph.start[0::2] == graph.end[1::2]).all()
    assert graph.length.sum() == pytest.approx(2 * mesh.edge_length.sum())
    for i in range(graph.n_chains):
        chain = graph.half_edges[graph.offsets[i] : graph.offsets[i + 1]]
        back = graph.half_edges[graph.offsets[i ^ 1] : graph.offsets[(i ^ 1) + 1]]
        assert (chain[::-1] ^ 1).tolist() == back.tolist()
    assert (graph.leaving == -graph.arriving[np.arange(graph.n_chains) ^ 1]).all()


def test_corner_graph_of_a_loop_without_corners() -> None:
    mesh = mesh_from_polygons([BOX(0, 0, 1, 1)])
    graph = build_corner_graph(mesh, np.zeros(4, dtype=bool))
    assert graph.n_chains >= 2
    assert graph.length.sum() == pytest.approx(8)
