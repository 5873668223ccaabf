"""I- and L-shaped street accesses of a group of parcels (Chen 2024, section 4.2, step 2)."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from urban_processing.streets.state import FAR, StreetState

MISSED = 2.0
"""Cost in parcel sides of each parcel of the group that an access does not reach."""


class Arm(NamedTuple):
    """The first chains of a straight run that leaves a corner, up to one that reaches more."""

    reached: int
    """Parcels reached, as a bit mask over the group."""
    size: float
    chains: tuple[int, ...]


class Access(NamedTuple):
    """Chains that could become the street of a group, in order; compared by rank."""

    rank: tuple[float, ...]
    chains: tuple[int, ...]


def find_accesses(
    state: StreetState,
    group: Sequence[int],
    distance: Sequence[float],
    *,
    keep_ends: bool,
    count: int,
) -> list[Access]:
    """Rank the I- and L-shaped accesses of a group, the best first.

    The shortest that reaches all parcels, an I before an L, else the one that reaches most,
    is the published rule; it holds where the rules look only one access ahead. Otherwise
    accesses are ranked by their length, their turn, the distance of their ends from the
    network and the parcels they miss.

    Parameters
    ----------
    state
        The streets so far.
    group
        Unreached parcels.
    distance
        Distance of every node from the network, in parcel sides.
    keep_ends
        Whether the access needs only one connection.
    count
        Number of accesses wanted.
    """
    bits = {f: 1 << k for k, f in enumerate(group)}
    arms = _arms(state, bits)
    if state.rules.look_ahead == 1:
        options = [
            Access(_published_rank(reached, size, turns), chains)
            for reached, size, turns, chains in _shapes(state, arms)
        ]
    else:
        options = []
        for reached, size, turns, chains in _shapes(state, arms):
            missed = len(group) - reached.bit_count()
            way = _way(state, chains, distance, keep_ends=keep_ends)
            cost = size + turns * state.turn_cost + way + MISSED * missed
            options.append(Access((cost,), chains))
    best = heapq.nsmallest(count, options)
    return best or _any_access(state, group)


def _published_rank(reached: int, size: float, turns: int) -> tuple[float, ...]:
    return (-reached.bit_count(), turns, size)


def _way(
    state: StreetState, chains: Sequence[int], distance: Sequence[float], *, keep_ends: bool
) -> float:
    """Distance in parcel sides that the ends of an access have to the network."""
    first = chains[0]
    nodes = [state.start[first]] + [state.end[i] for i in chains]
    to_network = [0.0 if state.degree[v] else distance[v] for v in nodes]
    if min(to_network) >= FAR:
        return 0.0
    if keep_ends:
        return min(to_network)
    way = to_network[0] + to_network[-1]
    for last in (chains[-1], first ^ 1):
        stuck = not state.ahead[last] and not state.aside[last]
        if stuck and not state.degree[state.end[last]]:
            way += state.unclosed_cost
    return way


def _arms(state: StreetState, bits: dict[int, int]) -> dict[int, list[Arm]]:
    """Arms that begin with each chain along the group, the shorter first."""
    face, street = state.face, state.street
    along = {
        i
        for f in bits
        for j in state.around[f]
        if state.usable[j] and not street[j]
        for i in (j, j ^ 1)
    }
    arms: dict[int, list[Arm]] = {}
    for first in sorted(along):
        grown: list[Arm] = []
        partial: dict[int, float] = {}
        reached, size = 0, 0.0
        chains: list[int] = []
        i = first
        while i >= 0 and i in along and i not in chains:
            chains.append(i)
            size += state.size[i]
            before = reached
            for f in (face[i], face[i ^ 1]):
                bit = bits.get(f, 0)
                if bit and not reached & bit:
                    got = partial.get(f, state.frontage[f]) + state.length[i]
                    partial[f] = got
                    if got >= state.need[f]:
                        reached |= bit
            if reached != before:
                grown.append(Arm(reached, size, tuple(chains)))
            i = state.follow[i]
        if grown:
            arms[first] = grown
    return arms


def _shapes(
    state: StreetState, arms: dict[int, list[Arm]]
) -> Iterator[tuple[int, float, int, tuple[int, ...]]]:
    """All I and L shapes: parcels reached, size, number of turns, chains."""
    for first, grown in arms.items():
        for arm in grown:
            last = arm.chains[-1] ^ 1
            # the same run the other way round comes once only
            if first <= last or last not in arms:
                yield arm.reached, arm.size, 0, arm.chains
    for first, grown in arms.items():
        for second in state.aside[first ^ 1]:
            other = arms.get(second)
            if other is None or (second < first and first in state.aside[second ^ 1]):
                continue
            yield from _corners(grown, other)


def _corners(
    grown: list[Arm], other: list[Arm]
) -> Iterator[tuple[int, float, int, tuple[int, ...]]]:
    """L shapes of two arms: each length of the one with the shortest other that adds all."""
    k = len(other) - 1
    whole = other[-1].reached
    for arm in grown:
        everything = arm.reached | whole
        if everything == arm.reached:
            break
        while k and other[k - 1].reached | arm.reached == everything:
            k -= 1
        back = tuple(i ^ 1 for i in reversed(arm.chains))
        chains = back + other[k].chains
        yield everything, arm.size + other[k].size, 1, chains


def _any_access(state: StreetState, group: Sequence[int]) -> list[Access]:
    """Return the longest open chain of the first parcel for which there is one.

    For parcels that no run of chains reaches alone, since their boundary is broken up.
    """
    for f in group:
        open_ = [i for i in state.around[f] if state.usable[i] and not state.street[i]]
        if open_:
            longest = max(open_, key=lambda i: (state.size[i], -i))
            return [Access((0.0,), (longest,))]
    return []
