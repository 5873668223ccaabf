"""The one declaration of every distribution that comparisons hold against each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import FloatArray

HALF_TURN = 180.0
"""Period of bearings of lines, which point both ways."""

LEAST_WEIGHT = 2.0**-40
"""Weights below this share of the largest one count as none."""


@dataclass(frozen=True)
class DistributionSpec:
    """What a distribution is.

    Parameters
    ----------
    name
        Name in tables, with its unit where it has one.
    label
        Readable name.
    unit
        ``m``, ``m²``, ``°`` or nothing for numbers and ratios.
    source
        Paper and place where it comes from, or nothing.
    definition
        What is measured of each thing, in one sentence.
    circular
        Period of values that begin again after it, 0 for all others.
    whole
        Whether values are whole numbers.
    weighted
        Whether things count by their weight; if not, each counts once.
    """

    name: str
    label: str
    unit: str
    source: str
    definition: str
    circular: float = 0.0
    whole: bool = False
    weighted: bool = False


_VANEGAS = "Vanegas 2012, section 6"

DISTRIBUTIONS: tuple[DistributionSpec, ...] = (
    DistributionSpec(
        "block_area_m2",
        "Area of blocks",
        "m²",
        "",
        "Area of a block, to the centreline of streets.",
    ),
    DistributionSpec(
        "block_length_m",
        "Length of blocks",
        "m",
        "",
        "Length of a block: of its longest side, from corner to corner along the boundary.",
    ),
    DistributionSpec(
        "parcel_area_m2",
        "Area of parcels",
        "m²",
        _VANEGAS,
        "Area of a parcel, less right-of-way where that is known.",
    ),
    DistributionSpec(
        "parcel_width_m",
        "Width of parcels",
        "m",
        _VANEGAS,
        "Extent of a parcel along the street side with the longest frontage.",
    ),
    DistributionSpec(
        "parcel_depth_m",
        "Depth of parcels",
        "m",
        "",
        "Extent of a parcel across the street side with the longest frontage.",
    ),
    DistributionSpec(
        "parcel_aspect",
        "Aspect ratio of parcels",
        "",
        _VANEGAS,
        "Longer over shorter side of the smallest rotated rectangle around a parcel.",
    ),
    DistributionSpec(
        "parcel_neighbours",
        "Neighbours of parcels",
        "",
        _VANEGAS,
        "Number of parcels that a parcel shares a line of its boundary with.",
        whole=True,
    ),
    DistributionSpec(
        "parcel_frontage_m",
        "Frontage of parcels",
        "m",
        "",
        "Length of a parcel's boundary on streets.",
    ),
    DistributionSpec(
        "parcel_irregularity",
        "Irregularity of parcels",
        "",
        "Chen 2024, Eq. 1",
        "Irregularity of the approximate polygon of a parcel; 0 for a square.",
    ),
    DistributionSpec(
        "segment_length_m",
        "Length of segments",
        "m",
        "",
        "Length of a segment: a street without the rim from one intersection, dead end or place "
        "on the rim to the next.",
    ),
    DistributionSpec(
        "segment_bearing_deg",
        "Bearing of segments",
        "°",
        "Boeing 2019, Urban spatial order",
        "Direction of a segment from end to end, clockwise from grid north, both ways alike; "
        "weighted by length.",
        circular=HALF_TURN,
        weighted=True,
    ),
    DistributionSpec(
        "street_length_m",
        "Length of streets",
        "m",
        "Chen 2024, Table 1",
        "Length of a street without the rim: of segments that go on in one line.",
    ),
)
"""All distributions, in the order in which tables list them."""


@dataclass(frozen=True, eq=False)
class Sample:
    """The values of one distribution.

    Values that are not finite, and those whose weight is missing or nought, are left out when a
    sample is made; it may be empty.

    Parameters
    ----------
    values
        (n,) values.
    weights
        (n,) weights that are not negative; each value counts once where there are none.

    Raises
    ------
    ValueError
        If there are not as many weights as values, or a weight is negative.

    Examples
    --------
    >>> Sample(np.array([1.0, np.nan, 3.0])).values
    array([1., 3.])
    """

    values: FloatArray
    weights: FloatArray | None = None

    def __post_init__(self) -> None:
        """Leave out what cannot be counted."""
        values = np.array(self.values, dtype=np.float64).ravel()
        kept: npt.NDArray[np.bool_] = np.isfinite(values)
        weights = None
        if self.weights is not None:
            weights = np.array(self.weights, dtype=np.float64).ravel()
            if len(weights) != len(values):
                raise ValueError(f"There are {len(weights)} weights for {len(values)} values.")
            if (weights < 0.0).any():
                raise ValueError("A weight is negative.")
            kept &= np.isfinite(weights)
            largest = float(weights[kept].max(initial=0.0))
            kept &= weights > LEAST_WEIGHT * largest
            weights = weights[kept]
            weights.flags.writeable = False
        values = values[kept]
        values.flags.writeable = False
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "weights", weights)

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self.values)

    @property
    def mean(self) -> float:
        """The mean, weighted where there are weights; NaN of nothing."""
        return float(np.average(self.values, weights=self.weights)) if len(self) else float("nan")

    @property
    def median(self) -> float:
        """The median, weighted where there are weights; NaN of nothing."""
        if not len(self):
            return float("nan")
        if self.weights is None:
            return float(np.median(self.values))
        order = np.argsort(self.values, kind="stable")
        below = np.cumsum(self.weights[order] / self.weights.max())
        half = 0.5 * below[-1]
        low, high = np.searchsorted(below, [half * (1 - 1e-12), half * (1 + 1e-12)])
        return float(0.5 * (self.values[order[low]] + self.values[order[high]]))


EMPTY = Sample(np.empty(0))
"""The sample of a distribution that something does not have."""
