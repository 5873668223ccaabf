"""The errors that a user of the library may meet; shells translate them once."""

from __future__ import annotations

from collections.abc import Iterable


class UrbanError(Exception):
    """Base of all errors raised on purpose by this package.

    Parameters
    ----------
    problems
        One sentence for each mistake, saying what is wrong and what to do. All the mistakes
        of one call are reported together.
    """

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems: tuple[str, ...] = (
            (problems,) if isinstance(problems, str) else tuple(problems)
        )
        super().__init__("\n".join(self.problems))


class ParameterError(UrbanError):
    """A parameter is missing, out of range or contradicts another."""


class BoundaryError(UrbanError):
    """The land boundary cannot be used: no polygon, no CRS, non-finite coordinates."""


class OutputError(UrbanError):
    """The result cannot be written where it was asked for."""


class InfeasibleError(UrbanError):
    """What was asked for cannot be reached on this land."""


class EditError(UrbanError):
    """An edit cannot be done, or would break the design requirements; nothing has changed."""


class TopologyError(UrbanError):
    """An invariant of the planar mesh does not hold."""


class DependencyError(UrbanError):
    """An optional package, file or service is not available."""


class Cancelled(UrbanError):
    """The user stopped the run."""

    def __init__(self) -> None:
        super().__init__("Cancelled.")
