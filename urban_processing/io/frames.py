"""`GeoLayout`: a layout as GeoDataFrames."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import geopandas as gpd
import numpy as np
import pandas as pd

from urban_processing.io.features import PLANE
from urban_processing.metrics import MeasuredLayout
from urban_processing.schema import PROVENANCE, ColumnType, GeometryType, Layer, layer
from urban_processing.tables import LayerSet, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class GeoLayout(MeasuredLayout):
    """A layout of parcels and streets, its layers as GeoDataFrames in map coordinates.

    Parameters
    ----------
    layout
        The layout on its mesh, as the engine made it.

    Examples
    --------
    >>> import shapely
    >>> import urban_processing as up
    >>> land = shapely.box(0, 0, 300, 200)
    >>> layout = up.cogenerate(land, crs="EPSG:32630", min_area=2000)  # doctest: +SKIP
    >>> layout.parcels.area_m2.min() >= 2000  # doctest: +SKIP
    True
    """

    @property
    def parcels(self) -> gpd.GeoDataFrame:
        """Parcels, indexed by parcel_id."""
        return self.frame("parcels").set_index("parcel_id")

    @property
    def streets(self) -> gpd.GeoDataFrame:
        """Street centrelines between junctions, rim included, indexed by edge_id."""
        return self.frame("streets").set_index("edge_id")

    @property
    def junctions(self) -> gpd.GeoDataFrame:
        """Junctions and street ends, indexed by junction_id."""
        return self.frame("junctions").set_index("junction_id")

    @property
    def boundary(self) -> gpd.GeoDataFrame:
        """Land that was laid out, one row for each part."""
        return self.frame("boundary")

    @property
    def input_boundary(self) -> gpd.GeoDataFrame:
        """Boundary as given, before repair and simplification."""
        return self.frame("input_boundary")

    @property
    def right_of_way(self) -> gpd.GeoDataFrame:
        """Land that streets take, by class; empty where no rights-of-way are laid out."""
        return self.frame("right_of_way")

    @property
    def net_parcels(self) -> gpd.GeoDataFrame:
        """Parcels less right-of-way, indexed by parcel_id; empty where none is laid out."""
        return self.frame("net_parcels").set_index("parcel_id")

    @property
    def issues(self) -> gpd.GeoDataFrame:
        """What could not be done, and what one should know."""
        return self.frame("issues")

    @property
    def metrics(self) -> pd.DataFrame:
        """Metrics of the whole (part empty) and of each part of the land."""
        return self.frame("metrics")

    @property
    def provenance(self) -> pd.DataFrame:
        """Steps that made the layout, with their parameters and seed."""
        return self.frame("provenance")

    @property
    def crs(self) -> Any:
        """CRS of the geometries, None for a plane without CRS."""
        return self.boundary.crs

    def frame(self, name: str) -> gpd.GeoDataFrame | pd.DataFrame:
        """Return a layer of the schema as a frame of its own; empty if the layout has none."""
        return table_frame(layer(name), self.tables.get(name), crs=self.layout.frame.crs)

    def plot(
        self,
        path: str | PathLike[str] | None = None,
        *,
        ax: Axes | None = None,
        colour_by: str | None = None,
        title: str = "",
    ) -> Figure:
        """Draw a map; see `urban_processing.report.map.plot_layout`."""
        from urban_processing.report.map import plot_layout

        return plot_layout(self, path, ax=ax, colour_by=colour_by, title=title)

    def save(
        self,
        path: str | PathLike[str],
        *,
        overwrite: bool = False,
        record_seconds: bool = False,
    ) -> Path:
        """Write a GeoPackage; see `urban_processing.io.files.write_layout`."""
        from urban_processing.io.files import write_layout

        return write_layout(self.layout, path, overwrite=overwrite, record_seconds=record_seconds)

    def export(
        self, folder: str | PathLike[str], *, kind: str = "geojson", overwrite: bool = False
    ) -> Path:
        """Write plain files into a folder; see `urban_processing.io.exports.export_layout`."""
        from urban_processing.io.exports import export_layout

        return export_layout(self.layout, folder, kind=kind, overwrite=overwrite)

    def __repr__(self) -> str:
        tables = self.tables
        crs = self.layout.frame.crs or "no CRS"
        crs = crs if len(crs) < 20 else str(self.crs.name)
        return (
            f"GeoLayout({len(tables['parcels'])} parcels, {self.metric('streets'):.0f} streets, "
            f"{self.metric('junctions'):.0f} junctions, "
            f"{self.metric('street_ends'):.0f} street ends, "
            f"{len(tables['boundary'])} part(s), {self.metric('area_m2') / 1e4:.4g} ha, "
            f"{len(tables['issues'])} issue(s), {crs})"
        )


@dataclass(frozen=True, eq=False)
class GeoLayers:
    """Layers that an algorithm made, as GeoDataFrames in map coordinates, by their names.

    Parameters
    ----------
    made
        The layers as plain tables.
    """

    made: LayerSet

    def __getattr__(self, name: str) -> gpd.GeoDataFrame | pd.DataFrame:
        """Return the layer of that name as a frame of its own."""
        if name.startswith("_") or name not in self.__dir__():
            layers = ", ".join(self.made.names)
            raise AttributeError(f"There is no layer {name!r}; there are {layers}.")
        return self.frame(name)

    def __dir__(self) -> list[str]:
        """Return the names of layers beside those of methods."""
        return [*super().__dir__(), *self.made.names, PROVENANCE.name]

    @property
    def crs(self) -> Any:
        """CRS of the geometries, None for a plane without CRS."""
        return gpd.GeoSeries([], crs=self.made.frame.crs or None).crs

    def frame(self, name: str) -> gpd.GeoDataFrame | pd.DataFrame:
        """Return a layer as a frame of its own."""
        for each, table in self.made.layers(record_seconds=True).items():
            if each.name == name:
                return table_frame(each, table, crs=self.made.frame.crs)
        raise KeyError(f"There is no layer {name}; there are {', '.join(self.made.names)}.")

    def save(
        self,
        path: str | PathLike[str],
        *,
        overwrite: bool = False,
        record_seconds: bool = False,
    ) -> Path:
        """Write a GeoPackage; see `urban_processing.io.files.write_layers`."""
        from urban_processing.io.files import write_layers

        return write_layers(self.made, path, overwrite=overwrite, record_seconds=record_seconds)

    def plot(
        self,
        path: str | PathLike[str] | None = None,
        *,
        ax: Axes | None = None,
        title: str = "",
    ) -> Figure:
        """Draw a map; see `urban_processing.report.layers_map.plot_layers`."""
        from urban_processing.report.layers_map import plot_layers

        return plot_layers(self.made, path, ax=ax, title=title)

    def export(
        self, folder: str | PathLike[str], *, kind: str = "geojson", overwrite: bool = False
    ) -> Path:
        """Write plain files into a folder; see `urban_processing.io.exports.export_layers`."""
        from urban_processing.io.exports import export_layers

        return export_layers(
            self.made.layers(), folder, crs=self.made.frame.crs, kind=kind, overwrite=overwrite
        )

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(t):,} {each.name}" for each, t in self.made.tables.items())
        crs = self.made.frame.crs or "no CRS"
        crs = crs if len(crs) < 20 else str(self.crs.name)
        return f"{type(self).__name__}({self.made.kind}: {counts}, {crs})"


def table_frame(
    declared: Layer, table: Table | None, *, crs: str
) -> gpd.GeoDataFrame | pd.DataFrame:
    """Return a table as a frame: whole numbers that may be missing as Int64.

    One without CRS is marked, so that it can be given on like the bare geometries it comes from.
    """
    columns: dict[str, Any] = {}
    for column in declared.columns:
        values = np.empty(0, dtype=object) if table is None else table[column.name]
        if column.dtype is ColumnType.INTEGER and column.nullable:
            columns[column.name] = pd.array(values, dtype="Int64")
        elif column.dtype is ColumnType.BOOLEAN and np.isnan(values.astype(np.float64)).any():
            columns[column.name] = pd.array(values, dtype="boolean")
        elif column.dtype is ColumnType.TEXT:
            columns[column.name] = pd.Series(values, dtype="str")
        else:
            columns[column.name] = np.asarray(values, dtype=column.dtype.value)
    if declared.geometry is GeometryType.NONE:
        return pd.DataFrame(columns)
    known = None if table is None else table.geometry
    geometry = np.empty(0, dtype=object) if known is None else known
    frame = gpd.GeoDataFrame(columns, geometry=gpd.GeoSeries(geometry, crs=crs or None))
    if not crs:
        frame.attrs[PLANE] = True
    return frame
