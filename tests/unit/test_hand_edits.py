"""Parcels of layouts that were edited by hand, found again."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from grid_layouts import grid, layout_of
from shapely.affinity import translate

from urban_processing.assembly import EDITED_SINCE
from urban_processing.errors import BoundaryError
from urban_processing.layout import Layout
from urban_processing.persistence.layers import Change
from urban_processing.pipelines.hand_edits import edits_listed, match_parcels
from urban_processing.site import Frame

MIDDLE = [(0, 2), (4, 2)]


@pytest.fixture(scope="module")
def before() -> Layout:
    return grid(4, 4, MIDDLE)


def edited(before: Layout, polygons: list[shapely.Polygon]) -> Layout:
    return layout_of(polygons, MIDDLE)


def test_nothing_changed_whatever_the_order_and_the_origin(before: Layout) -> None:
    order = np.random.default_rng(0).permutation(16)
    polygons = before.mesh.face_polygons()
    shifted = [translate(p, -100, 40) for p in polygons[order]]
    after = layout_of(shifted).replace(frame=Frame("EPSG:32630", (100.0, -40.0)))
    match = match_parcels(before, after)
    assert match.source.tolist() == order.tolist()
    assert match.counts[Change.KEPT] == 16
    assert sum(match.counts.values()) == 16
    assert match.in_words == "16 kept as they were"


def test_a_split_and_a_merged_parcel(before: Layout) -> None:
    polygons = list(before.mesh.face_polygons())
    x0, y0, x1, y1 = polygons[5].bounds
    low, high = shapely.box(x0, y0, x1, y0 + 8), shapely.box(x0, y0 + 8, x1, y1)
    merged = shapely.union(polygons[14], polygons[15])
    others = [p for i, p in enumerate(polygons) if i not in (5, 14, 15)]
    after = edited(before, [low, *others, merged, high])
    match = match_parcels(before, after)
    source = match.source.tolist()
    assert sorted([source[0], source[-1]]) == [-1, 5]
    assert match.part_of[[0, -1]].tolist() == [5, 5]
    assert source[1:-2] == [i for i in range(16) if i not in (5, 14, 15)]
    assert source[-2] in (14, 15, -1)
    assert len(set(source) - {-1}) == sum(s >= 0 for s in source)
    assert match.counts[Change.SPLIT] == 1
    assert match.counts[Change.MERGED] in (1, 2)
    assert match.counts[Change.KEPT] == 13


def test_parcels_are_found_again_where_a_street_was_moved(before: Layout) -> None:
    bent = [
        shapely.transform(p, lambda xy: xy + (xy[:, 1:] == 40) * [0, 6.0])
        for p in before.mesh.face_polygons()
    ]
    after = layout_of(bent, [(0, 2.3), (4, 2.3)])
    match = match_parcels(before, after)
    assert match.source.tolist() == list(range(16))
    assert match.counts[Change.MOVED] == 8


def test_the_changes_are_listed_with_the_numbers_of_both_layouts(before: Layout) -> None:
    polygons = list(before.mesh.face_polygons())
    after = edited(before, polygons[:3] + polygons[4:])
    told, made = edits_listed(before, after, called="before.gpkg")
    assert told.issues[-1].code == EDITED_SINCE
    assert told.issues[-1].message == ("Parcels since before.gpkg: 15 kept as they were, 1 gone.")
    table = made.table("changes")
    row = dict(zip(table["old_id"], table["new_id"], strict=True))
    assert row[5] == 4
    assert np.isnan(row[4])
    assert len(row) == 16


def test_layouts_in_different_crs_are_refused(before: Layout) -> None:
    other = before.replace(frame=Frame("EPSG:32631"))
    with pytest.raises(BoundaryError, match="different CRSs: EPSG:32630 and EPSG:32631"):
        match_parcels(before, other)
