"""The layers of a layout file as plain tables: named columns and a geometry."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.layout import ON_OBSTACLE, EdgeKind, Layout
from urban_processing.mesh.planar import OUTSIDE, FloatArray
from urban_processing.metrics.measures import LayoutMeasures, Metric, measure
from urban_processing.rights_of_way import RightsOfWay
from urban_processing.rights_of_way.lay_out import CLASSES
from urban_processing.schema import ColumnType, layer
from urban_processing.streets.classes import NodeKind

NODE_KIND_NAMES = {NodeKind.JUNCTION: "junction", NodeKind.END: "end", NodeKind.ENTRY: "entry"}


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one length, in the order of the schema, and a geometry in map coordinates.

    Missing values are NaN in columns of numbers (a column of whole numbers that may be
    missing is float64), ``None`` in geometries.
    """

    columns: dict[str, npt.NDArray[Any]]
    geometry: npt.NDArray[np.object_] | None = None

    def __post_init__(self) -> None:
        """Check that all columns have one length."""
        lengths = {len(c) for c in self.columns.values()}
        if self.geometry is not None:
            lengths.add(len(self.geometry))
        if len(lengths) != 1:
            raise ValueError(f"The columns of a table have different lengths: {sorted(lengths)}.")

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self.columns.values())))

    def __getitem__(self, column: str) -> npt.NDArray[Any]:
        """Return the values of a column."""
        return self.columns[column]


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
        "issues": issue_table(layout),
        "metrics": metric_table(measure(layout, measures=known)),
        "provenance": provenance_table(layout),
    }


def parcel_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each parcel; parcel_id is the face's number plus one."""
    known = LayoutMeasures(layout) if measures is None else measures
    p, n = known.parcels, layout.mesh.n_faces
    return _table(
        "parcels",
        {
            "parcel_id": np.arange(1, n + 1),
            "part": layout.face_part,
            "level": layout.face_level,
            "area_m2": p.area,
            "net_area_m2": known.net_area,
            "sides": p.sides,
            "irregularity": p.irregularity,
            "frontage_m": p.frontage,
            "width_m": p.width,
            "depth_m": p.depth,
            "thinness": p.thinness,
            "rim": p.rim,
            "land_use": [layout.land_uses[i] for i in layout.face_use.tolist()],
            "locked": layout.face_locked,
            "reached": p.reached,
            "through_lot": p.through,
            "p_angle_deg": p.angle_deviation,
            "p_area": p.area_ratio,
            "lineage": [f"{v:016x}" for v in layout.face_lineage.tolist()],
        },
        layout.mesh.face_polygons(layout.frame.origin),
    )


def street_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each network edge, rim included."""
    net = (LayoutMeasures(layout) if measures is None else measures).network
    number = np.where(net.node_number > 0, net.node_number, np.nan)
    return _table(
        "streets",
        {
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
        },
        net.lines(layout.mesh, layout.frame.origin),
    )


def junction_table(layout: Layout, *, measures: LayoutMeasures | None = None) -> Table:
    """Return one row for each junction and street end."""
    net = (LayoutMeasures(layout) if measures is None else measures).network
    at = np.flatnonzero(net.node_number)
    xy = layout.mesh.xy[net.node_vertex[at]] + np.asarray(layout.frame.origin)
    return _table(
        "junctions",
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
    """Return the land that was laid out: one polygon for each part, holes taken off.

    It is put together from the rims of the mesh, not from the parcels.
    """
    mesh, loops = layout.mesh, layout.mesh.loops
    origin = np.asarray(layout.frame.origin)
    shells: list[tuple[int, shapely.Polygon]] = []
    holes: list[tuple[int, shapely.Polygon]] = []
    for i in np.flatnonzero(loops.face == OUTSIDE).tolist():
        h = loops.ring(i)[::-1]
        part = int(layout.face_part[mesh.face[h[0] ^ 1]])
        ring = shapely.Polygon(mesh.xy[mesh.target[h]] + origin)
        (shells if mesh.loop_area[i] < 0 else holes).append((part, ring))
    shells.sort(key=lambda s: (s[0], -s[1].area))
    polygons = [_with_holes(shell, [h for q, h in holes if q == part]) for part, shell in shells]
    return _area_table("boundary", np.array([part for part, _ in shells]), polygons)


def _with_holes(shell: shapely.Polygon, holes: list[shapely.Polygon]) -> shapely.Polygon:
    inside = [h for h in holes if shell.covers(h)]
    polygon = shapely.Polygon(shell.exterior, [h.exterior for h in inside])
    # a hole that touches the rim at a point is one loop with it
    return polygon if polygon.is_valid else shapely.make_valid(polygon, method="structure")


def input_boundary_table(layout: Layout) -> Table:
    """Return the polygons as given, before repair and simplification."""
    polygons = _shifted(layout.input_parts, layout)
    return _area_table("input_boundary", np.arange(len(polygons)), polygons)


def right_of_way_table(layout: Layout, streets: RightsOfWay) -> Table:
    """Return the right-of-way: one polygon for each connected piece of one class."""
    return _table(
        "right_of_way",
        {
            "class": [CLASSES[k].value for k in streets.rank.tolist()],
            "part": streets.part,
            "area_m2": shapely.area(streets.polygons),
        },
        _shifted(streets.polygons, layout),
    )


def net_parcel_table(layout: Layout, streets: RightsOfWay) -> Table:
    """Return what is left of each parcel; those of which nothing is left are not in it."""
    face = np.flatnonzero(~shapely.is_missing(streets.net))
    return _table(
        "net_parcels",
        {
            "parcel_id": face + 1,
            "part": layout.face_part[face],
            "area_m2": streets.net_area[face],
        },
        _shifted(streets.net[face], layout),
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
    return _area_table("obstacles", lowest, _shifted(layout.obstacles, layout))


def issue_table(layout: Layout) -> Table:
    """Return what could not be done, and what the user should know."""
    issues = layout.issues
    return _table(
        "issues",
        {
            "part": _numbers([i.part for i in issues]),
            "parcel_id": _numbers([i.parcel_id for i in issues]),
            "code": [i.code for i in issues],
            "message": [i.message for i in issues],
            "value": _numbers([i.value for i in issues]),
            "limit": _numbers([i.limit for i in issues]),
        },
        _shifted([i.geometry for i in issues], layout),
    )


def metric_table(metrics: tuple[Metric, ...]) -> Table:
    """Return metrics as a table; part and value are NaN where they are empty."""
    return _table(
        "metrics",
        {
            "part": _numbers([m.part for m in metrics]),
            "metric": [m.metric for m in metrics],
            "value": _numbers([m.value for m in metrics]),
            "unit": [m.unit for m in metrics],
        },
    )


def provenance_table(layout: Layout) -> Table:
    """Return the steps that made the layout, oldest first."""
    steps = layout.history
    return _table(
        "provenance",
        {
            "step": np.arange(1, len(steps) + 1),
            "algorithm": [s.algorithm for s in steps],
            "parameters": [json.dumps(dict(s.parameters), ensure_ascii=False) for s in steps],
            "seed": [s.seed for s in steps],
            "version": [s.version for s in steps],
            "input_sha256": [s.input_sha256 for s in steps],
            "seconds": [s.seconds for s in steps],
            "results": [json.dumps(dict(s.results)) for s in steps],
            "part": np.full(len(steps), np.nan),
        },
    )


def _area_table(name: str, part: npt.ArrayLike, polygons: Any) -> Table:
    geometry = _objects(polygons)
    return _table(name, {"part": part, "area_m2": shapely.area(geometry)}, geometry)


def _table(
    name: str, values: Mapping[str, Any], geometry: npt.NDArray[np.object_] | None = None
) -> Table:
    """Put the values into the order and the types of the schema."""
    columns: dict[str, npt.NDArray[Any]] = {}
    for column in layer(name).columns:
        given = values[column.name]
        if column.dtype is ColumnType.TEXT:
            columns[column.name] = _objects(np.asarray(given, dtype=object).tolist())
        elif column.dtype is ColumnType.INTEGER and column.nullable:
            columns[column.name] = np.asarray(given, dtype=np.float64)
        else:
            columns[column.name] = np.asarray(given, dtype=column.dtype.value)
    return Table(columns, geometry)


def _numbers(values: Sequence[float | None]) -> FloatArray:
    return np.array([math.nan if v is None else v for v in values], dtype=np.float64)


def _objects(values: Any) -> npt.NDArray[np.object_]:
    out = np.empty(len(values), dtype=object)
    out[:] = list(values)
    return out


def _shifted(geometries: Any, layout: Layout) -> npt.NDArray[np.object_]:
    """Geometries in map coordinates; ``None`` stays."""
    origin = np.asarray(layout.frame.origin)
    return np.asarray(shapely.transform(_objects(geometries), lambda xy: xy + origin))
