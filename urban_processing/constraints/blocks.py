"""What of a planar graph stays connected without any one edge."""

from __future__ import annotations

from urban_processing.constraints.linework import Linework


class Blocks:
    """Blocks: sets of vertices that stay connected without any one edge."""

    def __init__(self, work: Linework) -> None:
        self.work = work
        self.out = {v: list(links) for v, links in work.out.items() if links}
        self.bridges = self._find_bridges()
        self.block = self._flood(self.bridges)
        self.component = self._flood(set())
        self.bridges_of: dict[int, list[int]] = {}
        for e in sorted(self.bridges):
            for v in work.ends[e]:
                self.bridges_of.setdefault(self.block[v], []).append(e)

    def _find_bridges(self) -> set[int]:
        """Edges that are the only link between what lies beyond them (Tarjan 1974)."""
        order: dict[int, int] = {}
        low: dict[int, int] = {}
        bridges = set()
        for root in self.out:
            if root in order:
                continue
            order[root] = low[root] = len(order)
            stack = [(root, -1, iter(self.out[root]))]
            while stack:
                v, came, rest = stack[-1]
                for w, e in rest:
                    if e == came:
                        continue
                    if w in order:
                        low[v] = min(low[v], order[w])
                    else:
                        order[w] = low[w] = len(order)
                        stack.append((w, e, iter(self.out[w])))
                        break
                else:
                    stack.pop()
                    if stack:
                        parent = stack[-1][0]
                        low[parent] = min(low[parent], low[v])
                        if low[v] > order[parent]:
                            bridges.add(came)
        return bridges

    def _flood(self, without: set[int]) -> dict[int, int]:
        label: dict[int, int] = {}
        for first in self.out:
            if first in label:
                continue
            label[first] = first
            front = [first]
            for v in front:
                for w, e in self.out[v]:
                    if e not in without and w not in label:
                        label[w] = first
                        front.append(w)
        return label

    def leaves(self) -> list[list[int]]:
        """Vertices of each block of streets that hangs on one bridge, or stands free.

        Street ends, which are blocks of one vertex, come first; all by their coordinates.
        """
        work = self.work
        rooted, with_street = set(), set()
        for e in work.edges():
            v = work.ends[e][0]
            if work.root[e]:
                rooted.add(self.block[v])
            if not work.firm[e]:
                with_street.add(self.component[v])
        members: dict[int, list[int]] = {}
        for v in sorted(self.out, key=lambda v: (work.z[v].real, work.z[v].imag)):
            b = self.block[v]
            n = len(self.bridges_of.get(b, []))
            if b not in rooted and n <= 1 and self.component[v] in with_street:
                members.setdefault(b, []).append(v)
        return sorted(members.values(), key=lambda block: len(block) > 1)
