"""What rows of layers say of parcels and streets, and what they leave open."""

from __future__ import annotations

import datetime
import math
from typing import Any

import numpy as np
import pytest
import shapely
from grid_layouts import boxes

from urban_processing.hashing import child
from urban_processing.layer_rows import (
    PARCEL_COLUMNS,
    VALUES_IGNORED,
    FaceValues,
    parcel_rows,
    street_rows,
    values_of_faces,
)
from urban_processing.layout import NOT_FIXED, Stage

CELLS = np.array(boxes(4, 1), dtype=object)
"""Four parcels of 400 m²."""


def values(
    source: list[int] | None = None,
    polygons: np.ndarray = CELLS,
    *,
    min_area: float = 100.0,
    **columns: list[Any],
) -> FaceValues:
    n = len(next(iter(columns.values()))) if columns else len(polygons)
    arrays = {
        name: np.array([*column, None], dtype=object)[:-1] for name, column in columns.items()
    }
    rows = parcel_rows(arrays, n).taken(np.array(source or range(n)))
    return values_of_faces(rows, polygons, min_area=min_area)


def test_rows_that_say_all_are_followed() -> None:
    found = values(
        level=[1, 2.0, "3", np.int64(4)],
        land_use=["parcel", "park", " school ", 7],
        locked=[True, 0, "yes", np.float64(1.0)],
        lineage=["a", "00000000000000ff", "FFFFFFFFFFFFFFFF", "1"],
        stage=["done", "open", "Ahead", "behind"],
        quota=[3, None, 2.0, "4"],
    )
    assert found.face_level.tolist() == [1, 2, 3, 4]
    assert [found.land_uses[i] for i in found.face_use] == ["parcel", "park", "school", "7"]
    assert found.land_uses[0] == "parcel"
    assert found.face_locked.tolist() == [True, False, True, True]
    assert found.face_lineage.tolist() == [10, 255, 2**64 - 1, 1]
    assert found.face_stage.tolist() == [Stage.DONE, Stage.OPEN, Stage.AHEAD, Stage.BEHIND]
    assert found.face_quota.tolist() == [3, 0, 2, 4]
    assert not found.in_pieces.any()


def test_rows_that_say_nothing_take_the_defaults() -> None:
    large = np.array([*CELLS[:3], shapely.box(80, 0, 100, 50)], dtype=object)
    found = values(polygons=large, min_area=500.0)
    assert found.face_level.tolist() == [0] * 4
    assert found.land_uses == ("parcel",)
    assert not found.face_locked.any()
    assert found.face_stage.tolist() == [Stage.DONE] * 3 + [Stage.OPEN]
    assert found.face_quota.tolist() == [0] * 4
    assert len(set(found.face_lineage.tolist())) == 4
    other_order = values(polygons=large[::-1], min_area=500.0)
    assert other_order.face_lineage[::-1].tolist() == found.face_lineage.tolist()


@pytest.mark.parametrize(
    ("column", "strange"),
    [
        ("level", [-1, 1.5, "ground", math.inf, True, datetime.date(2020, 1, 1)]),
        ("locked", [2, "maybe", datetime.date(2020, 1, 1)]),
        ("lineage", ["xyz", "1" * 17, -1, "0x1f", "1_0"]),
        ("stage", ["opne", 1, datetime.date(2020, 1, 1)]),
        ("quota", [-2, 2.5, "many", 10**400]),
    ],
)
def test_values_without_meaning_are_told_and_take_the_defaults(
    column: str, strange: list[Any]
) -> None:
    blank = [None, math.nan, "", " "]
    rows = parcel_rows({column: np.array([*strange, *blank, None], dtype=object)}, len(strange) + 5)
    (issue,) = rows.issues
    assert issue.code == VALUES_IGNORED
    assert issue.value == len(strange)
    assert f"Column {column} of the parcels: {strange[0]!r} means nothing" in issue.message
    assert getattr(rows, column).gaps.all()
    assert not rows.is_whole


def test_only_rows_that_say_all_are_whole() -> None:
    whole = {
        name: np.array([value], dtype=object)
        for name, value in zip(PARCEL_COLUMNS, (0, "parcel", False, "a", "open", None), strict=True)
    }
    assert parcel_rows(whole, 1).is_whole
    for name in PARCEL_COLUMNS[:-1]:
        assert not parcel_rows({k: v for k, v in whole.items() if k != name}, 1).is_whole


def test_a_parcel_that_was_split_in_two_is_two_halves_that_share_its_quota() -> None:
    halves = np.array([*CELLS[1:], shapely.box(80, 0, 85, 20)], dtype=object)
    found = values(
        polygons=halves,
        level=[4] * 4,
        lineage=["aa", "bb", "cc", "cc"],
        quota=[1, 2, 5, 5],
        stage=["open"] * 4,
    )
    assert found.face_level.tolist() == [4, 4, 5, 5]
    assert found.face_lineage.tolist() == [0xAA, 0xBB, child(0xCC, 0), child(0xCC, 1)]
    assert found.face_quota.tolist() == [1, 2, 4, 1]
    assert found.in_pieces.tolist() == [False, False, True, True]


def test_quotas_that_were_given_to_the_halves_by_hand_count() -> None:
    found = values(lineage=["a", "b", "c", "c"], quota=[1, 1, 3, 2])
    assert found.face_quota.tolist() == [1, 1, 3, 2]


def test_a_row_in_pieces_is_several_parcels() -> None:
    found = values([0, 1, 1, 1], lineage=["a", "b"], quota=[2, 7], level=[3, 3])
    assert found.face_level.tolist() == [3, 4, 4, 4]
    assert len(set(found.face_lineage.tolist()) - {0xA, 0xB}) == 3
    assert not set(found.face_lineage.tolist()) & {child(0xB, 0), child(0xB, 1)}
    assert found.face_quota[0] == 2
    assert sorted(found.face_quota[1:].tolist()) == [2, 2, 3]


def test_pieces_of_a_row_without_lineage_share_its_quota() -> None:
    found = values([0, 1, 1, 1], quota=[2, 6], level=[3, 3])
    assert found.face_quota.tolist() == [2, 2, 2, 2]
    assert found.face_level.tolist() == [3, 3, 3, 3]


def test_a_lineage_that_is_there_is_given_to_no_piece() -> None:
    used = f"{child(0xC, 0):016x}"
    found = values(lineage=[used, "b", "c", "c"])
    assert len(set(found.face_lineage.tolist())) == 4
    assert found.face_lineage[0] == child(0xC, 0)


def test_pieces_do_not_depend_on_the_order_of_rows() -> None:
    columns = {"lineage": ["a", "c", "c", "c"], "quota": [1, 9, 9, 9]}
    found = values(**columns)
    order = [2, 0, 3, 1]
    mixed = values(polygons=CELLS[order], **{k: [v[i] for i in order] for k, v in columns.items()})
    assert mixed.face_lineage.tolist() == found.face_lineage[order].tolist()
    assert mixed.face_quota.sum() == found.face_quota.sum() == 10


def test_a_drawn_parcel_becomes_as_many_as_fall_to_its_area() -> None:
    found = values(lineage=["a", "b", "c", None], quota=[4, 4, 4, None])
    assert found.face_quota.tolist() == [4, 4, 4, 4]
    locked = values(
        lineage=["a", "b", "c", None], quota=[4, 4, 4, None], locked=[False, False, False, True]
    )
    assert locked.face_quota.tolist() == [4, 4, 4, 0]


def test_what_rows_of_streets_say() -> None:
    rows = street_rows(
        {
            "level": np.array([0, 3, None, "x"], dtype=object),
            "fixed_id": np.array([2.0, math.nan, 3.0, 1.0]),
        },
        4,
        n_given=2,
    )
    assert rows.level.tolist() == [0, 3, -1, -1]
    assert rows.fixed.tolist() == [1, NOT_FIXED, NOT_FIXED, 0]
    assert [issue.code for issue in rows.issues] == [VALUES_IGNORED]
    assert rows.taken(np.array([1, 1])).level.tolist() == [3, 3]
