"""The moments of a session: a tree, since what was undone stays as a branch."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

from urban_processing.session.edits import Edit, Finish, TakeStep
from urban_processing.session.moment import Moment

KEPT = 64
"""So many moments are kept that were asked for last, besides the beginning and the ends of levels;
others are made again when they are asked for."""


@dataclass
class Entry:
    """One edit and the moment after it.

    Parameters
    ----------
    edit
        What was done; None at the beginning.
    before
        Number of the entry before; -1 at the beginning.
    sentence
        What was done, in words.
    moment
        The moment after it, where it is kept.
    """

    edit: Edit | None
    before: int
    sentence: str
    moment: Moment | None


@dataclass
class Timeline:
    """Entries by number, the one that is now, and which one redo leads to from each."""

    entries: list[Entry]
    now: int = 0
    ahead: dict[int, int] = field(default_factory=dict)
    used: dict[int, None] = field(default_factory=dict)
    """Entries whose moments may be dropped, those used last at the end."""

    @classmethod
    def beginning(cls, moment: Moment, sentence: str) -> Timeline:
        """A timeline with nothing done yet."""
        return cls([Entry(None, -1, sentence, moment)])

    def copy(self) -> Timeline:
        """Return a timeline with the same entries that goes on by itself."""
        entries = list(map(copy.copy, self.entries))
        return Timeline(entries, self.now, dict(self.ahead), dict(self.used))

    def add(self, edit: Edit, moment: Moment, sentence: str) -> None:
        """Go on from now with an edit."""
        self.entries.append(Entry(edit, self.now, sentence, moment))
        self.ahead[self.now] = len(self.entries) - 1
        self.now = len(self.entries) - 1
        self._use(self.now)

    def path(self, number: int | None = None) -> list[int]:
        """Numbers of the entries from the beginning to one of them, by default to now."""
        at = self.now if number is None else number
        line = []
        while at >= 0:
            line.append(at)
            at = self.entries[at].before
        return line[::-1]

    def last(self) -> int:
        """Number of the entry that redo leads to in the end, from now."""
        at = self.now
        while at in self.ahead:
            at = self.ahead[at]
        return at

    def tips(self) -> list[int]:
        """Numbers of the entries after which nothing was done: the end of each branch."""
        followed = {entry.before for entry in self.entries}
        return [number for number in range(len(self.entries)) if number not in followed]

    def go_to(self, number: int) -> None:
        """Make another entry the one that is now; redo leads along the way to it."""
        line = self.path(number)
        self.ahead.update(pairwise(line))
        self.now = number

    def moment(self, number: int, apply: Callable[[Moment, Edit], Moment]) -> Moment:
        """The moment after an entry, made again from the nearest one that is kept."""
        missing = []
        at = number
        while (moment := self.entries[at].moment) is None:
            missing.append(at)
            at = self.entries[at].before
        for later in reversed(missing):
            edit = self.entries[later].edit
            if edit is not None:
                moment = self.entries[later].moment = apply(moment, edit)
                self._use(later)
        self._use(number)
        return moment

    def _use(self, number: int) -> None:
        """Note that a moment was used, and drop the one that was not used for the longest time."""
        edit = self.entries[number].edit
        if edit is None or isinstance(edit, TakeStep | Finish):
            return
        self.used.pop(number, None)
        self.used[number] = None
        if len(self.used) > KEPT:
            oldest = next(iter(self.used))
            del self.used[oldest]
            self.entries[oldest].moment = None
