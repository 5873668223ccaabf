"""A small street network to edit, its blocks and simple parcels in them (Vanegas 2012, Fig. 7)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

WIDTH = 12.0


@dataclass(frozen=True)
class Town:
    """Streets between numbered nodes; `bends` are further points of a street, from low to high."""

    nodes: dict[int, tuple[float, float]]
    streets: tuple[tuple[int, int], ...]
    widths: dict[tuple[int, int], float] = dataclasses.field(default_factory=dict)
    bends: dict[tuple[int, int], tuple[tuple[float, float], ...]] = dataclasses.field(
        default_factory=dict
    )
    lot: tuple[float, float] = (18.0, 35.0)

    def line(self, street):
        a, b = street
        return shapely.LineString([self.nodes[a], *self.bends.get(street, ()), self.nodes[b]])

    def moved(self, node, dx, dy):
        x, y = self.nodes[node]
        return dataclasses.replace(self, nodes={**self.nodes, node: (x + dx, y + dy)})

    def with_width(self, street, width):
        return dataclasses.replace(self, widths={**self.widths, street: width})

    def with_bends(self, street, bends):
        return dataclasses.replace(self, bends={**self.bends, street: tuple(bends)})

    def with_street(self, *streets):
        return dataclasses.replace(self, streets=(*self.streets, *streets))

    def without_street(self, *streets):
        left = tuple(s for s in self.streets if s not in streets)
        return dataclasses.replace(self, streets=left)

    def with_node(self, node, x, y):
        return dataclasses.replace(self, nodes={**self.nodes, node: (x, y)})

    def with_lots(self, width, depth):
        return dataclasses.replace(self, lot=(width, depth))

    def mapped(self, function):
        """The network with all its points mapped, streets as wide as before."""
        nodes = {k: function(*p) for k, p in self.nodes.items()}
        bends = {k: tuple(function(*p) for p in points) for k, points in self.bends.items()}
        return dataclasses.replace(self, nodes=nodes, bends=bends)

    def blocks(self):
        lines = [self.line(street) for street in self.streets]
        faces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
        right_of_way = shapely.union_all(
            [
                line.buffer(0.5 * self.widths.get(street, WIDTH), join_style="mitre", cap_style=2)
                for street, line in zip(self.streets, lines, strict=True)
            ]
        )
        left = shapely.get_parts(shapely.difference(faces, right_of_way))
        return np.array([p for p in left if p.area > 50], dtype=object)

    def parcels(self):
        return np.concatenate([rows_of_lots(block, *self.lot) for block in self.blocks()])


def town(n=3, *, width=120.0, height=90.0, wobble=9.0):
    """n by n blocks, slightly irregular; node number = (n + 1)·row + column."""
    rng = np.random.default_rng(7)
    shift = rng.uniform(-wobble, wobble, ((n + 1) ** 2, 2))
    nodes = {
        (n + 1) * j + i: (
            width * i + shift[(n + 1) * j + i, 0],
            height * j + shift[j * (n + 1) + i, 1],
        )
        for j in range(n + 1)
        for i in range(n + 1)
    }
    across = [((n + 1) * j + i, (n + 1) * j + i + 1) for j in range(n + 1) for i in range(n)]
    up = [((n + 1) * j + i, (n + 1) * (j + 1) + i) for j in range(n) for i in range(n + 1)]
    return Town(nodes, (*across, *up))


def rows_of_lots(block, width, depth):
    """Rows of lots along the longer axis of the block, all of about one width and depth."""
    axes = tightest_axes(block)
    low, high = (
        (shapely.get_coordinates(block) @ axes.T).min(0),
        (shapely.get_coordinates(block) @ axes.T).max(0),
    )
    length = high - low
    along, across = (0, 1) if length[0] >= length[1] else (1, 0)
    columns = max(1, round(length[along] / width))
    rows = max(1, round(length[across] / depth))
    origin, u, v = low @ axes, length[along] * axes[along], length[across] * axes[across]
    if u[0] < -1e-9 or (abs(u[0]) <= 1e-9 and u[1] < 0):  # from west to east, whatever the start
        origin, u = origin + u, -u
    if v[1] < -1e-9:
        origin, v = origin + v, -v
    out = []
    for j in range(rows):
        for i in range(columns):
            corner = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            cell = shapely.Polygon([origin + a / columns * u + b / rows * v for a, b in corner])
            out += [p for p in shapely.get_parts(cell.intersection(block)) if p.area > 1]
    return np.array(out, dtype=object)


def tightest_axes(block):
    """(2, 2) axes of the box of least area around a block, whatever its starting vertex."""
    hull = shapely.get_coordinates(shapely.normalize(block.convex_hull))
    best = None
    for edge in np.diff(hull, axis=0):
        u = edge / np.hypot(*edge)
        axes = np.array([u, [-u[1], u[0]]])
        area = np.round(np.ptp(hull @ axes.T, axis=0).prod(), 6)
        if best is None or area < best[0]:
            best = area, axes
    return best[1]


def turned(polygons, angle, *, scale=1.0, shift=(0.0, 0.0)):
    """Polygons turned about the origin by degrees, scaled and moved."""
    radians = np.radians(angle)
    c, s = scale * np.cos(radians), scale * np.sin(radians)
    return np.array(
        [affinity.affine_transform(p, [c, -s, s, c, *shift]) for p in polygons], dtype=object
    )
