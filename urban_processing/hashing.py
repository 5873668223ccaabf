"""Random numbers by hashing, so that a parcel's draws depend on its own path alone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

UintArray = npt.NDArray[np.uint64]

_MASK = 2**64 - 1


def splitmix64(values: UintArray) -> UintArray:
    """Mix 64-bit integers (Steele et al. 2014, SplitMix); vectorised, no state."""
    z = values + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform(seed: int, lineage: UintArray, n_draws: int) -> npt.NDArray[np.float64]:
    """(len(lineage), n_draws) numbers in [0, 1), a function of seed and lineage alone."""
    key = splitmix64(np.atleast_1d(np.array(seed % 2**64, dtype=np.uint64)))
    start = splitmix64(lineage ^ key)
    count = np.arange(1, n_draws + 1).astype(np.uint64)
    draws = splitmix64(np.asarray(start[:, None] + count, dtype=np.uint64))
    return np.asarray((draws >> np.uint64(11)).astype(np.float64) * 2.0**-53)


def mix(value: int) -> int:
    """Mix one 64-bit integer as `splitmix64` does, without an array."""
    z = (value + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)


def child(parent: int, rank: int) -> int:
    """Return the lineage of the part of a thing that has a rank among its parts."""
    return mix(parent ^ mix(rank + 1))


def unmixed(values: UintArray) -> UintArray:
    """Return what `splitmix64` mixed: it maps the 64-bit integers one to one."""
    z = _unshifted(values, 31) * np.uint64(_inverse(0x94D049BB133111EB))
    z = _unshifted(z, 27) * np.uint64(_inverse(0xBF58476D1CE4E5B9))
    return _unshifted(z, 30) - np.uint64(0x9E3779B97F4A7C15)


def _unshifted(values: UintArray, bits: int) -> UintArray:
    """Solve ``z ^ (z >> bits) == values`` for z."""
    z = values
    for _ in range(64 // bits):
        z = values ^ (z >> np.uint64(bits))
    return z


def _inverse(odd: int) -> int:
    return pow(odd, -1, _MASK + 1)
