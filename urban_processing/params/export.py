"""Formats of plain files, and the parameters of `export`."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Param, Params
from urban_processing.params.optimize import Snap


class ExportKind(enum.StrEnum):
    """Format of plain files."""

    GEOJSON = "geojson"
    """A file of each layer in WGS 84 (RFC 7946)."""
    PARQUET = "parquet"
    """A file of each layer in the CRS of the layers, as GeoParquet."""
    OSM = "osm"
    """Streets and parcels of a layout as OpenStreetMap's XML, in WGS 84."""
    SUMO = "sumo"
    """Streets of a layout as nodes and edges for SUMO's netconvert."""

    @property
    def of_layouts(self) -> bool:
        """Whether it is one of networks of streets, which layouts alone have."""
        return self in (ExportKind.OSM, ExportKind.SUMO)


@dataclass(frozen=True, kw_only=True)
class ExportParams(Params):
    """Parameters of `export`."""

    format: Annotated[
        ExportKind,
        Param(
            label="Format",
            help="Format of the files: one of each layer as GeoJSON (in WGS 84) or GeoParquet; of "
            "a layout also OpenStreetMap's XML, or nodes and edges for SUMO.",
            labels={
                "geojson": "GeoJSON",
                "parquet": "GeoParquet",
                "osm": "OpenStreetMap",
                "sumo": "SUMO",
            },
        ),
    ] = ExportKind.GEOJSON
    snap: Snap = 0.05
