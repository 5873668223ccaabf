"""Layers of GeoPackages by pyogrio."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyogrio
import shapely
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError, FieldError

from urban_processing.layout_file.geopackage import (
    FIXED_DATE,
    GEOMETRY_COLUMN,
    VERSION,
    field_arrays,
)
from urban_processing.schema import GeometryType, Layer
from urban_processing.tables import Table


class Pyogrio:
    """Reads and writes layers with pyogrio; a `LayerLibrary`."""

    def write_layers(self, path: Path, tables: Mapping[Layer, Table], *, crs: str) -> None:
        """Write tables as layers of a new GeoPackage."""
        with _os_errors(), _gdal_options(OGR_CURRENT_DATE=FIXED_DATE):
            for layer, table in tables.items():
                _write_layer(path, layer, table, crs=crs)

    def read_layer(
        self, path: Path, layer: str, columns: Sequence[str]
    ) -> tuple[npt.NDArray[np.object_], dict[str, npt.NDArray[Any]]]:
        """Return geometries and columns of a layer in the order in which they were written."""
        with _os_errors():
            meta, _, wkb, values = pyogrio.raw.read(path, layer=layer, columns=list(columns))
        found = dict(zip(meta["fields"].tolist(), values, strict=True))
        geometry = np.empty(0, dtype=object) if wkb is None else shapely.from_wkb(wkb)
        return np.asarray(geometry, dtype=object), {name: found[name] for name in columns}

    def layer_names(self, path: Path) -> list[str]:
        """Return the names of a file's layers."""
        with _os_errors():
            return [str(name) for name in pyogrio.list_layers(path)[:, 0]]

    def column_names(self, path: Path, layer: str) -> list[str]:
        """Return the names of a layer's columns."""
        with _os_errors():
            return [str(name) for name in pyogrio.read_info(path, layer=layer)["fields"]]


PYOGRIO = Pyogrio()


@contextmanager
def _os_errors() -> Iterator[None]:
    try:
        yield
    except (DataSourceError, DataLayerError, FeatureError, FieldError) as error:
        raise OSError(str(error)) from error


def _write_layer(path: Path, layer: Layer, table: Table, *, crs: str) -> None:
    names, values, masks = field_arrays(layer, table)
    spatial = layer.geometry is not GeometryType.NONE and table.geometry is not None
    options: dict[str, Any] = {"layer_options": {"IDENTIFIER": layer.title}}
    if spatial:
        kind = "Unknown" if layer.geometry is GeometryType.ANY else layer.geometry.value
        several = layer.geometry is not GeometryType.ANY and table.in_pieces
        options |= {
            "geometry_type": f"Multi{kind}" if several else kind,
            "crs": crs or None,
            "promote_to_multi": several,
        }
        options["layer_options"] |= {
            "GEOMETRY_NAME": GEOMETRY_COLUMN,
            "SPATIAL_INDEX": "YES",
        }
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.raw.write(
            path,
            geometry=shapely.to_wkb(table.geometry) if spatial else None,
            field_data=values,
            fields=names,
            field_mask=masks,
            layer=layer.name,
            driver="GPKG",
            encoding="UTF-8",
            dataset_options={"VERSION": VERSION},
            **options,
        )


@contextmanager
def _gdal_options(**options: str) -> Iterator[None]:
    """Set options of GDAL for a moment."""
    before = {name: pyogrio.get_gdal_config_option(name) for name in options}
    pyogrio.set_gdal_config_options(options)
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options(before)
