"""Small layouts whose figures can be worked out by hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from urban_processing.layout import Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.site import Frame

SIDE = 20.0
"""Side of a grid cell in metres."""

Line = Sequence[tuple[float, float]]


def boxes(
    nx: int, ny: int, *, at: tuple[float, float] = (0, 0), without: Iterable[tuple[int, int]] = ()
) -> list[shapely.Polygon]:
    """Cells of a grid, column by column, some left out."""
    cells = [(i, j) for i in range(nx) for j in range(ny) if (i, j) not in set(without)]
    return [
        shapely.box(*((np.array([i, j, i + 1, j + 1]) + np.tile(at, 2)) * SIDE)) for i, j in cells
    ]


def with_streets(layout: Layout, *lines: Line, level: int = 1, unit: float = SIDE) -> Layout:
    """Make the mesh edges that lie on the given lines streets of a level."""
    mesh = layout.mesh
    if not lines:
        return layout
    drawn = shapely.multilinestrings([shapely.LineString(np.asarray(p) * unit) for p in lines])
    a, b = mesh.xy[mesh.origin[0::2]], mesh.xy[mesh.origin[1::2]]
    on = np.all(
        [shapely.distance(shapely.points(p), drawn) < 1e-3 for p in (a, b, (a + b) / 2)], axis=0
    )
    new = on & ~layout.edge_street
    return layout.replace(
        edge_street=layout.edge_street | on,
        edge_level=np.where(new, level, layout.edge_level).astype(np.int16),
    )


def layout_of(
    polygons: Sequence[shapely.Polygon],
    *lines: Line,
    part: Sequence[int] | None = None,
    rim: bool = True,
    min_area: float = 400.0,
    origin: tuple[float, float] = (0.0, 0.0),
    unit: float = SIDE,
) -> Layout:
    """Layout of given parcels with streets on the rim and on the given lines."""
    layout = layout_from_mesh(
        mesh_from_polygons(polygons),
        frame=Frame("EPSG:32630", origin),
        face_part=np.array(part if part is not None else [0] * len(polygons), dtype=np.int64),
        min_area=min_area,
        rim_is_street=rim,
    )
    return with_streets(layout, *lines, unit=unit)


def grid(nx: int, ny: int, *lines: Line, rim: bool = True, **kwargs: object) -> Layout:
    """Layout of a grid of cells; lines are in units of cells."""
    return layout_of(boxes(nx, ny), *lines, rim=rim, **kwargs)  # type: ignore[arg-type]


def cut_square(size: float, *lines: Line, rim: bool = True) -> Layout:
    """A square of a side in metres, cut along lines in metres, all of them streets."""
    frame = shapely.box(0, 0, size, size)
    drawn = [shapely.LineString(p) for p in lines]
    noded = shapely.node(shapely.geometrycollections([frame.exterior, *drawn]))
    cells = shapely.polygonize(list(noded.geoms)).geoms
    return layout_of(list(cells), *lines, rim=rim, unit=1.0)
