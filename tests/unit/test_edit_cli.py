"""`edit` on the command line: on land, on a stage, in a chain; what is wrong, and exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import geopandas as gpd
import pytest
import shapely
from click.testing import CliRunner, Result

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.io.files import read_layout
from urban_processing.session.session import Session

CRS = "EPSG:32632"
LAND = shapely.box(500_000, 5_200_000, 500_400, 5_200_240)
CORNER = (500_010.0, 5_200_010.0)
OTHER_CORNER = (500_390.0, 5_200_230.0)


@pytest.fixture
def land(tmp_path: Path) -> Path:
    path = tmp_path / "land.gpkg"
    gpd.GeoDataFrame(geometry=[LAND], crs=CRS).to_file(path)
    return path


@pytest.fixture
def steered(land: Path) -> up.GeoSession:
    """A session with some edits."""
    session = up.steer(land, min_area=1500)
    session.step()
    session.step()
    session.choose(CORNER, 2)
    session.lock(OTHER_CORNER)
    session.step()
    return session


@pytest.fixture
def stage(land: Path, tmp_path: Path) -> Path:
    """A layout that stopped at the second level."""
    path = tmp_path / "stage.gpkg"
    result = _run("cogenerate", land, "-o", path, "--min-area", 1500, "--stop-at-level", 2)
    assert result.exit_code == 0
    return path


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


def _edit(*arguments: object) -> Result:
    return _run("edit", *arguments)


def _list(folder: Path, *edits: dict[str, Any]) -> Path:
    path = folder / "edits.json"
    path.write_text(json.dumps(edits))
    return path


def _problem(result: Result, code: int) -> str:
    """What a failed call says last; it is no traceback."""
    assert result.exit_code == code
    assert "Traceback" not in result.stderr
    [line] = [line for line in result.stderr.splitlines() if line.startswith("Error: ")]
    return line.removeprefix("Error: ")


# ---- runs ------------------------------------------------------------------------------------


def test_a_session_on_land_gives_the_same_bytes(
    land: Path, steered: up.GeoSession, tmp_path: Path
) -> None:
    saved = steered.save(tmp_path / "session.json")
    mine = steered.view.save(tmp_path / "mine.gpkg")
    result = _edit(land, saved, "-o", tmp_path / "out.gpkg")
    assert result.exit_code == 0
    assert (tmp_path / "out.gpkg").read_bytes() == mine.read_bytes()
    assert "parcels" in result.stdout


def test_a_list_on_a_stage_gives_the_same_bytes(stage: Path, tmp_path: Path) -> None:
    edits = _list(
        tmp_path,
        {"edit": "lock", "parcel": CORNER, "land_use": "school"},
        {"edit": "step"},
        {"edit": "choose", "parcel": OTHER_CORNER, "candidate": 2},
        {"edit": "finish"},
    )
    out, picture = tmp_path / "out.gpkg", tmp_path / "out.png"
    assert _edit(stage, edits, "-o", out, "--plot", picture).exit_code == 0
    session = up.steer(layout=stage, replay=edits)
    assert session.view.save(tmp_path / "mine.gpkg").read_bytes() == out.read_bytes()
    assert picture.stat().st_size > 1000
    frame = up.read_layout(out).parcels
    [school] = frame[frame.land_use == "school"].itertuples()
    assert school.locked
    assert school.geometry.contains(shapely.Point(CORNER))


def test_stop_edit_resume_is_the_session_in_one(land: Path, stage: Path, tmp_path: Path) -> None:
    edits = [{"edit": "choose", "parcel": CORNER, "candidate": 2}, {"edit": "step"}]
    edited, out = tmp_path / "edited.gpkg", tmp_path / "out.gpkg"
    assert _edit(stage, _list(tmp_path, *edits), "-o", edited).exit_code == 0
    assert _run("resume", edited, "-o", out).exit_code == 0
    session = up.steer(land, min_area=1500)
    session.step()
    session.step()
    session.choose(CORNER, 2)
    session.step()
    session.finish()
    made = read_layout(out).layout
    assert made.mesh.n_faces == len(session.parcels)
    mine = read_layout(session.view.save(tmp_path / "mine.gpkg")).layout
    assert made.digest == mine.digest
    assert [step.algorithm for step in made.history] == ["cogenerate", "steer", "resume"]


def test_a_session_goes_on_from_what_edit_wrote(stage: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.gpkg"
    _edit(stage, _list(tmp_path, {"edit": "lock", "parcel": CORNER}), "-o", out)
    session = Session.of_layout(read_layout(out).layout)
    assert session.level == 2
    assert session.layout.face_locked.sum() == 1
    saved = session.save(tmp_path / "session.json")
    assert _edit(out, saved, "-o", tmp_path / "again.gpkg").exit_code == 0


def test_edits_that_were_undone_are_not_done(
    land: Path, steered: up.GeoSession, tmp_path: Path
) -> None:
    steered.undo()
    saved = steered.save(tmp_path / "session.json")
    assert _edit(land, saved, "-o", tmp_path / "out.gpkg").exit_code == 0
    made = read_layout(tmp_path / "out.gpkg").layout
    assert made.mesh.n_faces == len(steered.parcels)


# ---- what is wrong ---------------------------------------------------------------------------


def test_an_edit_that_cannot_be_done_ends_the_run(stage: Path, tmp_path: Path) -> None:
    edits = _list(tmp_path, {"edit": "step"}, {"edit": "lock", "parcel": 77})
    out = tmp_path / "out.gpkg"
    out.write_bytes(b"before")
    result = _edit(stage, edits, "-o", out, "--overwrite")
    said = _problem(result, 1)
    there = "now there are 8 parcels, such as 5, 6, 7, 8, 9 and 10."
    assert said == f"{edits}, edit 2 (lock): There is no parcel 77; {there}"
    assert out.read_bytes() == b"before"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('[{"edit": "fly"}]', "edit 1: There is no edit 'fly'; there are step, choose"),
        ('[{"edit": "lock"}]', "edit 1: lock needs parcel."),
        ("nonsense", "is no JSON (line 1, column 1"),
        ("{}", "has no list of edits"),
        ('{"version": 2, "edits": []}', "was saved in form 2, and this software reads form 1"),
    ],
)
def test_files_that_are_wrong_exit_with_2(stage: Path, tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "edits.json"
    path.write_text(text)
    result = _edit(stage, path, "-o", tmp_path / "out.gpkg")
    assert why in _problem(result, 2)
    assert result.stdout == ""
    assert not (tmp_path / "out.gpkg").exists()


def test_another_land_exits_with_an_error(
    steered: up.GeoSession, stage: Path, tmp_path: Path
) -> None:
    saved = steered.save(tmp_path / "session.json")
    other = tmp_path / "other.gpkg"
    gpd.GeoDataFrame(geometry=[LAND.buffer(1.0)], crs=CRS).to_file(other)
    for start, why in ((other, "the land is another one, or has"), (stage, "made on land")):
        result = _edit(start, saved, "-o", tmp_path / "out.gpkg")
        assert why in _problem(result, 1)
    assert not (tmp_path / "out.gpkg").exists()


def test_a_list_on_land_needs_parameters(land: Path, tmp_path: Path) -> None:
    result = _edit(land, _list(tmp_path, {"edit": "step"}), "-o", tmp_path / "out.gpkg")
    assert "does not say which parameters" in _problem(result, 1)


def test_a_layout_brings_its_ground_along(stage: Path, land: Path, tmp_path: Path) -> None:
    edits = _list(tmp_path, {"edit": "step"})
    result = _edit(stage, edits, "-o", tmp_path / "out.gpkg", "--obstacles", land)
    assert "is a layout: leave out obstacles" in _problem(result, 2)


def test_several_problems_are_said_at_once(stage: Path, tmp_path: Path) -> None:
    edits = _list(tmp_path, {"edit": "fly"}, {"edit": "lock"})
    result = _edit(stage, edits, "-o", tmp_path / "out.shp", "--snap", -1)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: 4 things are wrong with this call.")


def test_a_layout_of_other_origin_is_refused(land: Path, tmp_path: Path) -> None:
    made = up.cogenerate(land, min_area=1500)
    path = tmp_path / "layout.gpkg"
    up.GeoLayout(made.layout.replace(history=())).save(path)
    result = _edit(path, _list(tmp_path, {"edit": "step"}), "-o", tmp_path / "out.gpkg")
    assert "does not say what it was begun with" in _problem(result, 2)
