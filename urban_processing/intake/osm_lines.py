"""Lines of OpenStreetMap: their tags, and which are streets where a layer has others, too."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from urban_processing.intake.features import Features
from urban_processing.intake.given import CLASS_COLUMNS, WIDTH_COLUMNS, text
from urban_processing.intake.tag_values import length_of
from urban_processing.site import Issue
from urban_processing.street_rules import OSM_KEYS, OWN_TAGS

C = TypeVar("C")

HIGHWAY = "highway"
OTHER_TAGS = "other_tags"
"""Column in which GDAL keeps all tags of a line that have no column of their own."""

_TAG = re.compile(r'"((?:[^"\\]|\\.)*)"=>"((?:[^"\\]|\\.)*)"')
_ESCAPED = re.compile(r"\\(.)")


_OWN_COLUMNS = {OWN_TAGS + name: name for name in (CLASS_COLUMNS[0], WIDTH_COLUMNS[0])}
"""Columns of the tags that are this library's own."""


def with_tags(features: Features[C], keys: Sequence[str]) -> Features[C]:
    """Give those tags columns that GDAL keeps in one, ``other_tags``.

    What a column of that name says already stays.

    Parameters
    ----------
    features
        Lines.
    keys
        Keys of OpenStreetMap that are of use; those of this library's own tags are known.
    """
    if OTHER_TAGS not in features.columns:
        return features
    n, wanted = len(features.geometry), {key: key for key in keys} | _OWN_COLUMNS
    found: dict[str, npt.NDArray[Any]] = {}
    for row, tags in enumerate(features.columns[OTHER_TAGS]):
        for key, value in _TAG.findall(tags) if isinstance(tags, str) else ():
            if key not in wanted:
                continue
            name = wanted[key]
            if name not in found:
                found[name] = np.array(features.columns.get(name, np.full(n, None)), dtype=object)
            if text(found[name][row]) == "":
                found[name][row] = _ESCAPED.sub(r"\1", value)
    return replace(features, columns={**features.columns, **found})


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
