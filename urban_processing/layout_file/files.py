"""Layout files: the GeoPackage that holds everything."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from urban_processing.errors import BoundaryError, UrbanError
from urban_processing.layout import Layout
from urban_processing.layout_file.by_hand import check_crs, street_places
from urban_processing.layout_file.geopackage import (
    LAYERS_STATE,
    LAYOUT_STATE,
    LayerLibrary,
    read_state,
    write_geopackage,
)
from urban_processing.layout_file.reading import LayoutFile, read_edited, read_exactly
from urban_processing.layout_file.writing import replacing, writable
from urban_processing.metrics.tables import layout_tables
from urban_processing.provenance import timeless
from urban_processing.rebuild import canonical
from urban_processing.schema import (
    layer,
)
from urban_processing.site import Frame
from urban_processing.tables import Table

FILE_FORMAT = 2
"""Number of the way in which layout files keep what the schema does not say."""


def write_layout(
    layout: Layout,
    path: str | PathLike[str],
    *,
    library: LayerLibrary,
    overwrite: bool = False,
    tables: Mapping[str, Table] | None = None,
) -> Path:
    """Write a layout as a GeoPackage with all its layers, styled for QGIS.

    The file appears whole or not at all. The same layout gives the same bytes.

    Parameters
    ----------
    layout
        The layout, as `as_written` gives it.
    path
        File to write, ending in ``.gpkg``.
    library
        What writes the layers.
    overwrite
        Whether an existing file may be replaced.
    tables
        Tables of the layout, where they are at hand.

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
    known = layout_tables(layout) if tables is None else tables
    with replacing(target) as temporary:
        write_geopackage(
            temporary,
            {layer(name): table for name, table in known.items()},
            crs=layout.frame.crs,
            state=(LAYOUT_STATE, _state(layout)),
            library=library,
        )
    return target


def as_written(layout: Layout, *, record_seconds: bool = False) -> Layout:
    """Return a layout in the form that files hold: numbered canonically, without times.

    With `record_seconds` its steps keep the time they took: then no two runs give the same.
    """
    history = layout.history if record_seconds else timeless(layout.history)
    return canonical(layout.replace(history=history))


def read_layout(
    path: str | PathLike[str], *, library: LayerLibrary, snap: float | None = None
) -> Layout:
    """Read a layout file; the layout is the one that was written.

    Parameters
    ----------
    path
        The file.
    library
        What reads the layers.
    snap
        Where it is given, parcels and streets that were edited and do not fit together any more
        are fitted within this many metres, and the issues say what that changed.

    Raises
    ------
    BoundaryError
        If there is no such file, it is no layout file, or parcels or streets are in another CRS.
    TopologyError
        If its parcels or streets were changed so that they no longer fit together.
    """
    source = Path(path)
    state = _read_state(source)
    check_crs(source)
    x, y = state["origin"]
    file = LayoutFile(source, Frame(state["crs"], (float(x), float(y))), library)
    try:
        return read_exactly(file, state)
    except UrbanError:
        if snap is None:
            raise
    return read_edited(file, state, snap)


def _what_else(path: Path) -> str:
    """What a file of ours holds that is no layout, to be said after what it is not."""
    text = read_state(path, LAYERS_STATE)
    return "" if text is None else f" but one of another kind ({json.loads(text)['kind']})"


def _state(layout: Layout) -> str:
    """Return what the layers do not say about a layout, as JSON."""
    return json.dumps(
        {
            "format": FILE_FORMAT,
            "crs": layout.frame.crs,
            "origin": list(layout.frame.origin),
            "min_area": layout.min_area,
            "corners": layout.mesh.xy[layout.vertex_corner].tolist(),
            "corners_given": layout.corners_given,
            "street_rules": layout.street_rules.as_dict(),
            "entries": layout.mesh.xy[layout.vertex_entry].tolist(),
            "fixed_streets": [
                [s.street_class, None if math.isnan(s.width) else s.width]
                for s in layout.fixed_streets
            ],
            "land_uses": list(layout.land_uses),
            "steered_edges": _steered_edges(layout),
            "street_places": street_places(layout),
        }
    )


def _steered_edges(layout: Layout) -> list[list[float]]:
    """Ends of the edges that a planner decided something of, and what."""
    mesh, steered = layout.mesh, np.flatnonzero(layout.edge_steering)
    ends = mesh.xy[mesh.origin.reshape(-1, 2)[steered]].reshape(-1, 4)
    rows: list[list[float]] = np.column_stack([ends, layout.edge_steering[steered]]).tolist()
    return rows


def _read_state(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise BoundaryError(f"The file {path} does not exist.")
    text = read_state(path, LAYOUT_STATE)
    if text is None:
        raise BoundaryError(
            f"{path} is not a layout file{_what_else(path)}: give a GeoPackage that cogenerate "
            "wrote."
        )
    state: dict[str, Any] = json.loads(text)
    if state["format"] > FILE_FORMAT:
        raise BoundaryError(
            f"{path} was written by a newer version of this software: update to read it."
        )
    return state
