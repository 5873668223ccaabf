"""What the presets of `cogenerate` decide."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Preset(enum.StrEnum):
    """Which weights and rules to start from."""

    RECOMMENDED = "recommended"
    CHEN2024 = "chen2024"


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What a preset decides; not for users to mix.

    Parameters
    ----------
    weights
        λ1, λ2, λ3 of Chen 2024, Eq. 2.
    size_cap
        Qsize counts as full from this ratio of the smaller to the larger half on.
    continuity
        Default weight of continuing a neighbour's cut (Yang 2013, section 5).
    clearance
        Penalty on cuts that run close to the boundary: they leave slivers at notches.
    variation
        Size of a random addition to the quality of cuts: seeds choose among near equals.
    prospect
        Weight of the parcels that later cuts can make of a half, in rating its proportions;
        0 rates the half's own proportions.
    recut
        Whether irregular parcels are joined with a neighbour and cut again in the end.
    aligned_seeds
        Also seed at the centroid, beside reflex corners and where neighbours' cuts end.
    snap
        Distance, relative to √area, within which a cut's end is moved to a parcel corner.
    look_ahead
        Number of street accesses whose connection is simulated; 1 takes the shortest.
    small_block
        Cost of each parcel that a new block has less than five.
    """

    weights: tuple[float, float, float]
    size_cap: float
    continuity: float
    clearance: float
    variation: float
    prospect: float
    recut: bool
    aligned_seeds: bool
    snap: float
    look_ahead: int
    small_block: float


RULES: dict[Preset, Rules] = {
    Preset.RECOMMENDED: Rules(
        weights=(0.3, 0.9, 0.1),
        size_cap=0.7,
        continuity=0.05,
        clearance=0.4,
        variation=0.01,
        prospect=3.0,
        recut=True,
        aligned_seeds=True,
        snap=0.08,
        look_ahead=6,
        small_block=2.0,
    ),
    Preset.CHEN2024: Rules(
        weights=(0.3, 0.5, 0.2),
        size_cap=1.0,
        continuity=0.0,
        clearance=0.0,
        variation=0.0,
        prospect=0.0,
        recut=False,
        aligned_seeds=False,
        snap=0.0,
        look_ahead=1,
        small_block=0.0,
    ),
}
"""The paper's preset has the weights and terms of Eq. 2, free seeds, and the shortest I- or
L-shaped access, as printed in section 4. What a layout cannot do without stays in both presets:
straight halvings of the last parcels and a thorough second try (else cutting stops early),
checks of every half and of every merged edge, and the clean-up of streets that nobody needs. The
recommended preset is what was measured to make better layouts."""
