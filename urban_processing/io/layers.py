"""Single layers out of files and frames, problems collected."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path

import pyogrio
import pyproj
from pyogrio.errors import DataSourceError

from urban_processing.errors import BoundaryError
from urban_processing.intake.features import Features
from urban_processing.io.features import Source, read_features, split_layer_name


def layer_in(source: Source, name: str) -> str | None:
    """Return the name of a layer if a source is a file that has it, else None."""
    if not isinstance(source, str | PathLike) or not Path(source).is_file():
        return None
    try:
        layers = pyogrio.list_layers(fspath(source))[:, 0].tolist()
    except DataSourceError:
        return None  # reading it says what is wrong
    return name if name in layers else None


def read_layer(
    called: str,
    source: Source,
    problems: list[str],
    *,
    usual: str = "",
    layer: str | None = None,
    where: str | None = None,
    kind: str = "polygon",
    columns: Sequence[str] | None = None,
) -> Features[pyproj.CRS] | None:
    """Read a layer; None where that failed, and why is added to `problems`.

    Parameters
    ----------
    called
        What problems begin with.
    source
        A file, also followed by a layer as in ``file.gpkg|layername=plots``, or what
        `read_features` takes.
    problems
        What is wrong.
    usual
        Layer of a file that is read if none is named and there is one of this name.
    layer, where, kind, columns
        As in `read_features`.
    """
    path, named = split_layer_name(source)
    chosen = layer or named or (layer_in(path, usual) if usual else None)
    try:
        return read_features(path, layer=chosen, where=where, kind=kind, columns=columns)
    except BoundaryError as error:
        problems += [f"{called}: {problem}" for problem in error.problems]
        return None
