"""Saved sessions: round trips, branches, refusals, lists that somebody wrote."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from session_checks import fingerprint

from urban_processing.algorithms.edit import EDIT
from urban_processing.errors import Cancelled, EditError, OutputError, ParameterError
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.files import read_layout, write_layout
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.progress import CallbackProgress
from urban_processing.session.edits import KINDS
from urban_processing.session.files import read
from urban_processing.session.session import Session
from urban_processing.site import Site

LAND = shapely.box(1000, 2000, 1400, 2240)
PARAMS = CogenerateParams(min_area=1500)


@pytest.fixture(scope="module")
def land() -> Site:
    return read_boundary(LAND, crs="EPSG:32630")


@pytest.fixture
def session(land: Site) -> Session:
    """A session with one edit of most kinds."""
    session = Session.begin(land, PARAMS)
    session.step()
    session.add_street([(1000.0, 2065.0), (1400.0, 2070.0)], street_class="collector", width=14.0)
    session.step()
    session.choose((1010.0, 2010.0), 2)
    session.lock((1390.0, 2230.0), "park")
    session.undo_cut((1010.0, 2010.0))
    session.step()
    return session


@pytest.fixture
def saved(session: Session, tmp_path: Path) -> Path:
    return session.save(tmp_path / "session.json")


def changed(path: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """A saved session with something changed by hand."""
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    return path


def written(folder: Path, edits: object) -> Path:
    """A list of edits that somebody wrote."""
    path = folder / "edits.json"
    path.write_text(json.dumps(edits))
    return path


# round trips


def test_a_saved_session_is_done_again(saved: Path, session: Session, land: Site) -> None:
    again = Session.load(saved, land)
    assert fingerprint(again) == fingerprint(session)
    assert again.edits == session.edits
    assert again.sentence == session.sentence
    assert again.save(saved.with_name("again.json")).read_bytes() == saved.read_bytes()
    again.finish()
    session.finish()
    assert fingerprint(again) == fingerprint(session)


def test_the_same_bytes_of_the_layout_file(saved: Path, session: Session, land: Site) -> None:
    again = Session.load(saved, land)
    one = write_layout(session.layout, saved.with_name("one.gpkg"))
    other = write_layout(again.layout, saved.with_name("other.gpkg"))
    assert one.read_bytes() == other.read_bytes()


def test_the_file_is_small_and_says_what_it_is(saved: Path, session: Session) -> None:
    content = json.loads(saved.read_text())
    assert content["format"] == "urban_processing steering"
    assert content["version"] == 1
    assert content["start"]["kind"] == "land"
    assert content["start"]["crs"] == "EPSG:32630"
    assert content["start"]["parameters"]["min_area"] == 1500
    assert [edit["edit"] for edit in content["edits"]] == [edit.name for edit in session.edits]
    assert content["edits"][4] == {"edit": "lock", "parcel": [1390.0, 2230.0]}
    assert content["result"]["parcels"] == len(session.parcels)
    assert saved.stat().st_size < 4000


def test_all_branches_are_kept(session: Session, land: Site, tmp_path: Path) -> None:
    before = fingerprint(session)
    session.undo()
    session.undo()
    session.lock((1010.0, 2010.0), "school")
    other = fingerprint(session)
    again = Session.load(session.save(tmp_path / "branches.json"), land)
    assert again.branches() == session.branches()
    assert fingerprint(again) == other
    again.go_to(again.branches()[0].number)
    assert fingerprint(again) == before


def test_what_was_undone_when_it_was_saved_can_be_redone(
    session: Session, land: Site, tmp_path: Path
) -> None:
    end = fingerprint(session)
    for _ in range(3):
        session.undo()
    middle = fingerprint(session)
    path = session.save(tmp_path / "middle.json")
    assert json.loads(path.read_text())["current"] == 4
    again = Session.load(path, land)
    assert fingerprint(again) == middle
    assert again.can_undo
    assert again.can_redo
    for _ in range(3):
        again.redo()
    assert not again.can_redo
    assert fingerprint(again) == end


def test_redo_leads_where_it_led(session: Session, land: Site, tmp_path: Path) -> None:
    session.undo()
    fork = fingerprint(session)
    session.redo()
    first = session.branches()[0].number
    end = fingerprint(session)
    session.undo()
    session.lock((1010.0, 2010.0), "school")
    session.go_to(first)
    session.undo()
    path = session.save(tmp_path / "fork.json")
    assert json.loads(path.read_text())["redo"] == first
    again = Session.load(path, land)
    assert fingerprint(again) == fork
    assert again.branches() == session.branches()
    again.redo()
    assert fingerprint(again) == end


def test_nothing_done_is_saved_too(land: Site, tmp_path: Path) -> None:
    session = Session.begin(land, PARAMS)
    again = Session.load(session.save(tmp_path / "nothing.json"), land)
    assert fingerprint(again) == fingerprint(session)
    assert not again.can_undo


def test_a_session_on_a_layout_file(land: Site, tmp_path: Path) -> None:
    stage = cogenerate(land, CogenerateParams(min_area=1500, stop_at_level=2))
    path = write_layout(stage, tmp_path / "stage.gpkg")
    session = Session.of_layout(stage)
    session.choose(session.parcels[0], 2)
    saved = session.save(tmp_path / "edits.json")
    again = Session.load(saved, read_layout(path).layout)
    assert again.layout.digest == session.layout.digest
    assert json.loads(saved.read_text())["start"]["kind"] == "layout"


def test_what_a_session_made_is_a_start_in_memory_and_as_a_file(
    session: Session, tmp_path: Path
) -> None:
    on = Session.of_layout(session.layout)
    on.step()
    saved = on.save(tmp_path / "on.json")
    path = write_layout(session.layout, tmp_path / "stage.gpkg")
    again = Session.load(saved, read_layout(path).layout)
    assert again.layout.digest == on.layout.digest
    assert again.parcels == on.parcels


def test_replaying_goes_on_from_what_was_done(saved: Path, session: Session, land: Site) -> None:
    other = Session.begin(land, PARAMS)
    other.lock(1, "reserve")
    other.unlock(1)
    other.replay(read(saved))
    assert other.layout.digest == session.layout.digest
    assert len(other.edits) == len(session.edits) + 2


# writing


def test_a_file_that_is_there_is_not_replaced(saved: Path, session: Session) -> None:
    before = saved.read_bytes()
    session.undo()
    with pytest.raises(OutputError, match="exists already"):
        session.save(saved)
    assert saved.read_bytes() == before
    session.save(saved, overwrite=True)
    assert saved.read_bytes() != before


def test_a_file_of_another_kind_or_in_no_folder_is_refused(
    session: Session, tmp_path: Path
) -> None:
    with pytest.raises(OutputError, match=r"\.json"):
        session.save(tmp_path / "session.gpkg")
    with pytest.raises(OutputError, match="folder"):
        session.save(tmp_path / "none" / "session.json")
    assert not list(tmp_path.iterdir())


def test_a_file_appears_whole_or_not_at_all(
    session: Session, saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = saved.read_bytes()

    def full(path: Path, text: str, *_rest: object) -> int:
        path.write_bytes(text.encode()[:100])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        session.undo()
        with pytest.raises(OutputError, match="No space left"):
            session.save(saved, overwrite=True)
        with pytest.raises(OutputError, match="No space left"):
            session.save(saved.with_name("other.json"))
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]
    assert saved.read_bytes() == before


# refusals


@pytest.mark.parametrize(
    ("other", "crs", "why"),
    [
        (shapely.box(1000, 2000, 1400, 2241), "EPSG:32630", "the land is another one, or has"),
        (shapely.box(0, 0, 400, 240), "EPSG:32630", "the land is another one, or has changed"),
        (LAND, "EPSG:32631", "the land is in EPSG:32631 and was in EPSG:32630"),
    ],
)
def test_another_land_is_refused(saved: Path, other: Any, crs: str, why: str) -> None:
    with pytest.raises(
        EditError, match=rf"The edits of .*session\.json cannot be done here: {why}"
    ):
        Session.load(saved, read_boundary(other, crs=crs))


def test_the_same_land_in_another_crs_is_another_start(tmp_path: Path) -> None:
    box = shapely.box(9.52, 47.15, 9.525, 47.153)
    one, other = (read_boundary(box, crs=crs) for crs in ("EPSG:4326", "EPSG:4258"))
    session = Session.begin(one, PARAMS)
    session.step()
    with pytest.raises(EditError, match=r"the land is another one, or has changed since"):
        Session.load(session.save(tmp_path / "session.json"), other)


def test_other_corners_are_another_land(tmp_path: Path) -> None:
    corners = np.array([(1000.0, 2000), (1400, 2000), (1400, 2240), (1000, 2240)])
    one = read_boundary(LAND, crs="EPSG:32630", corners=corners)
    session = Session.begin(one, PARAMS)
    path = session.save(tmp_path / "session.json")
    assert Session.load(path, one).layout.digest == session.layout.digest
    with pytest.raises(EditError, match="the land is another one"):
        Session.load(path, read_boundary(LAND, crs="EPSG:32630", corners=corners[:3]))


def test_a_layout_in_place_of_land_and_the_other_way_round(
    saved: Path, session: Session, land: Site, tmp_path: Path
) -> None:
    with pytest.raises(EditError, match="they were made on land, and this is a layout"):
        Session.load(saved, session.layout)
    on = Session.of_layout(session.layout)
    on.step()
    path = on.save(tmp_path / "on.json")
    with pytest.raises(EditError, match="they were made on a layout, and this is land"):
        Session.load(path, land)
    with pytest.raises(EditError, match="the layout is another one, or has changed since"):
        Session.load(path, on.layout)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("", r"is no JSON \(line 1, column 1"),
        ('[{"edit": "step"},\n nonsense]', r"is no JSON \(line 2, column 2"),
        ("{}", "has no list of edits"),
        ("3", "has no list of edits"),
        ("null", "has no list of edits"),
        ('{"edits": {"edit": "step"}}', "has no list of edits"),
        ('{"format": "geojson", "edits": []}', "is no session, but 'geojson'"),
        (
            '{"version": 9, "software": "7.1", "edits": []}',
            r"was saved in form 9, and this software reads form 1: use the version .* \(7\.1\)",
        ),
        ('{"edits": [], "current": 1}', "current must be the number of an edit; it is 1"),
        ('{"edits": [], "current": true}', "current must be the number of an edit; it is True"),
        ('{"edits": [], "redo": -1}', "redo must be the number of an edit; it is -1"),
        ('{"edits": [], "start": {"kind": "sea"}}', "start does not say what"),
        ('{"edits": [], "start": 3}', "start does not say what"),
        ('{"edits": [], "result": 3}', "result does not say how many parcels"),
        ('{"edits": [], "result": {"parcels": "many"}}', "result does not say how many"),
    ],
)
def test_files_that_are_no_sessions(land: Site, tmp_path: Path, content: str, why: str) -> None:
    path = tmp_path / "edits.json"
    path.write_text(content)
    with pytest.raises(EditError, match=why) as error:
        Session.load(path, land)
    assert "edits.json" in str(error.value)


def test_files_that_cannot_be_read(land: Site, tmp_path: Path) -> None:
    with pytest.raises(EditError, match=r"none\.json does not exist"):
        Session.load(tmp_path / "none.json", land)
    with pytest.raises(EditError, match="cannot be read"):
        Session.load(tmp_path, land)
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00[]")
    with pytest.raises(EditError, match="is no text: give a JSON file"):
        Session.load(tmp_path / "bytes.json", land)


def test_a_mark_at_the_beginning_of_a_file_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "marked.json"
    path.write_text('[{"edit": "step"}]', encoding="utf-8-sig")
    assert [edit.name for edit in read(path).edits] == ["step"]


@pytest.mark.parametrize(
    ("edit", "problems"),
    [
        ("step", ['must be an object with its name, as in {"edit": "step"}.']),
        ({"name": "step"}, ['must be an object with its name, as in {"edit": "step"}.']),
        ({"edit": "fly"}, ["There is no edit 'fly'; there are step, choose, cut"]),
        ({"edit": "step", "level": 2}, ["step knows no level; it takes nothing."]),
        ({"edit": "step", "after": 1}, ["after must be the number of an edit before it; it is 1."]),
        ({"edit": "step", "after": "0"}, ["after must be the number of an edit before it"]),
        ({"edit": "choose"}, ["choose needs parcel.", "choose needs candidate."]),
        (
            {"edit": "choose", "parcel": "1", "candidate": 1.5},
            ["choose: parcel must be the number of a parcel or a place", "must be a whole number"],
        ),
        ({"edit": "choose", "parcel": True, "candidate": 1}, ["choose: parcel must be the number"]),
        ({"edit": "choose", "parcel": [1], "candidate": 1}, ["parcel must be two coordinates"]),
        ({"edit": "cut", "parcel": 1}, ["cut needs line."]),
        ({"edit": "cut", "parcel": 1, "line": [[0, 0]]}, ["line must be a line of at least two"]),
        ({"edit": "cut", "parcel": 1, "line": 5}, ["line must be coordinates of the map"]),
        (
            {"edit": "cut", "parcel": 1, "line": [[0, 0], [10**400, 1]]},
            ["must be coordinates"],
        ),
        (
            {"edit": "cut", "parcel": 1, "line": [[0, 0], [1, 1]], "snap": -1},
            ["snap must be a num"],
        ),
        (
            {"edit": "cut", "parcel": 1, "line": [[0, 0], [1, 1]], "snap": 10**400},
            ["cut: snap must be a number of metres"],
        ),
        ({"edit": "undo_cut"}, ["undo_cut needs parcel."]),
        ({"edit": "lock", "parcel": 1, "land_use": 3}, ["lock: land_use must be a text; it is 3."]),
        ({"edit": "lock", "parcel": None}, ["lock: parcel must be the number of a parcel"]),
        ({"edit": "unlock", "parcel": {}}, ["unlock: parcel must be two coordinates"]),
        ({"edit": "merge", "parcels": 3}, ["merge: parcels must be a list of parcels; it is 3."]),
        ({"edit": "merge", "parcels": [1, "2"]}, ["merge: parcels must be the number of a parcel"]),
        ({"edit": "merge", "parcels": [1, 2], "land_use": " "}, ["land_use must name a use"]),
        ({"edit": "add_street"}, ["add_street needs line."]),
        (
            {"edit": "add_street", "line": [[0, 0], [1, 1]], "follow": 1, "width": "5"},
            ["follow must be true or false; it is 1.", "width must be a number of metres"],
        ),
        ({"edit": "remove_street", "place": 5}, ["remove_street: place must be"]),
        ({"edit": "adopt", "parcels": []}, ["adopt needs streets."]),
        (
            {"edit": "adopt", "parcels": [[[[0, 0], [1, 1]]]], "streets": [3]},
            [
                "adopt: parcels must be polygons",
                "adopt: streets must be coordinates of the map",
            ],
        ),
        ({"edit": "finish", "now": True}, ["finish knows no now; it takes nothing."]),
    ],
)
def test_edits_that_are_wrong(tmp_path: Path, edit: object, problems: list[str]) -> None:
    path = written(tmp_path, [edit])
    with pytest.raises(EditError) as error:
        read(path)
    assert len(error.value.problems) == len(problems)
    for said, problem in zip(error.value.problems, problems, strict=True):
        assert said.startswith(f"{path}, edit 1: ")
        assert problem in said


def test_all_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    path = written(tmp_path, [{"edit": "fly"}, {"edit": "step"}, {"edit": "lock"}, 3])
    with pytest.raises(EditError) as error:
        read(path)
    assert [said.split(": ")[0].removeprefix(f"{path}, ") for said in error.value.problems] == [
        "edit 1",
        "edit 3",
        "edit 4",
    ]


def test_an_edit_that_cannot_be_done_says_which(land: Site, tmp_path: Path) -> None:
    path = written(tmp_path, [{"edit": "step"}, {"edit": "lock", "parcel": 1}])
    session = Session.begin(land, PARAMS)
    before = fingerprint(session)
    with pytest.raises(EditError, match=r"edits\.json, edit 2 \(lock\): Parcel 1 is no more"):
        session.replay(read(path))
    assert fingerprint(session) == before
    assert not session.can_undo
    assert not session.can_redo
    assert len(session.branches()) == 1


def test_a_replay_that_is_stopped_changes_nothing(saved: Path, land: Site) -> None:
    session = Session.begin(land, PARAMS)
    before = fingerprint(session)

    def stop(fraction: float, _message: str) -> None:
        if fraction > 0.3:
            raise Cancelled

    with pytest.raises(Cancelled):
        session.replay(read(saved), CallbackProgress(stop))
    assert fingerprint(session) == before
    assert not session.can_undo


def test_edits_that_lead_to_another_layout_are_refused(saved: Path, land: Site) -> None:
    count = json.loads(saved.read_text())["result"]["parcels"]
    path = changed(
        saved,
        lambda content: (
            content["result"].update(parcels=count + 1) or content.update(software="0.1")
        ),
    )
    with pytest.raises(
        EditError,
        match=rf"led to {count + 1} parcels when .* version 0\.1, and to {count} with version",
    ):
        Session.load(path, land)


def test_parameters_that_there_are_not(saved: Path, land: Site) -> None:
    path = changed(saved, lambda content: content["start"]["parameters"].update(colour="red"))
    with pytest.raises(ParameterError, match="colour"):
        Session.load(path, land)


# lists that somebody wrote


def test_a_list_of_edits_with_places(land: Site, tmp_path: Path) -> None:
    path = written(
        tmp_path,
        [
            {"edit": "step"},
            {"edit": "step"},
            {"edit": "lock", "parcel": [1010, 2010], "land_use": "school"},
            {"edit": "choose", "parcel": [1390, 2230], "candidate": 2},
            {"edit": "finish"},
        ],
    )
    stage = cogenerate(land, CogenerateParams(min_area=1500, stop_at_level=0))
    session = Session.load(path, stage)
    assert session.is_complete
    layout = session.layout
    [school] = np.flatnonzero(layout.face_locked).tolist()
    assert layout.land_uses[layout.face_use[school]] == "school"
    same = Session.begin(land, PARAMS)
    same.replay(read(path))
    assert same.layout.digest == layout.digest


def test_a_list_of_edits_on_land_needs_parameters(land: Site, tmp_path: Path) -> None:
    path = written(tmp_path, [{"edit": "step"}])
    with pytest.raises(EditError, match=r"edits\.json does not say which parameters"):
        Session.load(path, land)


def test_branches_can_be_written_by_hand(land: Site, tmp_path: Path) -> None:
    edits = [
        {"edit": "step"},
        {"edit": "lock", "parcel": 2},
        {"edit": "lock", "parcel": 3, "after": 1},
    ]
    session = Session.begin(land, PARAMS)
    session.replay(read(written(tmp_path, {"edits": edits, "current": 2})))
    assert session.layout.face_locked.tolist() == [True, False]
    assert [branch.edits for branch in session.branches()] == [2, 2]


def test_the_description_of_edit_names_all_edits_and_what_they_take() -> None:
    said = EDIT.description[EDIT.description.index("Edits, and what they take") :]
    by_name = dict(part.strip().rstrip(".").partition(":")[::2] for part in said.split(";")[1:])
    assert set(by_name) | {"step"} == set(KINDS)
    for name, takes in by_name.items():
        fields = [field.name for field in dataclasses.fields(KINDS[name])]
        assert [word for word in fields if word in takes] == fields, name
