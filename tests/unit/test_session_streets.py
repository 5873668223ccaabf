"""Streets that are added and removed in a session, parcels cut by hand, and what is refused."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from lands import LANDS, ellipse, site_of
from steered import ANY, assert_partition, drawn, locked, moment_of, streets_of

from urban_processing.access_rule import unreached_parcels_of
from urban_processing.errors import EditError
from urban_processing.io.boundaries import read_boundary
from urban_processing.layout import NOT_FIXED, EdgeKind, GivenStreet, Steering
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.finish import finish
from urban_processing.pipelines.levels import begin, step, with_streets
from urban_processing.session.cutting import cut_faces, path_across
from urban_processing.session.drawn_line import as_line
from urban_processing.session.moment import Moment, first_moment, next_moment
from urban_processing.session.requirements import check
from urban_processing.session.street_edits import add_street, remove_street
from urban_processing.site import LockedLand

SQUARE = LANDS["square"]  # 400 m a side
LAKE = shapely.box(0, 0, 400, 400).difference(shapely.box(150, 150, 250, 250))


def refusal(moment: Moment, line: object, *, snap: float = 5.0, follow: bool = False) -> str:
    """Why a street is refused; the moment stays as it was."""
    digest = moment.state.layout.digest
    with pytest.raises(EditError) as caught:
        add_street(moment, np.asarray(line), snap=snap, follow=follow, given=ANY)
    assert moment.state.layout.digest == digest
    return str(caught.value)


def test_two_streets_cross_on_the_land_parcel() -> None:
    """Chen 2024, Fig. 15 (b)."""
    start = moment_of(SQUARE)
    state, said = add_street(
        start,
        np.array([(0.0, 100.0), (200.0, 180.0), (400.0, 150.0)]),
        snap=5.0,
        follow=False,
        given=GivenStreet("collector", 16.0),
    )
    assert said == "A street of 418 m was added; it cut parcel 1"
    one = next_moment(start, with_streets(state))
    assert one.parcels == (2, 3)
    state, said = add_street(
        one, np.array([(150.0, 0.0), (180.0, 400.0)]), snap=5.0, follow=False, given=ANY
    )
    assert said == "A street of 401 m was added; it cut parcels 2 and 3"
    two = next_moment(one, with_streets(state))
    assert two.parcels == (4, 5, 6, 7)
    layout = two.state.layout
    assert_partition(start.state, two.state)
    assert layout.fixed_streets == (GivenStreet("collector", 16.0), ANY)
    for street, length in ((0, 417.6), (1, 401.1)):
        own = layout.edge_fixed == street
        assert layout.mesh.edge_length[own].sum() == pytest.approx(length, abs=0.1)
        assert layout.edge_street[own].all()
        assert (layout.edge_level[own] == 0).all()
        assert layout.steered(Steering.KEPT)[own].all()
    check(start, two)


def test_halves_share_quota_and_stage() -> None:
    state = begin(site_of(SQUARE), CogenerateParams(parcels=100))
    moment = first_moment(state)
    after = drawn(moment, [(0, 100), (400, 100)]).state.layout
    assert sorted(after.face_quota.tolist()) == [25, 75]
    assert (after.face_stage == state.layout.face_stage[0]).all()


def test_street_follows_boundaries_within_snap() -> None:
    moment = moment_of(SQUARE, levels=3)
    layout = moment.state.layout
    inner = shapely.union_all(
        shapely.linestrings(
            layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[layout.edge_kind == EdgeKind.INTERIOR]]
        )
    )
    # the line wobbles about a boundary that runs across the land
    y = 200.0
    assert shapely.LineString([(0, y), (400, y)]).difference(inner.buffer(1e-6)).length < 1e-3
    line = [(0.0, y + 3), (100.0, y - 4), (210.0, y + 4), (300.0, y - 3), (400.0, y + 2)]
    state, said = add_street(moment, np.array(line), snap=6.0, follow=False, given=ANY)
    assert said == "A street of 400 m was added"
    assert state.layout.mesh.n_faces == layout.mesh.n_faces
    own = streets_of(state.layout, state.layout.edge_fixed == 0)
    assert own.hausdorff_distance(shapely.LineString([(0, y), (400, y)])) < 1e-6


def test_street_follows_then_cuts() -> None:
    moment = moment_of(SQUARE, levels=2)  # four squares
    # along the boundary to the middle of a parcel's side, then across that parcel
    line = [(0.0, 201.0), (90.0, 201.0), (110.0, 320.0), (110.0, 400.0)]
    state, _ = add_street(moment, np.array(line), snap=4.0, follow=False, given=ANY)
    assert state.layout.mesh.n_faces == 5
    own = streets_of(state.layout, state.layout.edge_fixed == 0)
    assert own.hausdorff_distance(shapely.LineString(line)) < 8.0
    along = own.intersection(shapely.LineString([(0, 200), (400, 200)]).buffer(1e-6))
    assert along.length == pytest.approx(90.0, abs=10.0)
    assert_partition(moment.state, state)


def test_ends_reach_the_boundary_within_snap() -> None:
    moment = moment_of(SQUARE)
    after = drawn(moment, [(2.0, 150.0), (200.0, 160.0), (403.0, 150.0)], snap=5.0)
    assert after.state.layout.mesh.n_faces == 2
    ends = streets_of(after.state.layout, after.state.layout.edge_fixed == 0).boundary
    assert shapely.distance(ends, SQUARE.exterior) < 1e-6


def test_crossing_near_a_corner_goes_through_it() -> None:
    moment = moment_of(SQUARE, levels=2)  # four squares, which meet at (200, 200)
    after = drawn(moment, [(0.0, 3.0), (198.0, 203.0), (400.0, 398.0)], snap=6.0)
    own = streets_of(after.state.layout, after.state.layout.edge_fixed == 0)
    assert shapely.distance(own, shapely.Point(200, 200)) < 1e-9
    assert after.state.layout.mesh.n_faces == 6


def test_parcel_is_crossed_several_times() -> None:
    moment = moment_of(LANDS["ell"], min_area=400)  # 600 by 600 m, without the upper right
    bow = [(0.0, 250.0), (280.0, 299.0), (320.0, 299.0), (600.0, 250.0)]
    after = drawn(moment, bow, snap=3.0)  # touches the notch at (300, 300)
    assert after.state.layout.mesh.n_faces == 3
    assert_partition(moment.state, after.state)


def test_street_runs_along_corners_by_the_shortest_way() -> None:
    moment = moment_of(SQUARE, levels=4)
    layout = moment.state.layout
    state, said = add_street(
        moment, np.array([(0.0, 200.0), (201.0, 199.0), (200.0, 300.0)]), snap=5.0, follow=True,
        given=ANY,
    )  # fmt: skip
    own = state.layout.edge_fixed == 0
    assert state.layout.mesh is layout.mesh
    assert layout.mesh.edge_length[own].sum() == pytest.approx(300.0)
    new = own & ~layout.edge_street
    assert said == f"A street of {layout.mesh.edge_length[new].sum():.0f} m was added"
    assert state.layout.steered(Steering.KEPT)[own].all()


def test_way_avoids_lakes_and_bare_rims() -> None:
    moment = moment_of(LAKE, levels=3, rim=False)
    layout = moment.state.layout
    at = layout.mesh.xy
    corner = at[np.argmin(np.hypot(*(at - (150, 150)).T))]
    other = at[np.argmin(np.hypot(*(at - (250, 250)).T))]
    state, _ = add_street(moment, np.array([corner, other]), snap=1.0, follow=True, given=ANY)
    own = state.layout.edge_fixed == 0
    assert (layout.edge_kind[own] == EdgeKind.INTERIOR).all()


def test_what_is_street_stays_and_remembers() -> None:
    moment = drawn(moment_of(SQUARE), [(0, 200), (400, 200)])
    later = dataclasses.replace(moment, state=dataclasses.replace(moment.state, level=3))
    state, said = add_street(
        later, np.array([(0.0, 200.0), (200.0, 200.0), (200.0, 0.0)]), snap=5.0, follow=False,
        given=ANY,
    )  # fmt: skip
    assert said == "A street of 200 m was added; it cut parcel 3"
    layout = state.layout
    assert set(layout.edge_level[layout.edge_fixed == 0].tolist()) == {0}
    assert set(layout.edge_level[layout.edge_fixed == 1].tolist()) == {3}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ([(0.0, 50.0)], "must have two points or more"),
        ([(0.0, 50.0), (0.0, 50.0)], "has no length"),
        ([(0.0, 50.0), (np.nan, 50.0)], "no finite number"),
        ([0.0, 50.0, 3.0], "list of points"),
        ([(0, 0), (400, 400), (400, 0), (0, 300)], "crosses itself"),
        ([(900, 900), (999, 999)], "does not touch the land"),
        ([(350, 30), (450, 50), (450, 80), (350, 90)], "leaves the land: end it at"),
        ([(0, 50), (100, 50)], "ends inside parcel 1: draw it on to"),
        ([(100, 50), (400, 50)], "begins inside parcel 1: draw it on to"),
        ([(0, 200), (400, 200)], "crosses a lake"),
        ([(150, 150), (250, 150)], "follows its shore"),
        ([(0, 390), (30, 400)], "the smallest parcel allowed is 600 m²"),
    ],
)
def test_drawn_lines_refused(line: object, words: str) -> None:
    moment = moment_of(SQUARE if "inside parcel 1" in words else LAKE)
    assert words in refusal(moment, line, snap=1.0)


def test_what_is_drawn_beyond_the_rim_is_left_out() -> None:
    moment = moment_of(SQUARE)
    exact, _ = add_street(moment, np.array([(0, 50), (400, 50)]), snap=1.0, follow=False, given=ANY)
    beyond, said = add_street(
        moment, np.array([(-70, 50), (200, 50), (500, 50)]), snap=1.0, follow=False, given=ANY
    )
    assert said == "A street of 400 m was added; it cut parcel 1"
    assert beyond.layout.digest == exact.layout.digest


def test_small_halves_are_named() -> None:
    moment = moment_of(SQUARE)
    said = refusal(moment, [(0, 390), (30, 400)], snap=0.2)
    assert said == (
        "Parcel 1 would be cut into 150 m² and 159,850 m²; the smallest parcel allowed is 600 m²."
    )
    small = moment_of(shapely.box(0, 0, 40, 25))
    assert refusal(small, [(0, 12), (40, 12)], snap=0.2) == (
        "Parcel 1 (1,000 m²) is too small to be cut in two: the smallest parcel allowed is 600 m²."
    )


def test_locked_parcels_are_not_crossed() -> None:
    moment = locked(moment_of(SQUARE, levels=2), 1, "park")
    place = shapely.point_on_surface(moment.state.layout.mesh.face_polygons()[moment.face(1)])
    said = refusal(moment, [(0, place.y), (400, place.y)])
    assert (
        said
        == "Parcel 1 is locked as park: no cut and no street may cross it until it is unlocked."
    )
    park = LockedLand(shapely.box(100, 100, 180, 180), "park")
    given = moment_of(dataclasses.replace(site_of(SQUARE), locked=(park,)))
    assert "locked as park" in refusal(given, [(0, 140), (400, 140)])


def test_all_street_already() -> None:
    moment = drawn(moment_of(SQUARE), [(0, 200), (400, 200)])
    words = "There is a street already along all of this line."
    assert refusal(moment, [(0, 200), (400, 201)]) == words
    assert refusal(moment, [(0, 200), (400, 200)], follow=True) == words


def test_ways_refused() -> None:
    moment = moment_of(SQUARE, levels=2)
    assert "No parcel corner lies within 5.0 m of point 2" in refusal(
        moment, [(0, 200), (100, 100)], follow=True
    )
    assert "all at one parcel corner" in refusal(moment, [(0, 200), (1, 201)], follow=True)
    bare = moment_of(SQUARE, rim=False)
    assert "No way along parcel boundaries" in refusal(bare, [(0, 0), (400, 400)], follow=True)


def test_removed_street_does_not_come_back() -> None:
    moment = moment_of(SQUARE, levels=5)
    layout = moment.state.layout
    inner = np.flatnonzero(layout.edge_street & (layout.edge_kind == EdgeKind.INTERIOR))
    gone = 0
    for edge in inner[:: max(len(inner) // 12, 1)].tolist():
        place = layout.mesh.xy[layout.mesh.origin[2 * edge : 2 * edge + 2]].mean(axis=0)
        state, said = remove_street(moment, place, reach=1.0)
        assert said.startswith("A street of ")
        assert said.endswith(" m was removed")
        barred = state.layout.steered(Steering.NO_STREET)
        assert barred[edge]
        assert not state.layout.edge_street[barred].any()
        assert (state.layout.edge_level[barred] == -1).all()
        after = next_moment(moment, with_streets(state))
        try:
            check(moment, after)
        except EditError:
            continue
        gone += 1
        assert not after.state.layout.edge_street[edge]
        assert not len(unreached_parcels_of(after.state.layout))
    assert gone > 0


def test_removal_goes_from_junction_to_junction() -> None:
    moment = drawn(drawn(moment_of(SQUARE), [(0, 100), (400, 100)]), [(150, 0), (150, 400)])
    state, said = remove_street(moment, np.array([300.0, 101.0]), reach=2.0)
    assert said == "A street of 250 m was removed"
    gone = state.layout.steered(Steering.NO_STREET)
    assert streets_of(state.layout, gone).equals(shapely.LineString([(150, 100), (400, 100)]))
    assert (state.layout.edge_fixed[gone] == NOT_FIXED).all()
    with pytest.raises(EditError, match=r"no street within 2\.0 m"):
        remove_street(moment, np.array([300.0, 150.0]), reach=2.0)
    # and back again: what was removed may be drawn anew
    again, _ = add_street(
        next_moment(moment, state), np.array([(150.0, 100.0), (400.0, 100.0)]), snap=2.0,
        follow=False, given=ANY,
    )  # fmt: skip
    assert not again.layout.steered(Steering.NO_STREET).any()


def test_check_names_what_breaks() -> None:
    moment = drawn(moment_of(SQUARE, rim=False), [(0, 200), (400, 200)])
    state, _ = remove_street(moment, np.array([200.0, 200.0]), reach=1.0)
    with pytest.raises(EditError, match="Parcels 2 and 3 would not be reached by any street"):
        check(moment, next_moment(moment, state))
    loose, _ = add_street(
        moment, np.array([(300.0, 400.0), (400.0, 300.0)]), snap=1.0, follow=False, given=ANY
    )
    with pytest.raises(EditError, match="in 2 pieces that no street joins"):
        check(moment, next_moment(moment, loose))
    strict = dataclasses.replace(moment.state, min_area=90_000.0)
    small = dataclasses.replace(moment, state=strict)
    check(small, small)
    other = moment_of(SQUARE, rim=False)
    with pytest.raises(EditError, match="smallest parcel allowed is 90,000 m²"):
        check(other, next_moment(other, strict))


def test_parcels_are_cut_by_a_drawn_line() -> None:
    moment = moment_of(SQUARE, levels=2)
    face = moment.face(1)
    parcel = moment.state.layout.mesh.face_polygons()[face]
    x, y = parcel.centroid.coords[0]
    line = [(x - 99, y - 20), (x, y + 5), (x + 99, y + 10)]
    path = path_across(moment, face, line, snap=2.0)
    assert shapely.distance(shapely.points(path[[0, -1]]), parcel.exterior).max() < 1e-6
    state = cut_faces(moment, {face: path})
    after = next_moment(moment, state)
    assert_partition(moment.state, state)
    assert sorted(set(after.parcels) - set(moment.parcels)) == [5, 6]
    new = state.layout.steered(Steering.KEPT)
    assert streets_of(state.layout, new).hausdorff_distance(shapely.LineString(path)) < 2.0
    assert not state.layout.edge_street[new].any()
    # the numbers of the halves do not depend on the direction
    turned = next_moment(moment, cut_faces(moment, {face: path[::-1]}))
    for number in (5, 6):
        one, other = (m.state.layout.mesh.face_polygons()[m.face(number)] for m in (after, turned))
        assert one.equals(other)


def test_cuts_of_neighbours_meet() -> None:
    moment = moment_of(SQUARE, levels=2)
    line = [(0.0, 90.0), (400.0, 110.0)]
    faces = [f for f in range(4) if moment.state.layout.mesh.face_polygons()[f].centroid.y < 200]
    paths = {face: path_across(moment, face, line, snap=1.0) for face in faces}
    state = cut_faces(moment, paths)
    assert state.layout.mesh.n_faces == 6
    assert_partition(moment.state, state)
    assert streets_of(state.layout, state.layout.steered(Steering.KEPT)).length == pytest.approx(
        shapely.LineString(line).length, abs=1e-6
    )


def test_cuts_refused() -> None:
    moment = moment_of(LANDS["ell"], min_area=400)
    for line, words in (
        ([(700, 0), (700, 300)], "The line does not cross parcel 1."),
        ([(0, 100), (100, 100)], "ends inside parcel 1"),
        ([(-10, 500), (310, 500), (310, 350), (-10, 350)], "crosses parcel 1 2 times"),
    ):
        with pytest.raises(EditError, match=words):
            path_across(moment, 0, line, snap=1.0)
    with pytest.raises(EditError, match="400 m²"):
        cut_faces(moment, {0: path_across(moment, 0, [(-1, 21), (21, -1)], snap=1.0)})
    with pytest.raises(EditError, match="locked as park"):
        path_across(locked(moment, 1, "park"), 0, [(0, 100), (600, 100)], snap=1.0)


def test_line_is_near_what_it_is_near() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        line = as_line(np.cumsum(rng.normal(size=(5, 2)), axis=0)[[0, 2, 4]])
        segments = rng.normal(0, 3, (6, 2, 2))
        runs = line.near(segments, 0.7)
        walls = shapely.multilinestrings(shapely.linestrings(segments))
        s = np.linspace(0, line.length, 301)
        off = shapely.distance(walls, shapely.points([line.at(v) for v in s]))
        inside = ((s[:, None] >= runs[:, 0]) & (s[:, None] <= runs[:, 1])).any(axis=1)
        clear = np.abs(off - 0.7) > 1e-9
        assert np.array_equal(inside[clear], (off < 0.7)[clear])


@pytest.mark.parametrize("name", ["wandsworth", "schellenberg"])
def test_added_streets_last_to_the_end(name: str, sample: Callable[[str], Path]) -> None:
    state = begin(read_boundary(sample(name)), CogenerateParams(parcels=120))
    rng = np.random.default_rng(2)
    added: list[shapely.Geometry] = []
    while not state.finished:
        if state.level in (0, 3, 5):
            moment = first_moment(state)
            after = _some_street(moment, rng)
            state = after.state
            number = len(state.layout.fixed_streets) - 1
            added.append(streets_of(state.layout, state.layout.edge_fixed == number))
        state = step(state)
    layout, _ = finish(state)
    assert len(added) == 3
    network = streets_of(layout).buffer(1e-6)
    for line in added:
        assert line.difference(network).length < 1e-3
    assert not len(unreached_parcels_of(layout))


def _some_street(moment: Moment, rng: np.random.Generator) -> Moment:
    mesh = moment.state.layout.mesh
    side = float(np.sqrt(mesh.face_area.mean()))
    for _ in range(200):
        line = mesh.xy[rng.integers(mesh.n_vertices, size=2)]
        if np.hypot(*(line[1] - line[0])) < side:
            continue
        try:
            return drawn(moment, line, snap=0.1 * side)
        except EditError:
            continue
    raise AssertionError("no street fits")


def test_ellipse_street_in_pieces_is_one_network() -> None:
    moment = moment_of(ellipse(), levels=4)
    after = drawn(moment, [(-299, 0), (0, 30), (299, 0)], snap=8.0)
    assert_partition(moment.state, after.state)
    assert not len(unreached_parcels_of(after.state.layout))
