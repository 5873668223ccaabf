"""GeoPackages that appear whole or not at all."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

from urban_processing.errors import OutputError
from urban_processing.layout_file.geopackage import LAYERS_STATE, LayerLibrary, write_geopackage
from urban_processing.paths import geopackage_problems, replaced_problems
from urban_processing.tables import LayerSet

FILE_FORMAT = 1
"""Number of the way in which files of layers keep what the schema does not say."""


def check_output(path: str | PathLike[str], *, overwrite: bool = False) -> list[str]:
    """Return one sentence for each reason why a GeoPackage cannot be written.

    Meant to be asked before a long run.
    """
    target = Path(path)
    return [*geopackage_problems(target), *replaced_problems(target, overwrite=overwrite)]


def write_layer_set(
    made: LayerSet,
    path: str | PathLike[str],
    *,
    library: LayerLibrary,
    overwrite: bool = False,
    record_seconds: bool = False,
) -> Path:
    """Write layers as a GeoPackage, styled for QGIS; the same layers give the same bytes.

    Parameters
    ----------
    made
        The layers.
    path
        File to write, ending in ``.gpkg``.
    library
        What writes the layers.
    overwrite
        Whether an existing file may be replaced.
    record_seconds
        Whether to record how long the steps took: then no two files are the same.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        If the file cannot be written there.
    """
    target = writable(path, overwrite=overwrite)
    layers = made.layers(record_seconds=record_seconds)
    with replacing(target) as temporary:
        write_geopackage(
            temporary,
            layers,
            crs=made.frame.crs,
            library=library,
            state=(LAYERS_STATE, _state(made)),
        )
    return target


def writable(path: str | PathLike[str], *, overwrite: bool) -> Path:
    """Return the path of a GeoPackage that can be written; raise `OutputError` if it cannot."""
    target = Path(path)
    problems = check_output(target, overwrite=overwrite)
    if problems:
        raise OutputError(problems)
    return target


def _state(made: LayerSet) -> str:
    """Return what the layers do not say, as JSON."""
    frame = made.frame
    return json.dumps(
        {"format": FILE_FORMAT, "kind": made.kind, "crs": frame.crs, "origin": list(frame.origin)}
    )


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Give a temporary file beside `target` that takes its place if all goes well."""
    try:
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.stem}-") as folder:
            temporary = Path(folder) / target.name
            yield temporary
            temporary.replace(target)
    except OSError as error:
        raise OutputError(f"{target} cannot be written: {error}") from error
