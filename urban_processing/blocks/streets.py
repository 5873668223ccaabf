"""`StreetLines`: centrelines of streets and what is known of each, and how wide they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import UNKNOWN_STREET
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params.blocks import BlocksParams
from urban_processing.site import Frame, Issue
from urban_processing.street_rules import FOOTPATHS, NO_STREETS

StrArray = npt.NDArray[np.str_]

_MAX_NAMED = 5


@dataclass(frozen=True, eq=False)
class StreetLines:
    """n centrelines in local metres, on the grid of all coordinates.

    Parameters
    ----------
    lines
        (n,) LineStrings.
    street_class, name
        (n,) class, such as a value of OpenStreetMap's ``highway``, and name; empty where there is
        none.
    width
        (n,) width in metres of the whole right-of-way; NaN where none is given.
    least_width
        (n,) width that the class is at least to give it, such as for its lanes; NaN for none.
    off_ground
        (n,) bridges and tunnels.
    number
        (n,) number of the street, `UNKNOWN_STREET` where none is given.
    frame
        Where the local coordinates lie on the map.
    issues
        What reading them has to say.
    input_sha256
        Hash of the input, for provenance.
    """

    lines: npt.NDArray[np.object_]
    street_class: StrArray
    name: StrArray
    width: FloatArray
    least_width: FloatArray
    off_ground: BoolArray
    number: IntArray
    frame: Frame = field(default_factory=Frame)
    issues: tuple[Issue, ...] = ()
    input_sha256: str = ""

    def __len__(self) -> int:
        """Return the number of lines."""
        return len(self.lines)

    def take(self, rows: IntArray | BoolArray) -> StreetLines:
        """Return some of the lines."""
        whole = ("frame", "issues", "input_sha256")
        names = [f.name for f in fields(self) if f.name not in whole]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


@dataclass(frozen=True, eq=False)
class StreetsOnLand:
    """Centrelines, and the land whose blocks are wanted.

    Parameters
    ----------
    streets
        Lines in the frame of the land.
    land
        Polygons, the largest first; None where blocks are what streets enclose.
    """

    streets: StreetLines
    land: tuple[shapely.Polygon, ...] | None = None

    @property
    def frame(self) -> Frame:
        """Where the local coordinates lie on the map."""
        return self.streets.frame

    @property
    def issues(self) -> tuple[Issue, ...]:
        """What reading the streets has to say."""
        return self.streets.issues


def street_lines(
    lines: npt.ArrayLike,
    *,
    width: npt.ArrayLike = np.nan,
    street_class: npt.ArrayLike = "",
    name: npt.ArrayLike = "",
) -> StreetLines:
    """Return lines with what is known of them, one value for each or one for all.

    >>> import shapely
    >>> len(street_lines([shapely.LineString([(0, 0), (9, 0)])], width=12))
    1
    """
    geometry = np.asarray(lines, dtype=object)
    n = len(geometry)
    return StreetLines(
        lines=geometry,
        street_class=np.array(np.broadcast_to(street_class, n), dtype=np.str_),
        name=np.array(np.broadcast_to(name, n), dtype=np.str_),
        width=np.array(np.broadcast_to(width, n), dtype=np.float64),
        least_width=np.full(n, np.nan),
        off_ground=np.zeros(n, dtype=bool),
        number=np.full(n, UNKNOWN_STREET),
    )


def chosen_streets(streets: StreetLines, params: BlocksParams) -> tuple[StreetLines, list[Issue]]:
    """Give every line its width, and leave out those that are no streets.

    The lines come in an order of their own, whatever that of the input and the direction in which
    they were drawn.

    Returns
    -------
    streets
        Lines all of whose widths are known.
    issues
        What was left out or assumed.
    """
    issues = _without_street(streets, params)
    banned = NO_STREETS if params.footpaths else NO_STREETS | FOOTPATHS
    out = np.isin(streets.street_class, sorted(banned))
    if out.any():
        named = ", ".join(np.unique(streets.street_class[out]).tolist())
        message = f"{int(out.sum())} line(s) are no streets for vehicles ({named}) and count not."
        issues.append(Issue("no_streets", message, value=float(out.sum())))
    kept = streets.take(~out)
    table = params.width_m
    nominal = np.array([table.get(c, np.nan) for c in kept.street_class.tolist()])
    by_class = np.fmax(nominal, kept.least_width)
    unknown = np.isnan(kept.width) & np.isnan(by_class)
    if unknown.any():
        message = (
            f"{int(unknown.sum())} street line(s) have neither a width nor a class of known width"
            f"{_named_classes(kept.street_class[unknown])}: {params.default_width:g} m are taken."
        )
        issues.append(
            Issue("width_assumed", message, value=float(unknown.sum()), limit=params.default_width)
        )
    width = np.where(np.isnan(kept.width), by_class, kept.width)
    width = np.where(unknown, params.default_width, width)
    issues += _off_ground(kept)
    return _in_order(kept, width), issues


def _named_classes(classes: StrArray) -> str:
    """Classes in brackets, the most frequent first; nothing where there are none."""
    count = Counter(name for name in classes.tolist() if name)
    names = sorted(count, key=lambda name: (-count[name], name))
    return f" ({_listed(names)})" if names else ""


def _without_street(streets: StreetLines, params: BlocksParams) -> list[Issue]:
    """Say for which classes a width was given that no street has, and what may be meant."""
    there = np.unique(streets.street_class).tolist()
    unused = [name for name in params.own_width_m if name not in there]
    if not unused:
        return []
    likely = [get_close_matches(name, there, n=1) for name in unused]
    said = [
        f"{name} (is {like[0]} meant?)" if like else name
        for name, like in zip(unused, likely, strict=True)
    ]
    message = f"Widths were given for classes that no street has: {_listed(said)}."
    return [Issue("class_widths_unused", message, value=float(len(unused)))]


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MAX_NAMED} more" if len(names) > _MAX_NAMED else ""
    return ", ".join(names[:_MAX_NAMED]) + more


def _off_ground(streets: StreetLines) -> list[Issue]:
    n = int(streets.off_ground.sum())
    if not n:
        return []
    message = (
        f"{n} line(s) are bridges or tunnels: they take land and meet other streets as if they "
        "lay on the ground. Leave them out of the input where they should not."
    )
    return [Issue("bridges_on_ground", message, value=float(n))]


def _in_order(streets: StreetLines, width: FloatArray) -> StreetLines:
    """The lines from their lower end on, sorted by coordinates and then by what is known."""
    lines = shapely.normalize(streets.lines)
    texts = zip(
        shapely.to_wkb(lines, byte_order=1).tolist(),
        width.tolist(),
        streets.street_class.tolist(),
        streets.name.tolist(),
        strict=True,
    )
    keys = list(zip(shapely.bounds(lines).tolist(), texts, strict=True))
    order = np.array(sorted(range(len(keys)), key=keys.__getitem__), dtype=np.int64)
    return replace(streets.take(order), lines=lines[order], width=width[order])
