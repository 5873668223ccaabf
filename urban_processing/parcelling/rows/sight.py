"""Whether one point of a ring can be seen from another."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urban_processing.parcelling.rows.sheet import Sheet

TOUCH = 1e-3
"""A line that passes a vertex nearer than this, in metres, touches it."""

Point = tuple[float, float]


def sees(sheet: Sheet, ring: Sequence[int], p: tuple[float, float], q: tuple[float, float]) -> bool:
    """Whether the line between two points of a ring's boundary runs within, and touches it not."""
    (px, py), (qx, qy) = p, q
    dx, dy = qx - px, qy - py
    length = math.hypot(dx, dy)
    dx, dy = dx / length, dy / length
    mx, my = 0.5 * (px + qx), 0.5 * (py + qy)
    inside = False
    u = ring[-1]
    ux, uy = sheet.x[u] - px, sheet.y[u] - py
    su = ux * dy - uy * dx
    for v in ring:
        vx, vy = sheet.x[v] - px, sheet.y[v] - py
        sv = vx * dy - vy * dx
        if -TOUCH < sv < TOUCH and TOUCH < vx * dx + vy * dy < length - TOUCH:
            return False
        if (su > 0.0) != (sv > 0.0):
            share = su / (su - sv)
            at = (ux + share * (vx - ux)) * dx + (uy + share * (vy - uy)) * dy
            if TOUCH < at < length - TOUCH:
                return False
        if (uy + py > my) != (vy + py > my):
            at = ux + px + (my - uy - py) * (vx - ux) / (vy - uy)
            inside = inside != (at > mx)
        ux, uy, su = vx, vy, sv
    return inside
