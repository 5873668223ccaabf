"""What a layout knows of itself when some of its fields change."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from lands import LANDS, site_of

from urban_processing.layout import DERIVED, Layout
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.levels import begin, step
from urban_processing.subdivision.short_edges import remove_short_edges


@pytest.fixture(scope="module")
def layout() -> Layout:
    state = begin(site_of(LANDS["star"]), CogenerateParams(parcels=40))
    for _ in range(4):
        state = step(state)
    return state.layout


def known(layout: Layout) -> dict[str, object]:
    """What is worked out of a layout."""
    return {name: getattr(layout, name) for name in DERIVED}


def test_what_parcels_know_of_themselves_changes_nothing_that_is_worked_out(
    layout: Layout,
) -> None:
    before = known(layout)
    changed = layout.replace(
        face_locked=~layout.face_locked, issues=(), land_uses=("parcel", "park")
    )
    assert all(getattr(changed, name) is value for name, value in before.items())
    # it is what would be worked out anew
    fresh = dataclasses.replace(changed)
    for name in ("frontage", "face_block", "rim_parcel", "chain_street", "chain_kind"):
        assert np.array_equal(getattr(fresh, name), before[name]), name
    assert fresh.digest == changed.digest


def test_other_streets_are_worked_out_anew(layout: Layout) -> None:
    known(layout)
    bare = layout.replace(edge_street=np.zeros_like(layout.edge_street))
    assert not bare.frontage.any()
    assert not bare.chain_street.any()
    assert bare.digest != layout.digest
    assert len(np.unique(bare.face_block)) == 1


def test_short_sides_of_some_parcels_alone(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    # so many sides are short that a few of them can be merged
    monkeypatch.setattr("urban_processing.subdivision.short_edges.SHORT_SHARE", 0.7)
    every = np.arange(layout.mesh.n_faces)
    whole = remove_short_edges(layout, min_area=0.0)
    assert whole.digest != layout.digest
    assert remove_short_edges(layout, min_area=0.0, faces=every).digest == whole.digest
    assert remove_short_edges(layout, min_area=0.0, faces=every[:0]) is layout
    before = layout.mesh.face_area
    moved = [
        np.flatnonzero(remove_short_edges(layout, min_area=0.0, faces=[f]).mesh.face_area != before)
        for f in every
    ]
    assert any(map(len, moved))
    sides = layout.mesh.face.reshape(-1, 2)
    for face, others in zip(every, moved, strict=True):
        near = sides[(sides == face).any(axis=1)]
        second = sides[np.isin(sides, near[near >= 0]).any(axis=1)]
        assert np.isin(others, second).all()
