"""Parcels too small, too thin or too large: united with a neighbour, or divided once more."""

from __future__ import annotations

from urban_processing.parcelling.rows.plots import Place, Plots
from urban_processing.parcelling.rows.spacing import Bounds

LEAST_FRONT = 0.4
"""Shortest frontage of a parcel, over the smallest width."""


SPOTS = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74)
"""Where along the front a parcel too large may be divided, the best place first."""


def tidy(plots: Plots, bounds: Bounds) -> None:
    """Unite small and triangular parcels with neighbours; divide those that are too large.

    The smallest comes first. Of its neighbours it goes to the one with which it shares the
    longest border, weighed by how compact the two are together (Vanegas 2012, section 4.2.3,
    goes by the border alone, which makes hooks), and rather to one with which it does not exceed
    the largest area.
    """
    stuck: set[int] = set()
    while len(plots.rings) > 1:
        faulty = [n for n in plots.rings if n not in stuck and _faulty(plots, n, bounds)]
        if not faulty:
            break
        number = min(faulty, key=lambda n: (round(plots.area[n], 6), n))
        choice = _neighbour(plots, number, bounds)
        if choice is None:
            stuck.add(number)
            continue
        plots.unite(number, *choice)


def _faulty(plots: Plots, number: int, bounds: Bounds) -> bool:
    return (
        plots.area[number] < bounds.min_area or plots.front(number) < LEAST_FRONT * bounds.min_width
    )


def _neighbour(plots: Plots, number: int, bounds: Bounds) -> tuple[int, list[int]] | None:
    best: tuple[tuple[float, int], tuple[int, list[int]]] | None = None
    for other, border in sorted(plots.borders(number).items()):
        ring = plots.united(number, other)
        if ring is None:
            continue
        weight = border * plots.compactness(ring) ** 3
        if plots.area[number] + plots.area[other] > bounds.max_area:
            weight *= 0.5
        key = (round(weight, 6), -other)
        if best is None or key > best[0]:
            best = (key, (other, ring))
    return None if best is None else best[1]


def divide_large(plots: Plots, bounds: Bounds) -> None:
    """Divide parcels above the largest area by another line from the street.

    Both halves keep the smallest area and the smallest width (Vanegas 2012, section 4.2.3).
    """
    todo = sorted(n for n in plots.rings if plots.area[n] > bounds.max_area)
    while todo:
        number = todo.pop(0)
        line = _halving(plots, number, bounds)
        if line is not None:
            fresh = len(plots.area)
            plots.divide(number, *line)
            todo += [n for n in (fresh, fresh + 1) if plots.area[n] > bounds.max_area]


def _halving(plots: Plots, number: int, bounds: Bounds) -> tuple[Place, Place] | None:
    """Return the line from a front that divides a parcel into the most equal halves."""
    sheet, ring = plots.sheet, plots.rings[number]
    if plots.holes[number]:
        return None
    best: tuple[float, Place, Place] | None = None
    for front in plots.fronts(number):
        length = sum(sheet.distance(ring[k], ring[(k + 1) % len(ring)]) for k in front)
        if length < 2.0 * bounds.min_width:
            continue
        for spot in SPOTS:
            if min(spot, 1.0 - spot) * length < bounds.min_width:
                continue
            p, q = plots.line_from(number, front, spot * length)
            if q is None:
                continue
            area = plots.area_between(number, p, q)
            share = min(area, plots.area[number] - area)
            if share >= bounds.min_area and (best is None or share > 1.02 * best[0]):
                best = (share, p, q)
    if best is None:
        return None
    return best[1:]
