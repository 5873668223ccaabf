"""The declaration of `export`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind, Output, OutputKind
from urban_processing.params.export import ExportParams
from urban_processing.progress import Progress
from urban_processing.schema import LAID_OUT


def _run(inputs: Mapping[str, Any], params: ExportParams, progress: Progress) -> Mapping[str, Any]:
    del params  # whoever writes the files asks for their format
    progress.update(1.0)
    return {"output": inputs["layout"]}


EXPORT = AlgorithmSpec(
    name="export",
    title="Export to plain files",
    group="Layout",
    summary="Write a layout as GeoJSON, GeoParquet, OpenStreetMap or SUMO files.",
    description=(
        "As GeoJSON or GeoParquet every layer becomes a file of its own.\n\n"
        "As OpenStreetMap, layout.osm has streets and parcels: streets with class, width of the "
        "carriageway, lanes and speed limit, parcels as lots, in WGS 84. Where they touch they "
        "share nodes. The file streets.osm has the same streets without the parcels, for programs "
        "that take every way for a street, as OSMnx does. Both say that they are never to be "
        "uploaded: what is planned does not belong into OpenStreetMap.\n\n"
        "As SUMO, layout.nod.xml and layout.edg.xml have streets as nodes and edges in both "
        "directions, in metres from the layout's origin, with lanes, speed and priority. SUMO's "
        "netconvert builds a network from them: netconvert --node-files layout.nod.xml "
        "--edge-files layout.edg.xml -o layout.net.xml"
    ),
    params=ExportParams,
    inputs=(
        Input(
            name="layout",
            kind=InputKind.LAYOUT,
            label="Layout",
            help="A layout file, whose parcels and streets may have been edited.",
        ),
    ),
    outputs=(
        Output(
            name="output",
            kind=OutputKind.EXPORT,
            label="Folder",
            help="The folder for the files; made if its parent exists.",
            required=True,
            layers=LAID_OUT,
        ),
    ),
    run=_run,
    references=(
        "OpenStreetMap Wiki: Key:highway, Key:width, Key:lanes, Tag:boundary=lot.",
        "P. A. Lopez et al. (2018). Microscopic traffic simulation using SUMO. 21st International "
        "Conference on Intelligent Transportation Systems.",
    ),
    examples=(
        "layout.gpkg -o folder --format osm",
        "layout.gpkg -o folder --format sumo",
    ),
)
