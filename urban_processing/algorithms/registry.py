"""The list of algorithms."""

from __future__ import annotations

import difflib

from urban_processing.algorithms.blocks import BLOCKS
from urban_processing.algorithms.calibrate import CALIBRATE
from urban_processing.algorithms.cogenerate import COGENERATE
from urban_processing.algorithms.compare import COMPARE
from urban_processing.algorithms.edit import EDIT
from urban_processing.algorithms.export import EXPORT
from urban_processing.algorithms.measure import MEASURE
from urban_processing.algorithms.optimize import OPTIMIZE
from urban_processing.algorithms.resume import RESUME
from urban_processing.algorithms.spec import AlgorithmSpec
from urban_processing.algorithms.subdivide import SUBDIVIDE
from urban_processing.algorithms.transfer import TRANSFER_SPEC
from urban_processing.errors import ParameterError

_SPECS = (
    COGENERATE,
    EDIT,
    RESUME,
    OPTIMIZE,
    BLOCKS,
    SUBDIVIDE,
    CALIBRATE,
    TRANSFER_SPEC,
    MEASURE,
    COMPARE,
    EXPORT,
)


def specs() -> tuple[AlgorithmSpec, ...]:
    """Return all algorithms in the order in which shells show them."""
    return _SPECS


def get(name: str) -> AlgorithmSpec:
    """Return the algorithm of that name.

    Raises
    ------
    ParameterError
        If there is none.

    Examples
    --------
    >>> get("cogenerate").title
    'Co-generate parcels and streets'
    """
    known = {spec.name: spec for spec in specs()}
    if name in known:
        return known[name]
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]}?" if close else ""
    raise ParameterError(f"There is no algorithm {name!r}.{hint} There are: {', '.join(known)}.")
