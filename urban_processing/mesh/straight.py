"""Which arms at a node go straight on into each other: streets and parcel sides go on so."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

STRAIGHT_DEG = 135.0
"""Two edges whose included angle is larger are one street or one side (Chen 2024, section 3)."""

ROUNDED_DIGITS = 6
"""Angles that agree to this many digits of a degree are told apart by the order of the arms."""


def pairs_at_nodes(node: IntArray) -> IntArray:
    """(P, 2) every two arms at the same node; `node` gives the node of each arm, sorted."""
    beyond = np.searchsorted(node, node, side="right") - np.arange(len(node)) - 1
    i = np.repeat(np.arange(len(node)), beyond)
    j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(beyond) - beyond, beyond)
    return np.column_stack([i, j])


def go_on_straight(
    pairs: IntArray, angle: FloatArray, *, n_arms: int, first: BoolArray | None = None
) -> BoolArray:
    """Mark the pairs of arms that continue each other: the straightest first, each arm once.

    Parameters
    ----------
    pairs
        (P, 2) arms.
    angle
        (P,) included angles in degrees, 180 where straight on; only those above
        `STRAIGHT_DEG` continue.
    n_arms
        Number of arms.
    first
        (P,) pairs that are matched before all others.
    """
    rounded = np.round(angle, ROUNDED_DIGITS)
    straight = np.flatnonzero(rounded > STRAIGHT_DEG)
    later = np.zeros(len(straight)) if first is None else ~first[straight]
    straight = straight[np.lexsort((straight, -rounded[straight], later))]
    out = np.zeros(len(pairs), dtype=bool)
    taken = [False] * n_arms
    for pair, (a, b) in zip(straight.tolist(), pairs[straight].tolist(), strict=True):
        if not (taken[a] or taken[b]):
            taken[a] = taken[b] = True
            out[pair] = True
    return out


def included_angle(a: npt.NDArray[np.complex128], b: npt.NDArray[np.complex128]) -> FloatArray:
    """Angle in degrees between directions that leave the same point: 180 where straight on."""
    return np.asarray(np.abs(np.degrees(np.angle(a * np.conj(b)))))
