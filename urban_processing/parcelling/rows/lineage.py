"""Seeds of what a seeded thing is divided into, as plain integers."""

from __future__ import annotations

_MASK = 2**64 - 1


def mix(value: int) -> int:
    """Mix a 64-bit integer, as `hashing.splitmix64` does."""
    z = (value + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)


def child(parent: int, rank: int) -> int:
    """Return the seed of the part of a thing that has a rank among its parts."""
    return mix(parent ^ mix(rank + 1))
