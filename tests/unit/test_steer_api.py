"""Steering in Python: what `steer` takes, and its frames."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import shapely

import urban_processing as up
from urban_processing.errors import BoundaryError, EditError, ParameterError
from urban_processing.session.edits import make_edit

LAND = shapely.box(0, 0, 300, 200)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    session = up.steer(LAND, crs="EPSG:32630", min_area=2000)
    session.step()
    session.lock(2, "park")
    return session.save(tmp_path / "session.json")


def test_a_saved_session_is_replayed_with_its_parameters(saved: Path) -> None:
    session = up.steer(LAND, crs="EPSG:32630", replay=saved)
    assert session.params.min_area == 2000
    assert [edit.name for edit in session.edits] == ["step", "lock"]
    assert session.numbered_parcels.land_use.to_dict() == {2: "park", 3: "parcel"}


def test_a_session_of_another_land_is_refused(saved: Path) -> None:
    with pytest.raises(EditError, match="the land is another one, or has changed since"):
        up.steer(shapely.box(0, 0, 400, 210), crs="EPSG:32630", replay=saved)


def test_a_session_with_other_parameters_is_refused(saved: Path) -> None:
    words = r"other parameters: min_area was 2000\.0 and is 900\.0"
    with pytest.raises(EditError, match=words):
        up.steer(LAND, crs="EPSG:32630", min_area=900, replay=saved)


def test_a_layout_that_stopped_is_steered(tmp_path: Path) -> None:
    stage = up.cogenerate(LAND, crs="EPSG:32630", min_area=2000, stop_at_level=2)
    file = stage.save(tmp_path / "stage.gpkg")
    sessions = [up.steer(layout=given) for given in (stage, stage.layout, file)]
    assert [session.level for session in sessions] == [2, 2, 2]
    assert len({session.layout.digest for session in sessions}) == 1


def test_layers_of_any_origin_are_steered() -> None:
    made = up.cogenerate(LAND, crs="EPSG:32630", min_area=8000)
    begun = up.resume(
        parcels=made.parcels[["geometry"]],
        streets=made.streets[["geometry"]],
        min_area=1500,
        stop_at_level=0,
    )
    session = up.steer(layout=begun)
    assert session.figures()["to_cut"] == len(made.parcels)
    assert len(session.step().new) > len(made.parcels)


def test_candidates_and_parcels_are_frames() -> None:
    session = up.steer(LAND, crs="EPSG:32630", min_area=2000)
    session.step()
    frame = session.numbered_parcels
    assert frame.index.tolist() == [2, 3]
    assert frame.index.name == "parcel"
    lines = session.candidate_lines(2)
    assert lines.crs == "EPSG:32630"
    assert lines.index.tolist() == list(range(1, len(lines) + 1))
    assert lines.quality.is_monotonic_decreasing
    assert lines.quality.tolist() == pytest.approx(
        lines[["size", "shape", "access", "clearance", "variation", "continuity"]].sum(axis=1)
    )
    halved = session.choose(2, 1).new
    assert session.numbered_parcels.loc[list(halved)].area.min() == pytest.approx(
        lines.smaller_m2[1], rel=1e-3
    )
    session.finish()
    assert session.candidate_lines(session.parcels[0]).empty


def test_what_steer_does_not_take(saved: Path) -> None:
    layout = up.cogenerate(LAND, crs="EPSG:32630", min_area=2000)
    with pytest.raises(BoundaryError, match="Give the land that a session begins with, or a"):
        up.steer()
    with pytest.raises(BoundaryError, match="Give the land that a session begins with, or a"):
        up.steer(LAND, layout=layout)
    with pytest.raises(BoundaryError, match="A layout brings its parameters along"):
        up.steer(layout=layout, min_area=900)
    with pytest.raises(ParameterError, match="one of the two is needed"):
        up.steer(LAND, crs="EPSG:32630")
    with pytest.raises(EditError, match="made on land, and this is a layout"):
        up.steer(layout=layout, replay=saved)
    with pytest.raises(EditError, match="does not exist"):
        up.steer(LAND, crs="EPSG:32630", replay=saved.with_name("other.json"))


def test_the_example_of_the_documentation_runs(
    sample: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    land = sample("irregular_64ha")
    root = land.parents[1]
    text = (root / "docs" / "steering.md").read_text("utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    assert "sample_data/irregular_64ha.gpkg" in code
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(code.replace("sample_data/irregular_64ha.gpkg", str(land)), names)
    session = names["session"]
    assert session.is_complete
    assert (session.view.parcels.land_use == "park").sum() == 1
    assert {path.name for path in tmp_path.iterdir()} == {"layout.gpkg", "session.json"}


def test_the_edits_of_the_documentation_are_read(sample: Callable[[str], Path]) -> None:
    text = (sample("rect").parents[1] / "docs" / "steering.md").read_text("utf-8")
    for row in json.loads(text.split("```json\n")[1].split("```")[0]):
        make_edit(row.pop("edit"), row)


def test_frames_are_taken_over() -> None:
    session = up.steer(LAND, crs="EPSG:32630", min_area=2000)
    for _ in range(3):
        session.step()
    change = session.adopt(session.numbered_parcels, session.view.streets)
    assert change.gone == change.new == ()


def test_a_session_stops_after_every_level() -> None:
    with pytest.raises(ParameterError, match="leave out stop_at_level"):
        up.steer(LAND, crs="EPSG:32630", min_area=2000, stop_at_level=3)
