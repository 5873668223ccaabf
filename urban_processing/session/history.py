"""What was done in a session: back, forth and along branches."""

from __future__ import annotations

from urban_processing.errors import EditError
from urban_processing.pipelines.levels import with_streets
from urban_processing.progress import SILENT, Progress
from urban_processing.session.edits import Edit
from urban_processing.session.model import Branch, Change
from urban_processing.session.moment import Moment, next_moment
from urban_processing.session.requirements import check
from urban_processing.session.streets_laid import streets_laid
from urban_processing.session.timeline import Timeline


class History:
    """Edits and the moments after them; the part of a session that knows nothing of edits."""

    def __init__(self, moment: Moment, sentence: str) -> None:
        self._timeline = Timeline.beginning(moment, sentence)

    @property
    def _moment(self) -> Moment:
        return self._timeline.moment(self._timeline.now, self._after)

    @staticmethod
    def _after(moment: Moment, edit: Edit) -> Moment:
        return _applied(moment, edit, SILENT)[0]

    def _do(self, edit: Edit, progress: Progress = SILENT) -> Change:
        before = self._moment
        after, sentence = _applied(before, edit, progress)
        self._timeline.add(edit, after, sentence)
        before.cuts.clear()  # they take memory, and are found again if somebody comes back
        return _change(before, after, sentence)

    @property
    def edits(self) -> tuple[Edit, ...]:
        """What was done, from the beginning to now."""
        entries = (self._timeline.entries[number].edit for number in self._timeline.path())
        return tuple(edit for edit in entries if edit is not None)

    @property
    def sentence(self) -> str:
        """What was done last."""
        return self._timeline.entries[self._timeline.now].sentence

    @property
    def can_undo(self) -> bool:
        """Whether something was done."""
        return self._timeline.now > 0

    @property
    def can_redo(self) -> bool:
        """Whether something was undone here."""
        return self._timeline.now in self._timeline.ahead

    def undo(self) -> Change:
        """Go back to before the last edit; where there is none, nothing happens."""
        entry = self._timeline.entries[self._timeline.now]
        if entry.before < 0:
            return Change("Nothing was done that could be undone.")
        return self._go_to(entry.before, f"Undone: {_in_clause(entry.sentence)}")

    def redo(self) -> Change:
        """Do again what was undone last; where that is nothing, nothing happens."""
        number = self._timeline.ahead.get(self._timeline.now)
        if number is None:
            return Change("Nothing was undone that could be done again.")
        return self._go_to(number, self._timeline.entries[number].sentence)

    def branches(self) -> tuple[Branch, ...]:
        """The ends of all that was done, also of what was undone and gone on from otherwise."""
        timeline = self._timeline
        last = timeline.last()
        return tuple(
            Branch(
                number=tip,
                sentence=timeline.entries[tip].sentence,
                edits=len(timeline.path(tip)) - 1,
                current=tip == last,
            )
            for tip in timeline.tips()
        )

    def go_to(self, branch: int) -> Change:
        """Go to the end of a branch, by its number."""
        numbers = [each.number for each in self.branches()]
        if branch not in numbers:
            listed = ", ".join(map(str, numbers))
            raise EditError(f"There is no branch {branch}; there are {listed}.")
        return self._go_to(branch, self._timeline.entries[branch].sentence)

    def _go_to(self, number: int, sentence: str) -> Change:
        before = self._moment
        self._timeline.go_to(number)
        return _change(before, self._moment, sentence)


def _applied(before: Moment, edit: Edit, progress: Progress) -> tuple[Moment, str]:
    """The moment after an edit with the streets it needs, and what was done."""
    state, sentence = edit.apply(before, progress)
    if not edit.grows_streets:
        return next_moment(before, state), f"{sentence}."
    grown = with_streets(state)
    after = next_moment(before, grown)
    check(before, after)
    return after, f"{sentence}{streets_laid(state.layout, grown.layout)}."


def _change(before: Moment, after: Moment, sentence: str) -> Change:
    old, new = set(before.parcels), set(after.parcels)
    return Change(sentence, gone=tuple(sorted(old - new)), new=tuple(sorted(new - old)))


def _in_clause(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
