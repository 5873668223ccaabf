"""What maps are coloured by, and the classes that all sides have in common."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.layout import PARCEL_USE, REMNANT_USE
from urban_processing.mesh.corners import IRREGULAR
from urban_processing.metrics.land_values import PARK_USES
from urban_processing.metrics.subdivisions import PATIO_USE
from urban_processing.report.html.digits import counted, number, share, with_unit
from urban_processing.tables import Table

IntArray = npt.NDArray[np.int64]
FloatArray = npt.NDArray[np.float64]

HATCHED = "url(#hatch)"
"""Fill of what is missing: lines, so that it stands out in grey too."""

WARM = ("#fdf6e8", "#fbdfc6", "#f4b08d", "#dd7560", "#b23a45", "#6d1530")
COOL = ("#f7f3dc", "#d6e8c4", "#9fd0bd", "#63b3bd", "#3787ad", "#2f5f97", "#2a3f78", "#1d2450")
PALE, BAD = "#f3eee2", "#b3401f"
PLAIN, PARK, PATIO, REMNANT = "#f6f1e1", "#8fc27e", "#d5e3c6", "#6b6459"
USES = ("#e3a857", "#7fa8d1", "#c58bbf", "#b9b3a6", "#4f8f8b", "#8a5a3c")
LINES = (
    *("#26306b", "#e07b16", "#2f9e7a", "#b0528f", "#7fb9e0"),
    *("#8a6d00", "#d03a3a", "#5f4bb6", "#8c8579"),
)
OTHER = "other"

IRREGULARITIES = (0.02, 0.05, IRREGULAR, 0.2, 0.5)
"""Irregularities at which another class begins; from `IRREGULAR` on parcels are irregular."""

HECTARE = 1e4
"""Square metres of a hectare."""

MOST_EDGES = 6
"""Areas at which another class of blocks begins, at most."""

WIDE = 5.0
"""Areas that are so many times larger than others are classed by factors."""

NARROW = 1e-3
"""Areas that differ by less, in proportion, are of one class: labels could not tell more."""

CLASSES = 6
"""Classes of frontage, besides none."""


@dataclass(frozen=True)
class MapClass:
    """What one colour stands for."""

    label: str
    fill: str


@dataclass(frozen=True, eq=False)
class Theme:
    """A way to colour maps.

    Parameters
    ----------
    name
        For identifiers in the page.
    title
        Heading, such as ``Frontage``.
    layer
        Layer that is coloured: ``parcels``, ``blocks``, or ``streets`` as lines.
    column
        Column that says the class: a side without a known value of it has no such map.
    classes
        Colours and what they stand for.
    class_of
        Gives the class of each row of the layer.
    sentence
        Says of the layer what the map shows.
    note
        What is to be known of the classes.
    """

    name: str
    title: str
    layer: str
    column: str
    classes: tuple[MapClass, ...]
    class_of: Callable[[Table], IntArray]
    sentence: Callable[[Table], str]
    note: str = ""

    def shows(self, table: Table | None) -> bool:
        """Whether a side has something to show of it."""
        if table is None or self.column not in table.columns:
            return False
        values = table[self.column]
        return values.dtype == object or bool(np.isfinite(values.astype(np.float64)).any())


def themes(sides: Sequence[dict[str, Table]]) -> list[Theme]:
    """Return the themes that a side has something to show of.

    Parameters
    ----------
    sides
        Layers of each side by name.
    """
    parcels = [side["parcels"] for side in sides if "parcels" in side]
    streets = [side["streets"] for side in sides if "streets" in side]
    makers = (_irregularity, _frontage, _level, _undesirable, _land_use)
    made = [make(parcels) for make in makers] if parcels else []
    made.append(_street_classes(streets) if streets else None)
    blocks = [side["blocks"] for side in sides if "blocks" in side]
    made.append(_block_area(blocks) if blocks else None)
    return [theme for theme in made if theme is not None]


def _pooled(tables: Sequence[Table], column: str) -> FloatArray:
    """Values of all sides that are known."""
    given = [np.asarray(t[column], dtype=np.float64) for t in tables if column in t.columns]
    values = np.concatenate(given) if given else np.empty(0)
    return np.asarray(values[np.isfinite(values)])


def _classed(column: str, edges: Sequence[float], unknown: int) -> Callable[[Table], IntArray]:
    """Return what finds classes of values: class k begins at ``edges[k - 1]``."""
    bounds = np.asarray(edges, dtype=np.float64)

    def class_of(table: Table) -> IntArray:
        if column not in table.columns:
            return np.full(len(table), unknown, dtype=np.int64)
        values = np.asarray(table[column], dtype=np.float64)
        # rounded, so that two machines agree
        found = np.searchsorted(bounds, np.round(values, 6), side="right")
        return np.where(np.isfinite(values), found, unknown)

    return class_of


def _irregularity(parcels: Sequence[Table]) -> Theme | None:
    if not len(_pooled(parcels, "irregularity")):
        return None
    texts = [f"{edge:g}" for edge in IRREGULARITIES]
    labels = [f"under {texts[0]}", *_ranges(texts), f"{texts[-1]} and more"]
    classes = [MapClass(text, fill) for text, fill in zip(labels, WARM, strict=True)]

    def sentence(table: Table) -> str:
        bad = int((np.round(table["irregularity"], 6) >= IRREGULAR).sum())
        return f"{_of(bad, table)} have an irregularity of {IRREGULAR:g} or more."

    return Theme(
        "irregularity",
        "Irregularity",
        "parcels",
        "irregularity",
        (*classes, MapClass("not known", HATCHED)),
        _classed("irregularity", IRREGULARITIES, len(classes)),
        sentence,
        f"0 is a square; parcels from {IRREGULAR:g} on are called irregular.",
    )


def _frontage(parcels: Sequence[Table]) -> Theme | None:
    values = _pooled(parcels, "frontage_m")
    if not len(values):
        return None
    some = values[values > 0.0]
    top = float(np.round(np.quantile(some, 0.95), 3)) if len(some) else 1.0
    step = round_up(top / CLASSES)
    steps = [step * k for k in range(1, max(math.ceil(top / step), 2))]
    texts = [number(s) for s in steps]
    labels = ["none", f"up to {texts[0]} m", *[f"{t} m" for t in _ranges(texts)]]
    labels.append(f"{texts[-1]} m and more")
    fills = [HATCHED, *_spread(COOL, len(labels) - 1)]

    def sentence(table: Table) -> str:
        frontage = np.asarray(table["frontage_m"], dtype=np.float64)
        none = int((np.round(frontage, 3) <= 0.0).sum())
        median = with_unit(float(np.median(frontage)), "m", 1)
        who = f"{_of(none, table)} have no" if none else f"All {len(table):,} parcels have some"
        return f"{who} frontage{' at all' if none else ''}; the median is {median}."

    return Theme(
        "frontage",
        "Frontage",
        "parcels",
        "frontage_m",
        tuple(MapClass(text, fill) for text, fill in zip(labels, fills, strict=True)),
        _classed("frontage_m", [1e-3, *steps], 0),
        sentence,
        "Length of a parcel's boundary on streets.",
    )


def _level(parcels: Sequence[Table]) -> Theme | None:
    values = _pooled(parcels, "level")
    if not len(values):
        return None
    low, high = int(values.min()), int(values.max())
    step = -(-(high - low + 1) // len(COOL))
    starts = list(range(low, high + 1, step))
    ends = [min(start + step - 1, high) for start in starts]
    labels = [str(a) if a == b else f"{a} to {b}" for a, b in zip(starts, ends, strict=True)]
    classes = [MapClass(t, f) for t, f in zip(labels, _spread(COOL, len(labels)), strict=True)]

    def sentence(table: Table) -> str:
        known = _pooled([table], "level")
        if not len(known):
            return "How many cuts made the parcels is not known."
        fewest, most = round(known.min()), round(known.max())
        cuts = counted(most, "cut") if fewest == most else f"{fewest} to {most} cuts"
        return f"Parcels were made by {cuts} each."

    return Theme(
        "level",
        "Level",
        "parcels",
        "level",
        (*classes, MapClass("not known", HATCHED)),
        _classed("level", starts[1:], len(classes)),
        sentence,
        "How many times the land was cut in two until a parcel was left.",
    )


def _undesirable(parcels: Sequence[Table]) -> Theme | None:
    if not len(_pooled(parcels, "undesirable")):
        return None

    def sentence(table: Table) -> str:
        return f"{_of(int(np.sum(table['undesirable'])), table)} are undesirable."

    return Theme(
        "undesirable",
        "Undesirable parcels",
        "parcels",
        "undesirable",
        (MapClass("desirable", PALE), MapClass("undesirable", BAD)),
        _classed("undesirable", [0.5], 0),
        sentence,
        "Those with a mean deviation of corners from 90° above 15°, or a smallest rectangle "
        "above 1.2 times their area (Yang 2013, Fig. 12).",
    )


def _land_use(parcels: Sequence[Table]) -> Theme | None:
    uses = _by_weight(parcels, "land_use", "area_m2")
    if len(uses) < 2:
        return None
    fixed = {PARCEL_USE: PLAIN, PATIO_USE: PATIO, REMNANT_USE: REMNANT}
    fixed |= dict.fromkeys(sorted(PARK_USES), PARK)
    more = [use for use in uses if use not in fixed][: len(USES) - 1]
    fills = {**fixed, **dict(zip(more, USES, strict=False))}
    shown = [use for use in uses if use in fills]
    classes = [MapClass(use, fills[use]) for use in shown]
    if len(shown) < len(uses):
        classes.append(MapClass(OTHER, USES[-1]))
    return Theme(
        "land-use",
        "Land use",
        "parcels",
        "land_use",
        tuple(classes),
        _named("land_use", shown),
        lambda table: f"{counted(len(set(map(str, table['land_use']))), 'land use')}.",
    )


def _street_classes(streets: Sequence[Table]) -> Theme | None:
    names = _by_weight(streets, "class", "length_m")
    if not names:
        return None
    shown = names if len(names) <= len(LINES) else names[: len(LINES) - 1]
    classes = [MapClass(name, LINES[k]) for k, name in enumerate(shown)]
    if len(shown) < len(names):
        classes.append(MapClass(OTHER, LINES[-1]))

    def sentence(table: Table) -> str:
        length = with_unit(float(np.sum(table["length_m"])) / 1000, "km", 1)
        return f"{length} of streets, those along the edge of the land included."

    return Theme(
        "streets",
        "Streets by class",
        "streets",
        "class",
        tuple(classes),
        _named("class", shown),
        sentence,
    )


def _block_area(blocks: Sequence[Table]) -> Theme | None:
    areas = _pooled(blocks, "area_m2")
    if not len(areas):
        return None
    low, high = np.round(np.quantile(areas, (0.05, 0.95)), 3).tolist()
    edges = round_edges(low, high)
    hectares = (edges[-1] if edges else high) >= HECTARE
    unit, size = ("ha", HECTARE) if hectares else ("m²", 1.0)
    texts = [f"{edge / size:,g}" for edge in edges]
    labels = [f"about {with_unit(high / size, unit)}"]
    if edges:
        between = [f"{text} {unit}" for text in _ranges(texts)]
        labels = [f"under {texts[0]} {unit}", *between, f"{texts[-1]} {unit} and more"]

    def sentence(table: Table) -> str:
        known = np.asarray(table["area_m2"], dtype=np.float64)
        middle = with_unit(float(np.median(known)) / size, unit)
        return f"{counted(len(table), 'block')}; half of them are larger than {middle}."

    return Theme(
        "blocks",
        "Blocks by area",
        "blocks",
        "area_m2",
        # the two darkest are hard to tell apart on large areas
        tuple(MapClass(t, f) for t, f in zip(labels, _spread(COOL[:-1], len(labels)), strict=True)),
        _classed("area_m2", edges, 0),
        sentence,
        "Land that streets enclose, or streets and the boundary of the land; its area reaches to "
        "the middle of the streets.",
    )


def round_edges(low: float, high: float) -> list[float]:
    """Return round numbers between two that part values of that range, `MOST_EDGES` at most.

    They grow by factors where the range is wide, and by steps where it is not.

    >>> round_edges(900.0, 60000.0), round_edges(410.0, 690.0), round_edges(5.0, 5.0)
    ([1000.0, 2000.0, 5000.0, 10000.0, 20000.0, 50000.0], [450.0, 500.0, 550.0, 600.0, 650.0], [])
    """
    if not 0.0 < low < high * (1 - NARROW):
        return []
    if high < WIDE * low:
        step = round_up((high - low) / MOST_EDGES)
        first, last = math.floor(low / step + 1e-9) + 1, math.ceil(high / step - 1e-9)
        return [step * k for k in range(first, last)]
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found: list[float] = []
    for steps in ((1, 2, 5), (1, 3), (1,)):
        found = [s * 10.0**p for p in powers for s in steps if low <= s * 10.0**p <= high]
        if len(found) <= MOST_EDGES:
            break
    return found[-MOST_EDGES:]


def _by_weight(tables: Sequence[Table], column: str, weight: str) -> list[str]:
    """Texts of a column, those of the largest weight first."""
    total: dict[str, float] = {}
    for table in tables:
        if column not in table.columns:
            continue
        for text, w in zip(map(_text, table[column]), table[weight].tolist(), strict=True):
            total[text] = total.get(text, 0.0) + w
    return sorted(total, key=lambda text: (-round(total[text], 3), text))


def _named(column: str, names: Sequence[str]) -> Callable[[Table], IntArray]:
    """Return what finds the row of texts among names; the row after the last for all others."""
    row = {name: k for k, name in enumerate(names)}

    def class_of(table: Table) -> IntArray:
        texts = map(_text, table.columns.get(column, np.full(len(table), None)))
        return np.array([row.get(text, len(names)) for text in texts], dtype=np.int64)

    return class_of


def _text(value: object) -> str:
    return str(value) if value is not None and value != "" else "not known"


def _of(n: int, table: Table) -> str:
    return f"{n:,} of {counted(len(table), 'parcel')} ({share(n, len(table))})"


def _ranges(texts: Sequence[str]) -> list[str]:
    """Ranges between texts that follow one another."""
    return [f"{a} to {b}" for a, b in itertools.pairwise(texts)]


def _spread(colours: Sequence[str], n: int) -> list[str]:
    """Choose n colours from light to dark."""
    places = np.round(np.linspace(0, len(colours) - 1, n)).astype(int) if n > 1 else [0]
    return [colours[k] for k in places]


def round_up(value: float) -> float:
    """Return the next number of 1, 2, 2.5 or 5 times a power of ten.

    >>> round_up(31.0), round_up(0.21), round_up(5.0)
    (50.0, 0.25, 5.0)
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    step = next(s for s in (1.0, 2.0, 2.5, 5.0, 10.0) if value <= s * power * (1 + 1e-9))
    return step * power
