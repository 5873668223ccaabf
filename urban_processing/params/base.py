"""Declared parameters: one declaration feeds the library, the command line and QGIS."""

from __future__ import annotations

import dataclasses
import difflib
import enum
import math
import types
import typing
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Self

from urban_processing.errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class Param:
    """What a parameter means, its unit and its limits (inclusive unless said otherwise)."""

    help: str
    label: str
    """Readable name, as in dialogs."""
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    above: float | None = None
    advanced: bool = False
    group: str = ""
    per_feature: bool = False
    """Whether a column of that name in the main input overrides the value, feature by feature."""
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Readable labels of an enum's values."""


@dataclass(frozen=True, kw_only=True)
class ParamField:
    """A parameter as the shells see it."""

    name: str
    kind: type
    """`bool`, `int`, `float`, `str` or a subclass of `enum.StrEnum`."""
    optional: bool
    default: Any
    param: Param


@dataclass(frozen=True, kw_only=True)
class Params:
    """Base of the frozen parameter dataclasses.

    Every field is annotated `Annotated[type, Param(...)]`. All the mistakes of one call are
    collected and raised together as one `ParameterError`.
    """

    def __post_init__(self) -> None:
        problems = self._convert(option_name)
        if problems:
            raise ParameterError(problems)

    def _convert(self, called: Naming) -> list[str]:
        """Convert the values to their declared types; return what is wrong with them."""
        problems: list[str] = []
        for field in self.fields():
            value = _converted(field, getattr(self, field.name), called(field.name), problems)
            object.__setattr__(self, field.name, value)
        return problems + self.contradictions(called)

    def contradictions(self, called: Naming) -> list[str]:
        """Return one sentence for each set of values that do not go together.

        Called even where single values are wrong, so that everything is reported at once: a
        value of the wrong kind stands there as NaN (a number) or as its default. `called`
        gives the name of a parameter as the user knows it.
        """
        del called
        return []

    def contradictions_with(self, layers: Collection[str], called: Naming) -> list[str]:
        """Return one sentence for each contradiction between values and the layers given.

        Parameters
        ----------
        layers
            Names of the optional inputs that were given.
        called
            Gives the name of a parameter or an input as the user knows it.
        """
        del layers, called
        return []

    @classmethod
    def fields(cls) -> tuple[ParamField, ...]:
        """Return the declared parameters in order."""
        return _fields_of(cls)  # type: ignore[arg-type]  # classes are hashable, whatever theirs are

    @classmethod
    def from_values(cls, values: Mapping[str, Any], layers: Collection[str] = ()) -> Self:
        """Create an instance from values by name; unknown names are mistakes like others.

        Raises
        ------
        ParameterError
            With one sentence for each mistake.
        """
        problems = cls.problems_with(values, layers=layers)
        if problems:
            raise ParameterError(problems)
        return cls(**values)

    @classmethod
    def usable(cls, values: Mapping[str, Any]) -> Self | None:
        """Create an instance that layers are read with; None where a value is wrong.

        What is wrong is told by `from_values`, together with what is wrong with the layers.
        """
        return None if cls.problems_with(values) else cls(**values)

    @classmethod
    def problems_with(
        cls,
        values: Mapping[str, Any],
        called: Naming | None = None,
        layers: Collection[str] = (),
    ) -> list[str]:
        """Return the sentences that creating an instance from `values` would raise.

        Parameters
        ----------
        values
            Values by name.
        called
            Gives the name of a parameter as the user knows it; by default `option_name`.
        layers
            Names of the optional inputs that were given.
        """
        named = called or option_name
        fields = cls.fields()
        known = {field.name for field in fields}
        unknown = [_unknown(name, known) for name in values if name not in known]
        draft = object.__new__(cls)
        for field in fields:
            object.__setattr__(draft, field.name, values.get(field.name, field.default))
        return [*unknown, *draft._convert(named), *draft.contradictions_with(layers, named)]

    def as_dict(self) -> dict[str, Any]:
        """Return the values as plain JSON types."""
        out: dict[str, Any] = {}
        for field in self.fields():
            value = getattr(self, field.name)
            out[field.name] = value.value if isinstance(value, enum.Enum) else value
        return out

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some values changed, validated again."""
        return dataclasses.replace(self, **changes)


Naming = Callable[[str], str]
"""Gives the name of a parameter as the user knows it."""


@cache
def _fields_of(cls: type[Params]) -> tuple[ParamField, ...]:
    hints = typing.get_type_hints(cls, include_extras=True)
    return tuple(_field(f.name, hints[f.name], f.default) for f in dataclasses.fields(cls))


def _field(name: str, hint: Any, default: Any) -> ParamField:
    kind, param = typing.get_args(hint)[:2]
    optional = False
    if isinstance(kind, types.UnionType):
        options = [a for a in typing.get_args(kind) if a is not type(None)]
        optional = True
        (kind,) = options
    return ParamField(name=name, kind=kind, optional=optional, default=default, param=param)


def option_name(name: str) -> str:
    """Return the name of a parameter as a user writes it: `min_area` -> `min-area`."""
    return name.replace("_", "-")


def _unknown(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name.replace("-", "_"), sorted(known), n=1)
    hint = f" Did you mean {option_name(close[0])}?" if close else ""
    return f"There is no parameter {option_name(name)}.{hint}"


def _converted(field: ParamField, value: Any, name: str, problems: list[str]) -> Any:
    """Return `value` as the declared type; append to `problems` what is wrong with it."""
    if value is None:
        if not field.optional:
            problems.append(f"{name} is missing.")
            return field.default
        return None
    if issubclass(field.kind, enum.Enum):
        try:
            return field.kind(value)
        except ValueError:
            choices = ", ".join(str(m.value) for m in field.kind)
            problems.append(f"{name} must be one of {choices}; got {value!r}.")
            return field.default
    if field.kind is bool or field.kind is str:
        if not isinstance(value, field.kind):
            problems.append(f"{name} must be {field.kind.__name__}; got {value!r}.")
            return field.default
        return value
    return _number(field, value, name, problems)


def _number(field: ParamField, value: Any, name: str, problems: list[str]) -> float | int:
    """Return `value` as a number inside its limits, NaN where it is no such number."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        problems.append(f"{name} must be a number; got {value!r}.")
        return math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        problems.append(f"{name} must be a finite number; got {value}.")
        return math.nan
    if field.kind is int and number != math.floor(number):
        problems.append(f"{name} must be a whole number; got {value}.")
        return math.nan
    problems += _limits_broken(field.param, number, value, name)
    if field.kind is float:
        return number
    decimal_text = isinstance(value, str) and not value.strip().lstrip("+-").isdigit()
    return int(number) if decimal_text else int(value)


def _limits_broken(param: Param, number: float, value: Any, name: str) -> list[str]:
    unit = f" {param.unit}" if param.unit else ""
    problems = []
    if param.above is not None and number <= param.above:
        problems.append(f"{name} must be above {param.above:g}{unit}; got {value}.")
    if param.minimum is not None and number < param.minimum:
        problems.append(f"{name} must be at least {param.minimum:g}{unit}; got {value}.")
    if param.maximum is not None and number > param.maximum:
        problems.append(f"{name} must be at most {param.maximum:g}{unit}; got {value}.")
    return problems
