"""Features out of files and frames, as geometries and a CRS, with everything that is wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pyogrio
import pyproj
import shapely
from pyogrio.errors import DataLayerError, DataSourceError, FieldError, GeometryError

from urban_processing.errors import BoundaryError, DependencyError
from urban_processing.intake.features import Features
from urban_processing.io.crs import horizontal

if TYPE_CHECKING:
    import geopandas

Source: TypeAlias = "str | PathLike[str] | geopandas.GeoDataFrame | geopandas.GeoSeries | Any"
"""A path, a GeoDataFrame, a GeoSeries, a shapely geometry or a sequence of them."""

PLANE = "urban_processing_plane"
"""Attribute (`DataFrame.attrs`) of frames that were made of geometries on a plane without CRS."""

PARQUET = (".parquet", ".geoparquet", ".pq")
_PREFERRED_LAYER = "boundary"


def read_features(
    source: Source,
    *,
    layer: str | None = None,
    where: str | None = None,
    kind: str = "polygon",
    columns: Sequence[str] | None = (),
) -> Features[pyproj.CRS]:
    """Read the features of a file, or take those of a frame or of shapely geometries.

    Parameters
    ----------
    source
        Anything that GDAL reads (also zipped, or a URL), GeoParquet, or geometries.
    layer
        Layer of a file that has several.
    where
        Filter on attributes, as after WHERE in SQL.
    kind
        Geometry that is looked for where a file has several layers: polygon, line or point.
    columns
        Attributes that are wanted where the source has them; None for all.

    Raises
    ------
    BoundaryError
        If the file or layer is missing, cannot be read, or the choice is ambiguous.
    """
    if isinstance(source, str | PathLike):
        path = fspath(source)
        if path.lower().endswith(PARQUET):
            return _read_parquet(path, layer, where, columns)
        return _read_file(path, layer, where, kind, columns)
    if layer is not None or where is not None:
        raise BoundaryError(
            "layer and where choose features of a file; select the rows of a frame before."
        )
    geometry = getattr(source, "geometry", None)
    if geometry is not None and hasattr(source, "crs"):
        crs = _usable(source.crs)
        return Features(
            np.asarray(geometry, dtype=object),
            crs,
            "The frame",
            bare=crs is None and bool(source.attrs.get(PLANE)),
            columns=_columns_of(source, columns),
        )
    return Features(_as_geometries(source), None, "The geometry", bare=True)


def split_layer_name(source: Source) -> tuple[Source, str | None]:
    """Split a file from the layer named after it, as in ``file.gpkg|layername=roads``."""
    if not isinstance(source, str | PathLike):
        return source, None
    path, _, name = fspath(source).partition("|layername=")
    return path, name or None


def _columns_of(frame: Any, columns: Sequence[str] | None) -> dict[str, npt.NDArray[Any]]:
    """Wanted columns of a GeoDataFrame; a GeoSeries has none. None for values that are missing.

    Where all columns are wanted, those of the index are among them.
    """
    if columns is None:
        frame = frame.reset_index() if any(frame.index.names) else frame
        columns = [name for name in getattr(frame, "columns", ()) if name != frame.geometry.name]
    known = getattr(frame, "columns", ())
    out = {}
    for name in (name for name in columns if name in known):
        values = np.array(frame[name], dtype=object)
        missing = np.asarray(frame[name].isna(), dtype=bool)
        # NaN in a column of numbers is a value of it, and may be a mistake
        values[missing & ~_are_nan(values)] = None
        out[name] = values
    return out


def _of_file(columns: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Columns of a file: None for the empty cells, which were read as NaN."""
    out = dict(columns)
    for name, values in columns.items():
        empty = _are_nan(values)
        if empty.any():
            out[name] = values.astype(object)
            out[name][empty] = None
    return out


def _are_nan(values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    if values.dtype.kind == "f":
        return np.asarray(np.isnan(values))
    return np.array([isinstance(v, float) and math.isnan(v) for v in values], dtype=bool)


def _as_geometries(source: Any) -> npt.NDArray[np.object_]:
    items = [source] if isinstance(source, shapely.Geometry) else source
    try:
        out = np.array(list(items), dtype=object).ravel()
    except TypeError:
        out = np.array([source], dtype=object)
    if not all(g is None or isinstance(g, shapely.Geometry) for g in out):
        raise BoundaryError(
            f"{type(source).__name__} is nothing that can be read: give a path, a GeoDataFrame, a "
            "GeoSeries or shapely geometries."
        )
    return out


def _usable(crs: Any) -> pyproj.CRS | None:
    """Return the horizontal CRS; None for none and for undefined, local ones."""
    if crs is None:
        return None
    crs = horizontal(pyproj.CRS.from_user_input(crs))
    known = crs.is_projected or crs.is_geographic
    return crs if known and not crs.name.lower().startswith("undefined") else None


def must_exist(path: str) -> None:
    """Raise `BoundaryError` if a path is that of a file that is not there."""
    virtual = "://" in path or path.startswith("/vsi")
    if not virtual and not Path(path).exists():
        raise BoundaryError(f"The file {path} does not exist.")
    if Path(path).is_dir() and Path(path).suffix.lower() != ".gdb":
        raise BoundaryError(f"{path} is a folder: give the file in it.")


def _read_parquet(
    path: str, layer: str | None, where: str | None, columns: Sequence[str] | None
) -> Features[pyproj.CRS]:
    import geopandas

    must_exist(path)
    if layer is not None or where is not None:
        raise BoundaryError(
            "layer and where do not apply to GeoParquet: write the features you mean to a "
            "GeoPackage, or select them in a GeoDataFrame."
        )
    try:
        frame = geopandas.read_parquet(path)
    except ImportError as error:
        raise DependencyError("GeoParquet needs the package pyarrow: install it.") from error
    except (ValueError, OSError) as error:
        raise BoundaryError(f"{path} cannot be read as GeoParquet: {_first_line(error)}") from error
    return Features(
        np.asarray(frame.geometry, dtype=object),
        _usable(frame.crs),
        path,
        columns=_of_file(_columns_of(frame, columns)),
    )


def _read_file(
    path: str, layer: str | None, where: str | None, kind: str, columns: Sequence[str] | None
) -> Features[pyproj.CRS]:
    must_exist(path)
    layer = _choose_layer(path, layer, kind)
    try:
        meta, _, wkb, values = pyogrio.raw.read(
            path,
            layer=layer,
            where=where,
            columns=None if columns is None else list(columns),
            force_2d=True,
            read_geometry=True,
        )
    except (DataSourceError, DataLayerError, FieldError, GeometryError, ValueError) as error:
        if where is not None:
            raise BoundaryError(
                f"The filter where={where!r} does not work on layer {layer!r}: "
                f"{_first_line(error)}. Its columns are {_columns(path, layer)}."
            ) from error
        raise BoundaryError(f"{path} cannot be read: {_first_line(error)}") from error
    if wkb is None:
        raise BoundaryError(f"Layer {layer!r} of {path} is a table without geometry.")
    crs = _usable(meta["crs"])
    with np.errstate(invalid="ignore"):  # coordinates that are not finite are told of later
        geometry = np.asarray(shapely.from_wkb(wkb), dtype=object)
    known = dict(zip(meta["fields"].tolist(), values, strict=True))
    return Features(geometry, crs, path, columns=_of_file(known))


def _choose_layer(path: str, layer: str | None, wanted: str) -> str:
    """Return the layer asked for, else the only one that can hold the wanted geometries."""
    try:
        layers = pyogrio.list_layers(path)
    except DataSourceError as error:
        raise BoundaryError(
            f"{path} cannot be read: it is not a vector file that GDAL knows, or it is damaged."
        ) from error
    names = [str(name) for name in layers[:, 0]]
    if layer is not None:
        if layer not in names:
            raise BoundaryError(f"{path} has no layer {layer!r}; its layers are {_listed(names)}.")
        return layer
    spatial = [str(name) for name, kind in layers if kind is not None]
    fitting = [str(name) for name, kind in layers if kind is not None and may_hold(kind, wanted)]
    candidates = fitting or spatial or names
    if wanted == "polygon" and _PREFERRED_LAYER in candidates:
        return _PREFERRED_LAYER
    if len(candidates) != 1:
        how = "with layer (--layer)" if wanted == "polygon" else f"as in {path}|layername=NAME"
        raise BoundaryError(
            f"{path} has several layers: {_listed(candidates)}. Choose one {how}."
            if candidates
            else f"{path} has no layers."
        )
    return candidates[0]


_HOLDING = {
    "polygon": ("Polygon", "Surface", "TIN"),
    "line": ("Line", "Curve"),
    "point": ("Point",),
}


def may_hold(kind: str, wanted: str) -> bool:
    """Whether a layer of a kind may hold the wanted geometries."""
    words = (*_HOLDING[wanted], "Unknown", "Collection")
    fits = any(word in kind for word in words)
    return fits and not (wanted == "line" and "Polygon" in kind)


def _columns(path: str, layer: str) -> str:
    return _listed([str(name) for name in pyogrio.read_info(path, layer=layer)["fields"]])


def _listed(names: list[str]) -> str:
    return ", ".join(names) if names else "(none)"


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".") if lines else "no reason given"
