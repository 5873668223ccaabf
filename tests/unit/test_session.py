"""Sessions: steps, candidates, edits of parcels, numbers, undo and branches."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
import shapely.ops
from shapely import affinity

from urban_processing.errors import BoundaryError, EditError
from urban_processing.hashing import child, splitmix64, unmixed
from urban_processing.io.boundaries import read_boundary
from urban_processing.layout import EdgeKind, Layout, Stage, Steering
from urban_processing.metrics import certificate
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.session.lineage import descendants, merged, parents
from urban_processing.session.session import Session
from urban_processing.site import Site
from urban_processing.subdivision.insert import TEE_SNAP

Find = Callable[[str], Path]


@pytest.fixture(scope="module")
def land() -> Site:
    return read_boundary(shapely.box(1000, 2000, 1400, 2240), crs="EPSG:32630")


@pytest.fixture
def session(land: Site) -> Session:
    return Session.begin(land, CogenerateParams(min_area=1500))


def stepped(session: Session, levels: int) -> Session:
    for _ in range(levels):
        session.step()
    return session


def area_of(session: Session, parcel: int) -> float:
    face = session.parcels.index(parcel)
    return float(session.layout.mesh.face_area[face])


def assert_sound(layout: Layout, land: Site) -> None:
    layout.mesh.validate()
    polygons = layout.mesh.face_polygons()
    assert shapely.is_valid(polygons).all()
    assert shapely.coverage_is_valid(polygons)
    whole = sum(part.area for part in land.parts)
    assert layout.mesh.face_area.sum() == pytest.approx(whole, rel=1e-9)


# the tree of cuts


def test_unmixed_takes_back_what_was_mixed() -> None:
    values = np.random.default_rng(0).integers(0, 2**64, 1000, dtype=np.uint64)
    assert np.array_equal(unmixed(splitmix64(values)), values)


def test_parents_are_read_off_lineages_through_all_generations() -> None:
    root = 123456789
    first, second = child(root, 0), child(root, 1)
    leaves = [child(first, 0), child(second, 0), child(first, 1), child(child(second, 1), 0)]
    leaves += [child(child(second, 1), 1), 77]
    lineage = np.array(leaves, dtype=np.uint64)
    found = parents(lineage)
    assert found[first] == found[second] == root
    assert found[child(second, 1)] == second
    assert 77 not in found
    assert descendants(lineage, second, found) == [1, 3, 4]
    assert descendants(lineage, root, found) == [0, 1, 2, 3, 4]


def test_parents_that_were_seen_decide_which_half_was_first() -> None:
    root = 99
    turned = np.array([child(root, 1), child(root, 0)], dtype=np.uint64)
    assert parents(turned, seen=[root])[child(root, 0)] == root
    assert parents(turned)[child(root, 0)] != root


def test_merged_lineage_does_not_depend_on_the_order() -> None:
    some = np.array([3, 5, 9], dtype=np.uint64)
    assert merged(some) == merged(some[::-1]) != merged(some[:2])


# steps and finishing


def test_a_session_without_edits_is_cogeneration(sample: Find) -> None:
    site = read_boundary(sample("sant_adria"))
    params = CogenerateParams(parcels=120)
    session = Session.begin(site, params)
    while not session.finished:
        session.step()
    session.finish()
    assert session.is_complete
    assert session.layout.digest == cogenerate(site, params).digest


def test_finish_goes_through_all_levels(land: Site, session: Session) -> None:
    params = CogenerateParams(min_area=1500)
    change = session.finish()
    assert session.layout.digest == cogenerate(land, params).digest
    assert change.sentence == f"Finished: {len(session.parcels)} parcels."
    with pytest.raises(EditError, match="finished already"):
        session.finish()
    with pytest.raises(EditError, match="that the next level could cut"):
        session.step()


def test_other_strategies_divide_the_blocks_as_a_level(land: Site) -> None:
    params = CogenerateParams(min_area=900, strategy="obb")
    session = Session.begin(land, params)
    while not session.finished:
        session.step()
    session.finish()
    assert session.layout.digest == cogenerate(land, params).digest


def test_a_session_goes_on_with_a_layout_that_stopped(land: Site) -> None:
    whole = CogenerateParams(min_area=1500)
    stage = cogenerate(land, CogenerateParams(min_area=1500, stop_at_level=3))
    session = Session.of_layout(stage)
    assert session.level == 3
    assert session.figures()["to_cut"] == 8
    session.finish()
    assert session.layout.digest == cogenerate(land, whole).digest


def test_a_layout_of_other_origin_is_no_start(land: Site) -> None:
    made = cogenerate(land, CogenerateParams(min_area=1500)).replace(history=())
    with pytest.raises(BoundaryError, match="was begun with"):
        Session.of_layout(made)


def test_figures_agree_with_the_layout(session: Session) -> None:
    stepped(session, 4)
    figures, layout = session.figures(), session.layout
    assert figures["parcels"] == layout.mesh.n_faces == len(session.parcels)
    assert figures["mean_area_m2"] == pytest.approx(400 * 240 / layout.mesh.n_faces)
    assert figures["unreached"] == 0
    inner = layout.edge_street & (layout.edge_kind == 0)
    assert figures["street_km"] == pytest.approx(layout.mesh.edge_length[inner].sum() / 1000)


def test_the_session_of_the_samples_is_replayed(sample: Find) -> None:
    land = sample("irregular_64ha")
    session = Session.load(land.with_name("steering.json"), read_boundary(land))
    assert session.is_complete
    layout = session.layout
    assert [layout.land_uses[use] for use in layout.face_use[layout.face_locked]] == ["park"]
    assert len(layout.fixed_streets) == 3
    assert certificate(layout).holds
    assert session.figures()["street_ends"] == 0


# candidates and choices


def test_the_first_candidate_is_the_cut_of_the_next_level(session: Session) -> None:
    stepped(session, 2)
    best = {parcel: session.candidates(parcel)[0] for parcel in session.parcels}
    session.step()
    edges = shapely.union_all([p.exterior for p in session.layout.mesh.face_polygons()])
    origin = np.asarray(session.layout.frame.origin)
    for candidate in best.values():
        line = shapely.transform(candidate.line, lambda xy: xy - origin)
        # an end may move to where a neighbour's cut of the same level ends
        moved = 1.1 * TEE_SNAP * sum(candidate.areas) ** 0.5
        assert shapely.covers(shapely.buffer(edges, moved), line)


def test_candidates_are_ranked_legal_and_different(session: Session) -> None:
    stepped(session, 2)
    for parcel in session.parcels:
        found = session.candidates(parcel)
        assert [c.rank for c in found] == list(range(1, len(found) + 1))
        assert len(found) >= 2
        qualities = [c.quality for c in found]
        assert qualities == sorted(qualities, reverse=True)
        for c in found:
            assert c.quality == pytest.approx(sum(c.terms.values()), abs=1e-6)
            assert 1500 <= c.areas[0] <= c.areas[1]
            assert sum(c.areas) == pytest.approx(area_of(session, parcel), rel=1e-6)
            assert "street" in c.reason
        lines = [c.line for c in found]
        for i, line in enumerate(lines):
            assert all(shapely.hausdorff_distance(line, other) > 0.5 for other in lines[:i])


@pytest.mark.parametrize("rank", [1, 2, 3])
def test_a_chosen_candidate_is_the_cut_that_was_shown(
    land: Site, session: Session, rank: int
) -> None:
    stepped(session, 1)
    parcel = session.parcels[0]
    shown = session.candidates(parcel)[rank - 1]
    change = session.choose(parcel, rank)
    assert change.gone == (parcel,)
    assert len(change.new) == 2
    areas = sorted(area_of(session, number) for number in change.new)
    assert areas == pytest.approx(shown.areas, rel=1e-3)
    layout = session.layout
    origin = np.asarray(layout.frame.origin)
    kept = layout.steered(Steering.KEPT)
    cut = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[kept]] + origin
    assert shapely.hausdorff_distance(
        shapely.line_merge(shapely.multilinestrings(shapely.linestrings(cut))), shown.line
    ) == pytest.approx(0, abs=0.6)
    assert_sound(layout, land)


def test_halves_of_a_choice_wait_one_level(session: Session) -> None:
    stepped(session, 1)
    first, second = session.parcels
    halves = session.choose(first, 2).new
    stage = dict(zip(session.parcels, session.layout.face_stage.tolist(), strict=True))
    assert {stage[half] for half in halves} == {Stage.AHEAD}
    session.step()
    assert set(halves) <= set(session.parcels)
    assert second not in session.parcels
    session.step()
    assert not set(halves) & set(session.parcels)


def test_another_cut_in_place_of_one_that_was_undone_is_that_of_its_level(
    session: Session,
) -> None:
    stepped(session, 2)
    whole = session.undo_cut(session.parcels[0]).new[0]
    halves = session.choose(whole, 2).new
    session.step()
    assert not set(halves) & set(session.parcels)


def test_a_choice_that_was_undone_may_be_made_again(session: Session) -> None:
    stepped(session, 2)
    whole = session.parcels[0]
    half = session.choose(whole, 2).new[0]
    assert session.undo_cut(half).new == (whole,)
    halves = session.choose(whole, 1).new
    session.step()
    assert set(halves) <= set(session.parcels)


def test_a_chosen_cut_stays_to_the_end(land: Site, session: Session) -> None:
    stepped(session, 2)
    session.choose(session.parcels[0], 3)
    session.finish()
    assert session.layout.steered(Steering.KEPT).any()
    assert_sound(session.layout, land)


def test_a_candidate_that_is_not_there(session: Session) -> None:
    stepped(session, 1)
    parcel = session.parcels[0]
    with pytest.raises(EditError, match=rf"Parcel {parcel} has \d candidates.*there is no 9"):
        session.choose(parcel, 9)


def test_a_parcel_too_small_to_be_cut(session: Session) -> None:
    session.finish()
    parcel = session.parcels[0]
    assert session.candidates(parcel) == ()
    with pytest.raises(EditError, match="no cut leaves two halves of at least 1,500 m²"):
        session.choose(parcel, 1)


# cuts undone, parks, merged parcels


def test_undoing_a_cut_gives_the_parcel_back(land: Site, session: Session) -> None:
    stepped(session, 2)
    before = session.parcels
    session.step()
    change = session.undo_cut(session.parcels[0])
    assert len(change.new) == 1
    assert change.new[0] in before
    assert len(change.gone) == 2
    assert_sound(session.layout, land)


def test_undoing_a_cut_takes_all_descendants(land: Site, session: Session) -> None:
    stepped(session, 1)
    first, second = session.parcels
    session.choose(first, 1)
    half, other = session.choose(second, 1).new
    quarters = session.choose(half, 1).new
    change = session.undo_cut(other)
    assert change.new == (second,)
    assert set(change.gone) == {other, *quarters}
    assert area_of(session, second) == pytest.approx(400 * 240 / 2, rel=0.3)
    assert_sound(session.layout, land)


def test_the_land_was_not_cut_from_anything(session: Session) -> None:
    with pytest.raises(EditError, match="Parcel 1 did not come of a cut"):
        session.undo_cut(1)


def test_an_undone_cut_is_made_again_unless_locked(session: Session) -> None:
    stepped(session, 2)
    whole = session.undo_cut(session.parcels[0]).new[0]
    session.lock(whole)
    session.step()
    assert whole in session.parcels
    session.unlock(whole)
    session.step()
    assert whole not in session.parcels


def test_a_park_stays_as_it_is(land: Site, session: Session) -> None:
    stepped(session, 3)
    park = session.parcels[2]
    area = area_of(session, park)
    session.lock(park, "park")
    session.finish()
    layout = session.layout
    [face] = np.flatnonzero(layout.face_locked).tolist()
    assert layout.land_uses[layout.face_use[face]] == "park"
    assert layout.mesh.face_area[face] == pytest.approx(area, rel=1e-6)
    with pytest.raises(EditError, match=r"is locked as park"):
        session.choose(session.parcels[face], 1)
    with pytest.raises(EditError, match="locked as park already"):
        session.lock(session.parcels[face], "park")
    with pytest.raises(EditError, match="must name a use"):
        session.lock(session.parcels[face], "  ")


def neighbours_without_street(session: Session) -> tuple[int, int]:
    layout = session.layout
    sides = layout.mesh.face.reshape(-1, 2)
    inner = (sides >= 0).all(axis=1) & ~layout.edge_street
    for a, b in sides[inner].tolist():
        if (
            layout.face_block[a] == layout.face_block[b]
            and not layout.edge_street[np.isin(sides, (a, b)).all(axis=1)].any()
        ):
            return session.parcels[a], session.parcels[b]
    raise AssertionError("no neighbours without a street")


def test_merged_parcels_are_one_and_locked(land: Site, session: Session) -> None:
    stepped(session, 4)
    a, b = neighbours_without_street(session)
    total = area_of(session, a) + area_of(session, b)
    [one] = session.merge([a, b], "school").new
    assert area_of(session, one) == pytest.approx(total)
    session.step()
    assert one in session.parcels
    assert_sound(session.layout, land)
    layout = session.layout
    face = session.parcels.index(one)
    assert layout.land_uses[layout.face_use[face]] == "school"


def test_parcels_that_cannot_be_merged(session: Session) -> None:
    stepped(session, 4)
    with pytest.raises(EditError, match="at least two"):
        session.merge([session.parcels[0]])
    polygons = session.layout.mesh.face_polygons()
    far = int(np.argmax(shapely.distance(polygons[0], polygons)))
    with pytest.raises(EditError, match="do not all touch"):
        session.merge([session.parcels[0], session.parcels[far]])
    layout = session.layout
    sides = layout.mesh.face.reshape(-1, 2)
    street = np.flatnonzero(layout.edge_street & (sides >= 0).all(axis=1))[0]
    a, b = (session.parcels[face] for face in sides[street].tolist())
    with pytest.raises(EditError, match="A street runs between parcels"):
        session.merge([a, b])


def test_stages_and_quotas_come_back_with_an_undone_cut(land: Site) -> None:
    session = Session.begin(land, CogenerateParams(parcels=40))
    stepped(session, 2)
    first = session.parcels[0]
    halves = session.choose(first, 1).new
    quarters = session.choose(halves[0], 1).new
    assert session.undo_cut(quarters[0]).new == (halves[0],)
    stage = dict(zip(session.parcels, session.layout.face_stage.tolist(), strict=True))
    assert stage[halves[0]] == Stage.AHEAD
    session.step()
    assert set(halves) <= set(session.parcels)
    while not session.finished:
        session.step()
    total = int(session.layout.face_quota.sum())
    small = next(p for p in session.parcels if session.candidates(p) == () and area_of(session, p))
    assert total == 40
    session.undo_cut(small)
    assert int(session.layout.face_quota.sum()) == total


def test_a_layout_whose_cut_was_undone_after_the_end_is_finished_again(session: Session) -> None:
    session.finish()
    parcel = next(p for p in session.parcels if _can_be_undone(session, p))
    session.undo_cut(parcel)
    assert not session.is_complete
    session.finish()
    assert session.is_complete


def _can_be_undone(session: Session, parcel: int) -> bool:
    lineage = session.layout.face_lineage
    return int(lineage[session.parcels.index(parcel)]) in parents(lineage)


def test_merged_parcels_keep_the_use_that_they_have_in_common(session: Session) -> None:
    stepped(session, 4)
    a, b = neighbours_without_street(session)
    session.lock(a, "school")
    one = session.merge([a, b]).new[0]
    layout = session.layout
    assert layout.land_uses[layout.face_use[session.parcels.index(one)]] == "school"
    session.undo()
    session.lock(b, "park")
    with pytest.raises(EditError, match=r"different uses \(park, school\): say which use"):
        session.merge([a, b])
    assert session.merge([a, b], "campus").sentence.endswith("are one now, kept as campus.")


# numbers and places


def test_unknown_parcels_say_what_became_of_them(session: Session) -> None:
    with pytest.raises(EditError, match=r"There is no parcel 99; now there is parcel 1\."):
        session.candidates(99)
    session.step()
    with pytest.raises(EditError, match="Parcel 1 is no more: it was cut into 2 and 3"):
        session.choose(1, 1)
    with pytest.raises(EditError, match=r"There is no parcel at 0\.0, 0\.0"):
        session.lock((0.0, 0.0))


def test_a_place_does_for_a_parcel(session: Session) -> None:
    stepped(session, 2)
    number = session.parcel_at((1010.0, 2010.0))
    assert number in session.parcels
    assert session.candidates((1010.0, 2010.0)) == session.candidates(number)
    assert session.parcel_at((0.0, 0.0)) is None
    session.lock((1010.0, 2010.0))
    assert session.layout.face_locked[session.parcels.index(number)]


@pytest.mark.parametrize("parcel", [None, "3", True, (1.0,), (np.nan, 0.0), [1, 2, 3]])
def test_what_is_no_parcel(session: Session, parcel: object) -> None:
    with pytest.raises(EditError, match=r"parcel|coordinates"):
        session.do("lock", parcel=parcel) if parcel is not None else session.do("lock")


def test_edits_that_there_are_not(session: Session) -> None:
    with pytest.raises(EditError, match="There is no edit 'fly'; there are step, choose"):
        session.do("fly")
    with pytest.raises(EditError, match="lock knows no colour") as error:
        session.do("lock", colour="red")
    assert "lock needs parcel." in error.value.problems


# back and forth


def test_undo_and_redo_return_the_same_bytes(session: Session) -> None:
    digests = [session.layout.digest]
    stepped(session, 3)
    digests.append(session.layout.digest)
    session.lock(session.parcels[0])
    locked = session.layout
    session.choose(session.parcels[1], 2)
    digests.append(session.layout.digest)
    session.undo()
    assert session.layout.digest == locked.digest
    assert np.array_equal(session.layout.face_locked, locked.face_locked)
    session.undo()
    assert session.layout.digest == digests[1]
    assert not session.layout.face_locked.any()
    while session.can_undo:
        session.undo()
    assert session.layout.digest == digests[0]
    assert session.undo().sentence == "Nothing was done that could be undone."
    while session.can_redo:
        session.redo()
    assert session.layout.digest == digests[2]
    assert session.redo().sentence == "Nothing was undone that could be done again."


def test_what_was_undone_is_a_branch(session: Session) -> None:
    stepped(session, 2)
    session.choose(session.parcels[0], 1)
    one = session.layout.digest
    session.undo()
    session.choose(session.parcels[0], 2)
    other = session.layout.digest
    assert [branch.current for branch in session.branches()] == [False, True]
    session.go_to(session.branches()[0].number)
    assert session.layout.digest == one
    assert [branch.current for branch in session.branches()] == [True, False]
    session.go_to(session.branches()[1].number)
    assert session.layout.digest == other
    session.undo()
    session.redo()
    assert session.layout.digest == other
    with pytest.raises(EditError, match="There is no branch 77"):
        session.go_to(77)


def test_a_refused_edit_changes_nothing(session: Session) -> None:
    stepped(session, 2)
    digest, edits = session.layout.digest, session.edits
    with pytest.raises(EditError):
        session.choose(session.parcels[0], 50)
    assert session.layout.digest == digest
    assert session.edits == edits


def test_moments_of_long_ago_are_made_again(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("urban_processing.session.timeline.KEPT", 3)
    stepped(session, 2)
    digests = [session.layout.digest]
    for parcel in session.parcels:
        session.choose(parcel, 2)
        digests.append(session.layout.digest)
    for k in range(8):
        session.lock(session.parcels[k % 8], f"use {k}")
    for _ in range(8):
        session.undo()
    for digest in reversed(digests):
        assert session.layout.digest == digest
        session.undo()


def test_provenance_tells_what_was_done(session: Session) -> None:
    stepped(session, 2)
    session.lock(session.parcels[0], "park")
    begun, steered = session.layout.history[-2:]
    assert begun.algorithm == "cogenerate"
    assert steered.algorithm == "steer"
    assert [edit["edit"] for edit in steered.parameters["edits"]] == ["step", "step", "lock"]
    assert steered.results["level"] == 2


# hand edits


def layers_of(session: Session) -> tuple[list[shapely.Polygon], list[shapely.LineString]]:
    """Parcels and streets on the map, as a GIS shows them."""
    layout = session.layout
    origin = np.asarray(layout.frame.origin)
    mesh = layout.mesh
    ends = mesh.xy[mesh.origin.reshape(-1, 2)[layout.edge_street]] + origin
    return list(mesh.face_polygons(layout.frame.origin)), list(shapely.linestrings(ends))


def test_layers_that_nobody_edited_change_nothing(land: Site, session: Session) -> None:
    stepped(session, 4)
    session.lock(session.parcels[3], "park")
    session.choose(session.parcels[0], 1)
    before = session.layout
    change = session.adopt(*layers_of(session))
    after = session.layout
    assert change.gone == change.new == ()
    assert "kept as they were" in change.sentence
    assert after.mesh.face_area == pytest.approx(before.mesh.face_area)
    for name in ("face_lineage", "face_level", "face_locked", "face_use", "face_stage"):
        assert np.array_equal(getattr(after, name), getattr(before, name)), name
    assert after.edge_street.sum() == before.edge_street.sum()
    assert after.steered(Steering.KEPT).sum() == before.steered(Steering.KEPT).sum()
    session.finish()
    assert_sound(session.layout, land)


def test_a_parcel_that_was_split_by_hand(land: Site, session: Session) -> None:
    stepped(session, 3)
    session.lock(session.parcels[1], "park")
    polygons, lines = layers_of(session)
    number = session.parcels[0]
    box = polygons[0].minimum_rotated_rectangle.exterior.coords
    middle = [np.mean([box[k], box[k + 1]], axis=0) for k in (0, 2)]
    knife = shapely.LineString(middle)
    pieces = [*shapely.ops.split(polygons[0], affinity.scale(knife, 1.5, 1.5)).geoms]
    assert len(pieces) == 2
    change = session.adopt([*pieces, *polygons[1:]], lines)
    assert len(change.new) in (1, 2)
    assert len(session.parcels) == 9
    layout = session.layout
    assert layout.face_locked.sum() == 1
    assert len(set(layout.face_lineage.tolist())) == 9
    assert_sound(layout, land)
    # one half is still the same parcel, the other is new
    assert (number in session.parcels) == (len(change.new) == 1)
    areas = [area_of(session, piece) for piece in {number, *change.new} & set(session.parcels)]
    assert sum(areas) == pytest.approx(polygons[0].area, rel=1e-6)


def test_a_street_that_was_drawn_by_hand(land: Site, session: Session) -> None:
    stepped(session, 4)
    polygons, lines = layers_of(session)
    a, b = neighbours_without_street(session)
    faces = [session.parcels.index(number) for number in (a, b)]
    between = shapely.line_merge(shapely.intersection(*(polygons[face].exterior for face in faces)))
    session.adopt(polygons, [*lines, between])
    layout = session.layout
    drawn = layout.edge_fixed >= 0
    assert layout.mesh.edge_length[drawn].sum() == pytest.approx(between.length, rel=1e-6)
    session.step()
    assert session.layout.edge_street[session.layout.edge_fixed >= 0].all()
    assert_sound(session.layout, land)


def test_a_street_that_was_deleted_by_hand_is_not_laid_again(land: Site, session: Session) -> None:
    stepped(session, 5)
    before = session.layout
    inner = before.edge_street & (before.edge_kind == EdgeKind.INTERIOR)
    polygons, _ = layers_of(session)
    origin = np.asarray(before.frame.origin)
    mesh = before.mesh
    # of every inner street it is tried whether the layout can do without it
    for edge in np.flatnonzero(inner).tolist():
        kept = before.edge_street.copy()
        kept[edge] = False
        ends = mesh.xy[mesh.origin.reshape(-1, 2)[kept]] + origin
        try:
            session.adopt(polygons, shapely.linestrings(ends))
        except EditError:
            assert session.layout is before
            continue
        barred = session.layout.steered(Steering.NO_STREET)
        length = mesh.edge_length[edge]
        assert session.layout.mesh.edge_length[barred].sum() == pytest.approx(length)
        assert not session.layout.edge_street[barred].any()
        assert_sound(session.layout, land)
        return
    pytest.fail("no street can be done without")


def test_layers_that_do_not_cover_the_land_are_refused(session: Session) -> None:
    stepped(session, 3)
    polygons, lines = layers_of(session)
    fewer = [line for line in lines if shapely.distance(line, polygons[0]) > 0]
    with pytest.raises(EditError, match="m² of the land belong to no parcel"):
        session.adopt(polygons[1:], fewer)
    more = [*polygons, shapely.box(1400, 2000, 1500, 2240)]
    with pytest.raises(EditError, match="beyond the land: cut them at its rim"):
        session.adopt(more, lines)


@pytest.mark.parametrize("what", ["overlap", "gap", "off", "none"])
def test_layers_that_do_not_fit_are_refused(session: Session, what: str) -> None:
    stepped(session, 3)
    polygons, lines = layers_of(session)
    digest = session.layout.digest
    if what == "overlap":
        polygons[0] = polygons[0].buffer(4.0, join_style="mitre")
    elif what == "gap":
        inner = session.layout.rim_parcel
        polygons[int(np.argmin(inner))] = polygons[int(np.argmin(inner))].buffer(-5.0)
    elif what == "off":
        lines.append(shapely.LineString([(1000, 2000), (1400, 2240)]))
    else:
        polygons = []
    with pytest.raises(EditError, match=r"overlap|belong to none|split the parcels|No parcel"):
        session.adopt(polygons, lines)
    assert session.layout.digest == digest
