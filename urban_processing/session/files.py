"""Saved sessions: a small JSON of edits that is replayed on what the session began with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from urban_processing.errors import EditError, OutputError
from urban_processing.layout import Layout
from urban_processing.layout_file.writing import replacing
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.paths import ending_problems, replaced_problems
from urban_processing.session.edits import Edit, make_edit
from urban_processing.site import Frame, Issue, Site
from urban_processing.version import __version__

FORMAT = "urban_processing steering"
"""What the entry `format` of a saved session says."""

VERSION = 1
"""Number of the way in which sessions are saved."""

ENDING = ".json"


@dataclass(frozen=True)
class Start:
    """What a session began with.

    Parameters
    ----------
    kind
        Land or a layout.
    sha256
        Hash of the land as it was given, or of the layout's parcels and streets.
    crs
        CRS of its coordinates.
    parameters
        Parameters of the levels, by name.
    """

    kind: Literal["land", "layout"]
    sha256: str
    crs: str
    parameters: dict[str, Any]

    @property
    def sentence(self) -> str:
        """What there is before the first edit."""
        return "Begun with the land." if self.kind == "land" else "Begun with a layout."

    def as_dict(self) -> dict[str, Any]:
        """Return the values for JSON."""
        return dict(vars(self))


def start_with_land(site: Site, params: CogenerateParams) -> Start:
    """The start of a session with land."""
    sha256 = site.input_sha256
    if len(site.corners):  # which the hash of the land says nothing of
        sha256 = hashlib.sha256(sha256.encode() + site.corners.tobytes()).hexdigest()
    return Start("land", sha256, site.frame.crs, dict(params.as_dict()))


def start_with_layout(layout: Layout, params: CogenerateParams) -> Start:
    """The start of a session with a layout."""
    return Start("layout", layout.digest, layout.frame.crs, dict(params.as_dict()))


@dataclass(frozen=True)
class Saved:
    """A saved session that was read.

    Parameters
    ----------
    path
        The file.
    edits
        What was done.
    after
        For each edit, the number of the one that it followed, counted from 1; 0 is the beginning.
    current
        Number of the edit that was the last one; 0 if none was.
    redo
        Number of the edit that redo led to in the end; `current` if nothing was undone there.
    start
        What the session began with; None where the file does not say.
    result
        Number of parcels at the end; empty where the file does not say.
    software
        Version of the software that saved it.
    """

    path: Path
    edits: tuple[Edit, ...]
    after: tuple[int, ...]
    current: int
    redo: int
    start: Start | None
    result: dict[str, Any]
    software: str

    def params(self) -> CogenerateParams:
        """Parameters of the levels; `EditError` where the file does not say them."""
        if self.start is None:
            raise EditError(
                f"{self.path} does not say which parameters its edits were made with: give a "
                "layout that they are to be done on."
            )
        return CogenerateParams.from_values({**self.start.parameters, "stop_at_level": None})

    def check_start(self, start: Start) -> None:
        """Raise `EditError` unless the edits were made on what is there."""
        if self.start is None:
            return
        if (self.start.sha256, self.start.crs) == (start.sha256, start.crs):
            self._check_parameters(start)
            return
        what = "the land is" if self.start.kind == "land" else "the layout is"
        if self.start.kind != start.kind:
            given = "land" if start.kind == "land" else "a layout"
            why = f"they were made on {_with_article(self.start.kind)}, and this is {given}"
        elif self.start.crs != start.crs:
            why = f"{what} in {start.crs or 'no CRS'} and was in {self.start.crs or 'no CRS'}"
        else:
            why = f"{what} another one, or has changed since"
        raise EditError(f"The edits of {self.path} cannot be done here: {why}.")

    def _check_parameters(self, start: Start) -> None:
        was, now = self.start.parameters if self.start else {}, start.parameters
        other = [name for name in now if name in was and was[name] != now[name]]
        if other:
            values = ", ".join(f"{name} was {was[name]} and is {now[name]}" for name in other)
            raise EditError(f"The edits of {self.path} were made with other parameters: {values}.")

    def check_result(self, layout: Layout) -> None:
        """Raise `EditError` if replaying made something else than what was saved."""
        parcels = self.result.get("parcels")
        if parcels is None or parcels == layout.mesh.n_faces:
            return
        raise EditError(
            f"The edits of {self.path} led to {parcels:,} parcels when they were saved with "
            f"version {self.software}, and to {layout.mesh.n_faces:,} with version {__version__}: "
            "do them again by hand, or use that version."
        )


@dataclass(frozen=True, eq=False)
class Steered:
    """A saved session together with what it began with."""

    start: Site | Layout
    saved: Saved

    @property
    def frame(self) -> Frame:
        """Where it lies."""
        return self.start.frame

    @property
    def issues(self) -> tuple[Issue, ...]:
        """What was repaired in reading the land."""
        return self.start.issues if isinstance(self.start, Site) else ()


def _with_article(kind: str) -> str:
    return "land" if kind == "land" else "a layout"


def save(path: str | PathLike[str], saved: dict[str, Any], *, overwrite: bool) -> Path:
    """Write a session; the file appears whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written there.
    """
    target = Path(path)
    problems = [
        *ending_problems(target, "session", (ENDING,)),
        *replaced_problems(target, overwrite=overwrite),
    ]
    if problems:
        raise OutputError(problems)
    with replacing(target) as temporary:
        temporary.write_text(json.dumps(saved, indent=1, ensure_ascii=False) + "\n", "utf-8")
    return target


def as_json(
    start: Start, edits: Sequence[tuple[Edit, int]], *, current: int, redo: int, layout: Layout
) -> dict[str, Any]:
    """Put a session into the form that is saved.

    Parameters
    ----------
    edits
        What was done, each with the number of the edit that it followed; 0 is the beginning.
    current
        Number of the edit that is the last one now.
    redo
        Number of the edit that redo leads to in the end.
    layout
        The layout as it is now.
    """
    rows = []
    for number, (edit, after) in enumerate(edits, start=1):
        row = edit.as_dict()
        if after != number - 1:
            row["after"] = after
        rows.append(row)
    saved: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "software": __version__,
        "start": start.as_dict(),
        "edits": rows,
        "result": {"parcels": layout.mesh.n_faces},
    }
    if current != len(rows):
        saved["current"] = current
    if redo != current:
        saved["redo"] = redo
    return saved


def read(path: str | PathLike[str]) -> Saved:
    """Read a saved session, or a list of edits that somebody wrote.

    Raises
    ------
    EditError
        With everything that is wrong with the file.
    """
    source = Path(path)
    try:
        content = json.loads(source.read_text("utf-8-sig"))  # some editors write a mark first
    except FileNotFoundError:
        raise EditError(f"The file {source} does not exist.") from None
    except UnicodeDecodeError:
        raise EditError(f"{source} is no text: give a JSON file of edits.") from None
    except (OSError, RecursionError) as error:
        raise EditError(f"{source} cannot be read: {error}") from error
    except json.JSONDecodeError as error:
        raise EditError(
            f"{source} is no JSON (line {error.lineno}, column {error.colno}: {error.msg})."
        ) from error
    if isinstance(content, list):
        content = {"edits": content}
    if not isinstance(content, dict) or not isinstance(content.get("edits"), list):
        raise EditError(f"{source} has no list of edits: give a file that a session saved.")
    _check_version(source, content)
    return _saved(source, content)


def _check_version(source: Path, content: dict[str, Any]) -> None:
    if content.get("format", FORMAT) != FORMAT:
        raise EditError(f"{source} is no session, but {content['format']!r}.")
    version = content.get("version", VERSION)
    if version != VERSION:
        raise EditError(
            f"{source} was saved in form {version}, and this software reads form {VERSION}: use "
            f"the version that saved it ({content.get('software', 'unknown')})."
        )


def _saved(source: Path, content: dict[str, Any]) -> Saved:
    problems: list[str] = []
    edits, after = [], []
    for number, row in enumerate(content["edits"], start=1):
        try:
            edit, follows = _edit(row, number)
            edits.append(edit)
            after.append(follows)
        except EditError as error:
            problems += [f"{source}, edit {number}: {problem}" for problem in error.problems]
    current = content.get("current", len(content["edits"]))
    redo = content.get("redo", current)
    for name, value in {"current": current, "redo": redo}.items():
        if not _is_number(value) or not 0 <= value <= len(content["edits"]):
            problems.append(f"{source}: {name} must be the number of an edit; it is {value!r}.")
            break
    start = content.get("start")
    if start is not None and not _is_start(start):
        problems.append(f"{source}: start does not say what the session began with.")
    result = content.get("result", {})
    if not isinstance(result, dict) or not _is_number(result.get("parcels", 0)):
        problems.append(f"{source}: result does not say how many parcels the edits led to.")
    if problems:
        raise EditError(problems)
    return Saved(
        path=source,
        edits=tuple(edits),
        after=tuple(after),
        current=current,
        redo=redo,
        start=None if start is None else Start(**start),
        result=dict(result),
        software=str(content.get("software", "unknown")),
    )


def _edit(row: Any, number: int) -> tuple[Edit, int]:
    """An edit, and the number of the one that it follows."""
    if not isinstance(row, dict) or not isinstance(row.get("edit"), str):
        raise EditError('must be an object with its name, as in {"edit": "step"}.')
    after = row.get("after", number - 1)
    if not _is_number(after) or not 0 <= after < number:
        raise EditError(f"after must be the number of an edit before it; it is {after!r}.")
    values = {key: value for key, value in row.items() if key not in ("edit", "after")}
    return make_edit(row["edit"], values), after


def _is_number(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_start(start: Any) -> bool:
    return (
        isinstance(start, dict)
        and set(start) == {"kind", "sha256", "crs", "parameters"}
        and start["kind"] in ("land", "layout")
        and isinstance(start["sha256"], str)
        and isinstance(start["crs"], str)
        and isinstance(start["parameters"], dict)
    )
