"""Fabrics out of files, frames and what the algorithms made."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeAlias

import pyogrio
import shapely
from pyogrio.errors import DataSourceError

from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import Fabric
from urban_processing.intake.fabrics import PARCEL_COLUMNS, build_fabric
from urban_processing.intake.street_lines import STREET_COLUMNS
from urban_processing.io.crs import PYPROJ, asked_crs
from urban_processing.io.features import (
    PARQUET,
    Source,
    may_hold,
    must_exist,
    read_features,
    split_layer_name,
)
from urban_processing.io.files import read_layout
from urban_processing.io.frames import GeoLayers
from urban_processing.io.layers import read_layer
from urban_processing.io.measured import GeoFabric
from urban_processing.layout import Layout
from urban_processing.layout_file.files import as_written
from urban_processing.layout_file.geopackage import LAYERS_STATE, LAYOUT_STATE, read_state
from urban_processing.metrics import MeasuredLayout
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.params.measure import MeasureParams
from urban_processing.schema import BOUNDARY, PARCELS, STREETS

Measurable: TypeAlias = "Source | MeasuredLayout | Layout | GeoLayers | Fabric"
"""What can be measured as it is; see `read_fabric`."""


def read_fabric(
    source: Measurable | None = None,
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    land: Source | None = None,
    crs: object = None,
    params: MeasureParams | None = None,
) -> Fabric:
    """Read what is to be measured: a layout, or layers of parcels and streets of any program.

    Parameters
    ----------
    source
        A layout or its file; a file with a layer of parcels and one of streets (those of these
        names, else the only ones with polygons and with lines); a frame of polygons or of lines;
        what `subdivide` made, or its file, in which there are no streets; what was measured
        before.
    parcels, streets, land
        Polygons, lines and polygons instead of those of `source`, or besides: files, also
        followed by a layer as in ``file.gpkg|layername=plots``, GeoDataFrames, GeoSeries or
        shapely geometries.
    crs
        Projected CRS in metres to work in; the CRS of what has none.
    params
        Widths and tolerances.

    Returns
    -------
    Fabric
        Called as its file is, without the ending; without a name if it comes from no file.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    """
    given = {"parcels": parcels, "streets": streets, "land": land}
    ready = _ready(source)
    if ready is not None:
        besides = [name for name, value in given.items() if value is not None]
        if besides or crs is not None:
            named = ", ".join([*besides, *(["crs"] if crs is not None else [])])
            raise BoundaryError(f"A layout is ready as it is: leave out {named}.")
        return ready
    first = next((s for s in (source, parcels, streets) if s is not None), None)
    if source is not None:
        given = {**_layers_of(source, given), **{k: v for k, v in given.items() if v is not None}}
    problems: list[str] = []
    asked = asked_crs(crs, problems)
    read = {
        name: read_layer(
            name.capitalize(), layers, problems, usual=usual, kind=kind, columns=columns
        )
        for name, kind, usual, columns in (
            ("parcels", "polygon", PARCELS.name, PARCEL_COLUMNS),
            ("streets", "line", STREETS.name, STREET_COLUMNS),
            ("land", "polygon", BOUNDARY.name, ()),
        )
        if (layers := given.get(name)) is not None
    }
    if problems:
        raise BoundaryError(problems)
    fabric = build_fabric(
        read.get("parcels"),
        read.get("streets"),
        read.get("land"),
        library=PYPROJ,
        asked=asked,
        params=params,
    )
    return replace(fabric, name=source_name(first))


def source_name(source: Any) -> str:
    """Return what a fabric is called that is read from a source; empty for a nameless one.

    >>> source_name("towns/mauren.gpkg|layername=plots"), source_name([])
    ('mauren', '')
    """
    if isinstance(source, GeoFabric):
        return source.measures.fabric.name
    if isinstance(source, Fabric):
        return source.name
    path, _ = split_layer_name(source)
    return Path(fspath(path)).stem if isinstance(path, str | PathLike) else ""


def is_layout_file(source: str | PathLike[str]) -> bool:
    """Return whether a file is one of a layout."""
    return _state(source, LAYOUT_STATE) is not None


def is_ready(source: Any) -> bool:
    """Return whether a source is a layout or a fabric, to which no layers can be added."""
    if isinstance(source, str | PathLike):
        return is_layout_file(source)
    return isinstance(source, Fabric | GeoFabric | MeasuredLayout | Layout)


def _ready(source: Any) -> Fabric | None:
    """The fabric that a source is already; None for layers."""
    if not is_ready(source):
        return None
    if isinstance(source, Fabric):
        return source
    if isinstance(source, GeoFabric):
        return source.measures.fabric
    if isinstance(source, Layout):
        layout = as_written(source)  # what is measured is the same as in its file
    elif isinstance(source, MeasuredLayout):
        layout = as_written(source.layout)
    else:
        layout = read_layout(fspath(source)).layout
    return replace(LayoutMeasures(layout).of_fabric.fabric, name=source_name(source))


def _state(source: str | PathLike[str], standard: str) -> str | None:
    path = Path(fspath(source))
    is_ours = path.suffix.lower() == ".gpkg" and path.is_file()
    return read_state(path, standard) if is_ours else None


def _layers_of(source: Any, given: dict[str, Source | None]) -> dict[str, Source | None]:
    """Parcels, streets and land of a source as sources of their own."""
    if isinstance(source, GeoLayers):
        return _of_names(source.made.names, source.frame, repr(source), given)
    if isinstance(source, str | PathLike):
        path, layer = split_layer_name(source)
        if layer is not None:
            raise BoundaryError(
                f"{fspath(source)} is one layer: give it as parcels (--parcel-layer) or as "
                "streets (--street-layer)."
            )
        return _of_file(fspath(path), given)
    features = read_features(source)
    kinds = set(shapely.get_dimensions(features.geometry[features.present()]).tolist())
    if kinds == {1}:
        return {"streets": source}
    return {"parcels": source}


def _of_names(
    names: Sequence[str], get: Any, called: str, given: dict[str, Source | None]
) -> dict[str, Source | None]:
    """Layers of ours by their names."""
    wanted = {"parcels": PARCELS.name, "streets": STREETS.name, "land": BOUNDARY.name}
    found = {name: get(layer) for name, layer in wanted.items() if layer in names}
    if not (found.keys() & {"parcels", "streets"}) and _nothing(given):
        raise BoundaryError(
            f"There are neither parcels nor streets in {called}, but {', '.join(names)}: give the "
            "streets that they were made of."
        )
    return found


def _of_file(path: str, given: dict[str, Source | None]) -> dict[str, Source | None]:
    must_exist(path)
    if path.lower().endswith(OSM):
        raise BoundaryError(
            f"{path} is an extract of OpenStreetMap: compare a layout with it (osm_file, "
            "--osm-file), or give its streets as a layer."
        )
    text = _state(path, LAYERS_STATE)
    if text is not None:
        kind = json.loads(text)["kind"]
        names = [str(name) for name, _ in pyogrio.list_layers(path)]
        called = f"{path}, which holds {kind}"
        return _of_names(names, lambda layer: f"{path}|layername={layer}", called, given)
    if path.lower().endswith(PARQUET):
        return _of_one_layer(path, given)
    try:
        layers = [(str(name), kind) for name, kind in pyogrio.list_layers(path)]
    except DataSourceError as error:
        raise BoundaryError(
            f"{path} cannot be read: it is no layout file, and no other file with layers that GDAL "
            "knows, or it is damaged."
        ) from error
    return _of_kinds(path, layers, given)


def _of_kinds(
    path: str, layers: Sequence[tuple[str, str | None]], given: dict[str, Source | None]
) -> dict[str, Source | None]:
    """Layers of a file by their names, else the only ones with polygons and with lines."""
    found: dict[str, Source | None] = {}
    problems = []
    for name, layer, geometry in (
        ("parcels", PARCELS.name, "polygon"),
        ("streets", STREETS.name, "line"),
    ):
        if given[name] is not None:
            continue
        fitting = [n for n, kind in layers if kind is not None and may_hold(kind, geometry)]
        chosen = [layer] if layer in fitting else fitting
        if len(chosen) > 1:
            problems.append(
                f"{path} has several layers of {geometry}s: {', '.join(chosen)}. Give parcels and "
                f"streets one by one: {name} (--{_FLAGS[name]}) as {path}|layername=NAME."
            )
        elif chosen:
            found[name] = f"{path}|layername={chosen[0]}"
    if not problems and not found and _nothing(given):
        problems.append(
            f"{path} has neither polygons nor lines; its layers are "
            f"{', '.join(name for name, _ in layers) or '(none)'}."
        )
    if problems:
        raise BoundaryError(problems)
    return found


_FLAGS = {"parcels": "parcel-layer", "streets": "street-layer"}
"""What layers are called on the command line."""

OSM = (".osm", ".osm.bz2", ".osm.gz", ".osm.pbf", ".pbf")
"""Endings of extracts of OpenStreetMap."""


def _nothing(given: dict[str, Source | None]) -> bool:
    return given["parcels"] is None and given["streets"] is None


def _of_one_layer(path: str, given: dict[str, Source | None]) -> dict[str, Source | None]:
    """A file of a single layer: the parcels, unless these are given."""
    return {"streets": path} if given["parcels"] is not None else {"parcels": path}
