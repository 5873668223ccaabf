"""The layers of a layout file as plain tables: named columns and a geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.fabric.of_layout import land_of_layout
from urban_processing.layout import ON_OBSTACLE, EdgeKind, Layout, Stage
from urban_processing.metrics.measures import LayoutMeasures, Metric, measure
from urban_processing.metrics.parcels import ParcelMeasures
from urban_processing.rights_of_way import RightsOfWay
from urban_processing.rights_of_way.lay_out import CLASSES
from urban_processing.schema import (
    BOUNDARY,
    INPUT_BOUNDARY,
    JUNCTIONS,
    METRICS,
    NET_PARCELS,
    OBSTACLES,
    PARCELS,
    RIGHT_OF_WAY,
    STREETS,
    Layer,
)
from urban_processing.site import Frame
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network_model import Linework, StreetNetwork
from urban_processing.tables import (
    Table,
    issue_table,
    make_table,
    numbers,
    objects,
    provenance_table,
    to_map,
)

NODE_KIND_NAMES = {NodeKind.JUNCTION: "junction", NodeKind.END: "end", NodeKind.ENTRY: "entry"}


def layout_tables(layout: Layout, *, measures: LayoutMeasures | None = None) -> dict[str, Table]:
    """Return all layers of the schema that a layout has, in the order of the schema.

    `input_boundary` is left out where the polygons as given are not known, `obstacles` where
    there are none, `right_of_way` and `net_parcels` where no rights-of-way are laid out.
    """
    known = LayoutMeasures(layout) if measures is None else measures
    tables = {
        "parcels": parcel_table(layout, measures=known),
        "streets": street_table(layout, measures=known),
        "junctions": junction_table(layout, measures=known),
        "boundary": boundary_table(layout),
    }
    if layout.input_parts:
        tables["input_boundary"] = input_boundary_table(layout)
    if layout.obstacles:
        tables["obstacles"] = obstacle_table(layout)
    if known.rights_of_way is not None:
        tables["right_of_way"] = right_of_way_table(layout, known.rights_of_way)
        tables["net_parcels"] = net_parcel_table(layout, known.rights_of_way)
    return {
        **tables,
        "issues": issue_table(layout.issues, layout.frame),
        "metrics": metric_table(measure(layout, measures=known)),
        "provenance": provenance_table(layout.history),
    }


def parcel_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each parcel; parcel_id is the face's number plus one."""
    known = LayoutMeasures(layout) if measures is None else measures
    p, n = known.parcels, layout.mesh.n_faces
    return make_table(
        PARCELS,
        {
            "parcel_id": np.arange(1, n + 1),
            "part": layout.face_part,
            "level": layout.face_level,
            "net_area_m2": known.net_area,
            **parcel_columns(p),
            "land_use": [layout.land_uses[i] for i in layout.face_use.tolist()],
            "locked": layout.face_locked,
            "lineage": [f"{v:016x}" for v in layout.face_lineage.tolist()],
            "stage": [Stage(v).name.lower() for v in layout.face_stage.tolist()],
            "quota": np.where(layout.face_quota > 0, layout.face_quota, np.nan),
        },
        layout.mesh.face_polygons(layout.frame.origin),
    )


def parcel_columns(p: ParcelMeasures) -> dict[str, Any]:
    """Return what the schema says of parcels by their shape and their streets, by column."""
    return {
        "area_m2": p.area,
        "sides": p.sides,
        "irregularity": p.irregularity,
        "frontage_m": p.frontage,
        "width_m": p.width,
        "depth_m": p.depth,
        "thinness": p.thinness,
        "rim": p.rim,
        "reached": p.reached,
        "through_lot": p.through,
        "p_angle_deg": p.angle_deviation,
        "p_area": p.area_ratio,
    }


def street_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each network edge, rim included."""
    net = (LayoutMeasures(layout) if measures is None else measures).network
    return make_table(STREETS, street_columns(net), net.lines(layout.mesh, layout.frame.origin))


def street_columns(net: StreetNetwork) -> dict[str, Any]:
    """Return what the schema says of streets, by column."""
    number = np.where(net.node_number > 0, net.node_number, np.nan)
    return {
        "edge_id": np.arange(1, net.n_edges + 1),
        "street_id": net.edge_street + 1,
        "part": net.edge_part,
        "class": net.edge_class,
        "level": net.edge_level,
        "width_m": net.edge_width,
        "length_m": net.edge_length,
        "from_junction": number[net.start],
        "to_junction": number[net.end],
        "fixed_id": np.where(net.edge_fixed >= 0, net.edge_fixed + 1.0, np.nan),
    }


def junction_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each junction and street end."""
    net = (LayoutMeasures(layout) if measures is None else measures).network
    return junctions_of(net, layout.mesh, layout.frame)


def junctions_of(net: StreetNetwork, lines: Linework, frame: Frame) -> Table:
    """Return one row for each junction and street end of a network of lines."""
    at = np.flatnonzero(net.node_number)
    xy = lines.xy[net.node_vertex[at]] + np.asarray(frame.origin)
    return make_table(
        JUNCTIONS,
        {
            "junction_id": net.node_number[at],
            "part": net.node_part[at],
            "kind": [NODE_KIND_NAMES[NodeKind(k)] for k in net.node_kind[at].tolist()],
            "degree": net.node_degree[at],
            "angle_dev_deg": net.node_deviation[at],
        },
        np.asarray(shapely.points(xy), dtype=object),
    )


def boundary_table(layout: Layout) -> Table:
    """Return the land that was laid out: one polygon for each part, holes taken off."""
    polygons, part = land_of_layout(layout)
    return _area_table(BOUNDARY, part, to_map(polygons, layout.frame))


def input_boundary_table(layout: Layout) -> Table:
    """Return the polygons as given, before repair and simplification."""
    polygons = to_map(layout.input_parts, layout.frame)
    return _area_table(INPUT_BOUNDARY, np.arange(len(polygons)), polygons)


def right_of_way_table(layout: Layout, streets: RightsOfWay) -> Table:
    """Return the right-of-way: one polygon for each connected piece of one class."""
    return make_table(
        RIGHT_OF_WAY,
        {
            "class": [CLASSES[k].value for k in streets.rank.tolist()],
            "part": streets.part,
            "area_m2": shapely.area(streets.polygons),
        },
        to_map(streets.polygons, layout.frame),
    )


def net_parcel_table(layout: Layout, streets: RightsOfWay) -> Table:
    """Return what is left of each parcel; those of which nothing is left are not in it."""
    face = np.flatnonzero(~shapely.is_missing(streets.net))
    return make_table(
        NET_PARCELS,
        {
            "parcel_id": face + 1,
            "part": layout.face_part[face],
            "area_m2": streets.net_area[face],
        },
        to_map(streets.net[face], layout.frame),
    )


def obstacle_table(layout: Layout) -> Table:
    """Return what obstacles take of the land as given; `part` is the first that each bounds."""
    mesh = layout.mesh
    at = np.flatnonzero(layout.edge_kind == EdgeKind.OBSTACLE)
    part = layout.face_part[mesh.face.reshape(-1, 2)[at].max(axis=1)]
    middle = shapely.points(mesh.xy[mesh.origin.reshape(-1, 2)[at]].mean(axis=1))
    obstacle, edge = shapely.STRtree(middle).query(
        np.asarray(layout.obstacles, dtype=object), predicate="dwithin", distance=ON_OBSTACLE
    )
    last = len(np.unique(layout.face_part)) - 1
    lowest = np.full(len(layout.obstacles), last)
    np.minimum.at(lowest, obstacle, part[edge])
    return _area_table(OBSTACLES, lowest, to_map(layout.obstacles, layout.frame))


def metric_table(metrics: tuple[Metric, ...]) -> Table:
    """Return metrics as a table; part and value are NaN where they are empty."""
    return make_table(
        METRICS,
        {
            "part": numbers([m.part for m in metrics]),
            "metric": [m.metric for m in metrics],
            "value": numbers([m.value for m in metrics]),
            "unit": [m.unit for m in metrics],
        },
    )


def _area_table(layer: Layer, part: npt.ArrayLike, polygons: Any) -> Table:
    geometry = objects(polygons)
    return make_table(layer, {"part": part, "area_m2": shapely.area(geometry)}, geometry)
