"""What goes between the thread that works and the window; read without numpy and shapely."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from qgis.core import QgsFeature

Place = tuple[float, float]
"""Coordinates in the CRS of the session."""

StreetKey = tuple[bytes, str, float]
"""Line, class and width of a street: what there is to see of it."""


@dataclass(frozen=True)
class Start:
    """What a session begins with: a layer of land, or a layout file.

    Parameters
    ----------
    layers
        What stands for the inputs of co-generation in the project, by parameter of QGIS.
    values
        Parameters of co-generation by name.
    layout_file
        The layout to go on from; empty where land is given.
    name
        What the session is called.
    """

    layers: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    layout_file: str = ""
    name: str = ""


@dataclass(frozen=True)
class Difference:
    """Features that go and come where the layers are to show another state.

    Parameters
    ----------
    parcels_gone, streets_gone
        Keys of features that go; all features go where `whole` is set.
    parcels, streets
        Features that come, by key: the number of a parcel, the line of a street.
    whole
        Whether the layers are filled anew.
    """

    parcels_gone: tuple[int, ...]
    parcels: Mapping[int, QgsFeature]
    streets_gone: tuple[StreetKey, ...]
    streets: Mapping[StreetKey, QgsFeature]
    whole: bool = False


@dataclass(frozen=True)
class BranchName:
    """A branch of the session: where a series of edits ended that was gone back from."""

    number: int
    sentence: str
    current: bool


@dataclass(frozen=True)
class View:
    """What there is to see of a session after an edit."""

    sentence: str
    level: int
    finished: bool
    complete: bool
    can_undo: bool
    can_redo: bool
    figures: Mapping[str, float]
    branches: tuple[BranchName, ...]
    difference: Difference
    crs: str
    parcels: int


@dataclass(frozen=True)
class Option:
    """A candidate cut as the map shows it; `line` is WKB in the CRS of the session."""

    rank: int
    score: float
    line: bytes
    areas: tuple[float, float]
    reason: str


@dataclass(frozen=True)
class Hovered:
    """The parcel under the cursor, its outline (WKB), and its candidates if they were asked for.

    `reason` says why there are none.
    """

    parcel: int
    outline: bytes
    options: tuple[Option, ...] = ()
    reason: str = ""
