"""Which lines of OpenStreetMap are streets, where a layer has others, too."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from urban_processing.intake.features import Features
from urban_processing.intake.given import CLASS_COLUMNS, WIDTH_COLUMNS, text
from urban_processing.intake.tag_values import length_of
from urban_processing.site import Issue
from urban_processing.street_rules import OSM_KEYS

C = TypeVar("C")

HIGHWAY = "highway"


def without_other_lines(features: Features[C], issues: list[Issue]) -> Features[C]:
    """Take away the lines that are no streets; adds to `issues` how many these are.

    They are the lines without a ``highway`` in a layer that has a column of that name and one of
    `OSM_KEYS`: railways, power lines, fences. In a layer without these columns, such as a network
    whose lines were joined, an empty ``highway`` says only that the class is not known. Lines with
    a width of the right-of-way or a class of their own stay; and all do where none has a
    ``highway``.

    Parameters
    ----------
    features
        Lines; rows stay what they are, those of no street lose their geometry.
    issues
        What reading has to say.
    """
    if HIGHWAY not in features.columns or not any(key in features.columns for key in OSM_KEYS):
        return features
    rows = np.array(features.present(), dtype=np.int64)
    is_highway = np.array([text(v) != "" for v in features.columns[HIGHWAY]], dtype=bool)
    other = rows[~is_highway[rows] & ~_described(features)[rows]]
    if not len(other) or not is_highway[rows].any():
        return features
    message = (
        f"{len(other)} line(s) of {features.name} have no {HIGHWAY} and count not: in a layer of "
        "all lines of OpenStreetMap these are railways, power lines, fences and the like."
    )
    issues.append(Issue("no_highway", message, value=float(len(other))))
    geometry = features.geometry.copy()
    geometry[other] = None
    return replace(features, geometry=geometry)


def _described(features: Features[Any]) -> npt.NDArray[np.bool_]:
    """(n,) whether a line has a usable width of the right-of-way, or a class besides highway."""
    n = len(features.geometry)
    widths = features.columns.get(WIDTH_COLUMNS[0], np.full(n, None))
    classes = features.column(*CLASS_COLUMNS)
    has_class = [False] * n if classes is None else [text(v) != "" for v in classes]
    has_width = [length_of(v) > 0 for v in widths]
    return np.asarray(np.array(has_width, dtype=bool) | np.array(has_class, dtype=bool))
