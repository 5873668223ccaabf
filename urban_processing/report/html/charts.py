"""Histograms and roses of several sides on one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.metrics.histograms import Histogram
from urban_processing.report.html.digits import decimals_for, number
from urban_processing.report.html.themes import round_up

FloatArray = npt.NDArray[np.float64]

COLOURS = ("#0072b2", "#c2500a", "#00785a", "#b0528f", "#6a5a00", "#4a463f")
"""Dark enough to be read on white, and apart for those who see colours differently."""

DASHES = ("", "7 3", "2 2.5", "9 3 2 3", "4 4", "1 3")
"""Sides are told apart by dashes too."""

WIDTH, HEIGHT = 340, 190
LEFT, RIGHT, TOP, BOTTOM = 50, 10, 10, 24
ROSE = 240
TICKS = 5
LETTER = 8.0
"""Width of a digit."""


@dataclass(frozen=True)
class Line:
    """How a side is drawn in all charts."""

    colour: str
    dash: str
    filled: bool


@dataclass(frozen=True)
class Chart:
    """A drawing in SVG and its size in units of a pixel."""

    shapes: str
    width: int
    height: int


def line_of(k: int, n: int) -> Line:
    """Return how side k of n is drawn; the first one is an area."""
    dash = DASHES[(k + k // len(COLOURS)) % len(DASHES)] if n > 1 else ""
    return Line(COLOURS[k % len(COLOURS)], dash, k == 0)


def chart(histogram: Histogram) -> Chart:
    """Draw a histogram, or a rose where values are directions."""
    return _rose(histogram) if histogram.distribution.circular else _bars(histogram)


def _style(line: Line) -> str:
    fill = f'fill="{line.colour}" fill-opacity="0.22"' if line.filled else 'fill="none"'
    dash = f' stroke-dasharray="{line.dash}"' if line.dash else ""
    return f'{fill} stroke="{line.colour}" stroke-width="1.8" stroke-linejoin="round"{dash}'


def _bars(h: Histogram) -> Chart:
    edges = np.log10(h.edges) if h.logarithmic else h.edges
    low, high = float(edges[0]), float(edges[-1])
    top = round_up(max(100 * float(h.shares.max()), 1.0))
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM

    def x(value: FloatArray | float) -> FloatArray:
        return np.round(LEFT + (right - LEFT) * (np.asarray(value) - low) / (high - low), 1)

    def y(percent: FloatArray | float) -> FloatArray:
        return np.round(bottom - (bottom - TOP) * np.asarray(percent) / top, 1)

    out = []
    for tick in (0.0, top / 2, top):
        out.append(f'<path class="grid" d="M{LEFT} {y(tick):g}H{right}"/>')
        out.append(_label(LEFT - 5, float(y(tick)) + 4, f"{tick:g} %", "end"))
    values = _log_ticks(h.edges) if h.logarithmic else _ticks(low, high, h.distribution.whole)
    decimals = decimals_for(values)
    for value in values:
        at = float(x(math.log10(value) if h.logarithmic else value))
        out.append(f'<path class="tick" d="M{at:g} {bottom}v4"/>')
        text = number(value, decimals)
        # nothing may stick out at the right
        at = min(at, WIDTH - LETTER * len(text) / 2)
        out.append(_label(at, bottom + 17, text, "middle"))
    n = len(h.shares)
    out += [
        f'<path d="{_steps(x(edges), y(100 * h.shares[k]), bottom)}" {_style(line_of(k, n))}/>'
        for k in range(n)
        if h.shares[k].any()
    ]
    return Chart("".join(out), WIDTH, HEIGHT)


def _steps(x: FloatArray, y: FloatArray, bottom: float) -> str:
    steps = "".join(f"V{a:g}H{b:g}" for a, b in zip(y.tolist(), x[1:].tolist(), strict=True))
    return f"M{x[0]:g} {bottom:g}{steps}V{bottom:g}z"


def _label(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}">{text}</text>'


def _ticks(low: float, high: float, whole: bool) -> list[float]:
    """Round numbers between two, ends included, so many as have room."""
    found: list[float] = []
    for count in range(TICKS, 0, -1):
        step = round_up((high - low) / count)
        if whole:
            step = max(round(step), 1)
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        found = [k * step for k in range(first, last + 1)]
        longest = max((len(number(v, decimals_for(found))) for v in found), default=0)
        if (longest + 1.5) * LETTER * (high - low) <= (WIDTH - LEFT - RIGHT) * step:
            break
    return found


def _log_ticks(edges: FloatArray) -> list[float]:
    """Powers of ten, and numbers between them where there are few."""
    low, high = float(edges[0]), float(edges[-1])
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1,), (1, 3), (1, 2, 5)):
        found = [s * 10.0**p for p in powers for s in steps if low <= s * 10.0**p <= high]
        if len(found) >= 3:
            return found
    return found


def _rose(h: Histogram) -> Chart:
    """Sectors as long as their share, grid north up."""
    middle, radius = ROSE / 2, ROSE / 2 - 22
    most = max(float(h.shares.max()), 1e-9)
    out = [
        f'<circle class="grid" cx="{middle:g}" cy="{middle:g}" r="{radius * part:g}"/>'
        for part in (0.5, 1.0)
    ]
    for text, x, y in (("N", 0, -1), ("E", 1, 0), ("S", 0, 1), ("W", -1, 0)):
        at = radius + 11
        out.append(_label(middle + at * x, middle + at * y + 4, text, "middle"))
    n = len(h.shares)
    for k in range(n):
        if h.shares[k].any():
            path = _sectors(h.edges, radius * h.shares[k] / most, middle)
            out.append(f'<path d="{path}" {_style(line_of(k, n))}/>')
    return Chart("".join(out), ROSE, ROSE)


def _sectors(edges: FloatArray, radii: FloatArray, middle: float) -> str:
    """Outline of all sectors around the middle, without the lines between them."""
    angle = np.radians(edges)
    parts: Sequence[str] = [
        f"{_at(a, r, middle)}A{r:.1f} {r:.1f} 0 0 1 {_at(b, r, middle)}"
        for a, b, r in zip(angle[:-1].tolist(), angle[1:].tolist(), radii.tolist(), strict=True)
    ]
    return f"M{'L'.join(parts)}z"


def _at(angle: float, radius: float, middle: float) -> str:
    x, y = middle + radius * math.sin(angle), middle - radius * math.cos(angle)
    return f"{x:.1f} {y:.1f}"
