"""Classes of network edges and their widths, and kinds of their nodes."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from urban_processing.layout import GivenStreet, Layout
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.street_rules import StreetClass


class NodeKind(enum.IntEnum):
    """What a node of the street network is (Chen 2024, section 3)."""

    POINT = 0
    """The arbitrary start of a ring that no other street meets."""
    END = 1
    JUNCTION = 2
    ENTRY = 3
    """Where the network meets the outside."""


def edge_classes(
    start: IntArray,
    end: IntArray,
    node_kind: IntArray,
    node_degree: IntArray,
    rim: BoolArray,
    level: IntArray,
    fixed: BoolArray,
) -> npt.NDArray[np.str_]:
    """(K,) class of each network edge, by the rule that `StreetNetwork` states."""
    out = np.full(len(start), StreetClass.LOCAL.value, dtype="<U10")
    levels = np.unique(level[~rim & ~fixed])
    if len(levels):
        out[level <= levels[(len(levels) - 1) // 2]] = StreetClass.COLLECTOR.value
    # edges that follow one another at bends lead to the same places
    edges, nodes = np.tile(np.arange(len(start)), 2), np.concatenate([start, end])
    bend = np.flatnonzero((node_degree[nodes] == 2) & ~rim[edges])
    bend = bend[np.argsort(nodes[bend], kind="stable")]
    two = np.flatnonzero(nodes[bend[1:]] == nodes[bend[:-1]])
    run = components(len(start), edges[np.column_stack([bend[two], bend[two + 1]])])
    at_end = (node_kind[start] == NodeKind.END) | (node_kind[end] == NodeKind.END)
    out[np.isin(run, run[at_end])] = StreetClass.CUL_DE_SAC.value
    out[rim] = StreetClass.RIM.value
    return out


def given_classes(
    classes: npt.NDArray[np.str_], given: Sequence[GivenStreet], fixed: IntArray
) -> npt.NDArray[np.str_]:
    """Put in the classes that the user gave, or else *fixed* on streets that are no rim."""
    out = classes.tolist()
    for k in np.flatnonzero(fixed >= 0).tolist():
        plain = StreetClass.RIM if out[k] == StreetClass.RIM else StreetClass.FIXED
        out[k] = given[fixed[k]].street_class or plain.value
    return np.array(out, dtype=np.str_)


def edge_widths(layout: Layout, classes: npt.NDArray[np.str_], fixed: IntArray) -> FloatArray:
    """(K,) width that the user gave a street, else that of its class, or of a fixed street."""
    nominal = layout.street_rules.width_m
    width = [nominal.get(c, nominal[StreetClass.FIXED]) for c in classes.tolist()]
    own = np.array([math.nan, *(street.width for street in layout.fixed_streets)])[fixed + 1]
    return np.where(np.isnan(own), width, own)
