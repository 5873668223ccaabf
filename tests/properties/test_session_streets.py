"""Streets drawn anywhere on any land: a layout that holds, or one clear refusal."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lands import LANDS, site_of
from steered import ANY, assert_partition, moment_of, tried

from urban_processing.errors import EditError
from urban_processing.mesh.planar import FloatArray
from urban_processing.pipelines.levels import with_streets
from urban_processing.session.moment import Moment, next_moment
from urban_processing.session.requirements import check
from urban_processing.session.street_edits import add_street, remove_street
from urban_processing.site import AREA_ROUNDING, snap_to_grid

FEW = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize=True,
)

MOMENTS: dict[tuple[str, int, bool], Moment] = {}


def moment_for(name: str, levels: int, *, rim: bool) -> Moment:
    key = name, levels, rim
    if key not in MOMENTS:
        MOMENTS[key] = moment_of(LANDS[name], levels=levels, rim=rim)
    return MOMENTS[key]


def some_line(moment: Moment, rng: np.random.Generator) -> FloatArray:
    """From one vertex to another, with bends."""
    xy = moment.state.layout.mesh.xy
    side = np.sqrt(moment.state.layout.mesh.face_area.mean())
    n = int(rng.integers(2, 6))
    a, b = xy[rng.integers(len(xy), size=2)]
    line = a + (b - a) * np.linspace(0, 1, n)[:, None]
    line[1:-1] += rng.normal(0, 0.1 * side, (n - 2, 2))
    return np.asarray(line)


@FEW
@given(
    name=st.sampled_from(sorted(LANDS)),
    levels=st.integers(0, 6),
    rim=st.booleans(),
    seed=st.integers(0, 2**31),
    share=st.sampled_from([0.001, 0.02, 0.1, 0.3]),
    follow=st.booleans(),
)
def test_street_or_refusal(
    name: str, levels: int, rim: bool, seed: int, share: float, follow: bool
) -> None:
    rng = np.random.default_rng(seed)
    moment = moment_for(name, levels, rim=rim)
    layout = moment.state.layout
    side = float(np.sqrt(layout.mesh.face_area.mean()))
    for _ in range(4):
        line = some_line(moment, rng)
        result = tried(
            lambda line=line: add_street(moment, line, snap=share * side, follow=follow, given=ANY)
        )
        if isinstance(result, EditError):
            assert all(p.endswith(".") for p in result.problems)
            continue
        state, said = result
        assert said.startswith("A street of ")
        assert_partition(moment.state, state)
        small = state.layout.mesh.face_area < moment.state.min_area * (1.0 - AREA_ROUNDING)
        after = next_moment(moment, state)
        assert all(after.number(f) in moment.parcels for f in np.flatnonzero(small).tolist())
        assert (state.layout.edge_street | ~(state.layout.edge_fixed >= 0)).all()
        # what was street is street
        assert state.layout.edge_street.sum() > layout.edge_street.sum()
        grown = next_moment(moment, with_streets(state))
        own = grown.state.layout.edge_fixed >= 0
        assert np.array_equal(own, state.layout.edge_fixed >= 0)
        assert grown.state.layout.edge_street[own].all()
        broken = tried(lambda grown=grown: check(moment, grown))
        if broken is not None:
            # a street between two rims that are none cannot be joined to the others
            assert not rim
            assert "pieces that no street joins" in str(broken)


@FEW
@given(
    name=st.sampled_from(["square", "ellipse", "star", "ell"]),
    levels=st.integers(0, 4),
    seed=st.integers(0, 2**31),
    turn=st.sampled_from([30.0, 90.0, 137.0]),
)
def test_turned_land_takes_the_same_street(name: str, levels: int, seed: int, turn: float) -> None:
    """A street cuts the turned layout as it cuts the one that was not."""
    moment = moment_for(name, levels, rim=True)
    rng = np.random.default_rng(seed)
    line = some_line(moment, rng)
    side = float(np.sqrt(moment.state.layout.mesh.face_area.mean()))
    turned = _turned(moment, turn)
    outcomes: list[list[float]] = []
    for m, drawn in ((moment, line), (turned, _rotate(line, turn))):
        result = tried(
            lambda m=m, drawn=drawn: add_street(m, drawn, snap=0.07 * side, follow=False, given=ANY)
        )
        if isinstance(result, EditError):
            outcomes.append([float(len(result.problems))])
        else:
            outcomes.append(np.sort(result[0].layout.mesh.face_area).tolist())
    assert outcomes[0] == pytest.approx(outcomes[1], abs=0.1)


def _rotate(xy: FloatArray, degrees: float) -> FloatArray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(xy @ np.array([[c, s], [-s, c]]))


def _turned(moment: Moment, degrees: float) -> Moment:
    layout = moment.state.layout
    mesh = dataclasses.replace(layout.mesh, xy=snap_to_grid(_rotate(layout.mesh.xy, degrees)))
    state = dataclasses.replace(moment.state, layout=layout.replace(mesh=mesh))
    return dataclasses.replace(moment, state=state)


@FEW
@given(
    name=st.sampled_from(sorted(LANDS)),
    levels=st.integers(1, 6),
    seed=st.integers(0, 2**31),
)
def test_removal_or_refusal(name: str, levels: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    moment = moment_for(name, levels, rim=True)
    layout = moment.state.layout
    edge = int(rng.choice(np.flatnonzero(layout.edge_street)))
    place = layout.mesh.xy[layout.mesh.origin[2 * edge : 2 * edge + 2]].mean(axis=0)
    state, said = remove_street(moment, place, reach=1.0)
    assert not state.layout.edge_street[edge]
    after = next_moment(moment, with_streets(state))
    assert not after.state.layout.edge_street[edge]
    broken = tried(lambda: check(moment, after))
    if broken is not None:
        assert all("reached" in p or "joins" in p for p in broken.problems)
    assert shapely.coverage_is_valid(after.state.layout.mesh.face_polygons())
    assert said.startswith("A street of")


def test_two_parts_each_for_itself() -> None:
    parts = LANDS["square"], shapely.affinity.translate(LANDS["ellipse"], 900, 200)
    moment = moment_of(site_of(*parts), levels=2)
    state, _ = add_street(moment, np.array([(0.0, 77.0), (400.0, 77.0)]), snap=3.0, follow=False,
                          given=ANY)  # fmt: skip
    check(moment, next_moment(moment, with_streets(state)))
    across = np.array([(0.0, 77.0), (900.0, 200.0)])
    with pytest.raises(EditError, match="leaves the land"):
        add_street(moment, across, snap=3.0, follow=False, given=ANY)
