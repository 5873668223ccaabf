"""Declared parameters: conversion, limits, and all the mistakes of a call together."""

from __future__ import annotations

import dataclasses
import enum
import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from urban_processing.errors import ParameterError
from urban_processing.params import CogenerateParams, Naming, Param, Params, Preset, StreetPattern


class Colour(enum.StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, kw_only=True)
class Sample(Params):
    width: Annotated[float, Param(help="Width.", label="Width", unit="m", above=0, maximum=10)] = (
        2.0
    )
    count: Annotated[int | None, Param(help="Count.", label="Count", minimum=1)] = None
    colour: Annotated[Colour, Param(help="Colour.", label="Colour")] = Colour.RED
    flat: Annotated[bool, Param(help="Flat.", label="Flat")] = False

    def contradictions(self, called: Naming) -> list[str]:
        return ["wide and flat"] if self.flat and self.width > 5 else []


def test_values_are_converted_to_the_declared_types() -> None:
    sample = Sample(width=np.float32(3), count="12", colour="blue")  # type: ignore[arg-type]
    assert (sample.width, sample.count, sample.colour) == (3.0, 12, Colour.BLUE)
    assert [type(v) for v in (sample.width, sample.count)] == [float, int]
    assert sample.as_dict() == {"width": 3.0, "count": 12, "colour": "blue", "flat": False}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width": 0}, "width must be above 0 m; got 0."),
        ({"width": -1.5}, "width must be above 0 m; got -1.5."),
        ({"width": 11}, "width must be at most 10 m; got 11."),
        ({"width": math.nan}, "width must be a finite number; got nan."),
        ({"width": "inf"}, "width must be a finite number; got inf."),
        ({"width": "wide"}, "width must be a number; got 'wide'."),
        ({"width": True}, "width must be a finite number; got True."),
        ({"width": None}, "width is missing."),
        ({"count": 0}, "count must be at least 1; got 0."),
        ({"count": 2.5}, "count must be a whole number; got 2.5."),
        ({"count": 10**400}, f"count must be a number; got {10**400!r}."),
        ({"colour": "green"}, "colour must be one of red, blue; got 'green'."),
        ({"flat": "no"}, "flat must be bool; got 'no'."),
    ],
)
def test_each_mistake_is_one_clear_sentence(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        Sample(**values)
    assert caught.value.problems == (words,)


def test_all_mistakes_are_reported_together() -> None:
    problems = Sample.problems_with(
        {"width": -1, "count": "x", "colour": 3, "flat": None, "colr": "red", "xyz": 1}
    )
    assert len(problems) == 6
    assert problems[0] == "There is no parameter colr. Did you mean colour?"
    assert problems[1] == "There is no parameter xyz."


def test_contradictions_are_reported_beside_single_mistakes() -> None:
    assert Sample.problems_with({"width": 6, "flat": True, "count": 0}) == [
        "count must be at least 1; got 0.",
        "wide and flat",
    ]
    # a value that is no number contradicts nothing
    assert len(Sample.problems_with({"width": "x", "flat": True})) == 1


def test_from_values_gives_the_instance() -> None:
    assert Sample.from_values({"width": "4"}) == Sample(width=4.0)
    with pytest.raises(ParameterError, match="no parameter xyz"):
        Sample.from_values({"xyz": 1})


def test_replace_checks_again() -> None:
    sample = Sample()
    assert sample.replace(width=3).width == 3
    with pytest.raises(ParameterError):
        sample.replace(width=-3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        sample.width = 3  # type: ignore[misc]


@given(seed=st.integers(min_value=0, max_value=2**64))
def test_large_whole_numbers_lose_no_digit(seed: int) -> None:
    assert CogenerateParams(parcels=1, seed=seed).seed == seed
    assert CogenerateParams(parcels=1, seed=str(seed)).seed == seed  # type: ignore[arg-type]


@given(
    values=st.fixed_dictionaries(
        {
            field.name: st.one_of(
                st.none(), st.floats(), st.integers(), st.text(max_size=4), st.booleans()
            )
            for field in CogenerateParams.fields()
        }
    )
)
def test_whatever_is_given_only_parameter_errors_come_out(values: dict[str, Any]) -> None:
    problems = CogenerateParams.problems_with(values)
    assert all(problem.endswith(".") for problem in problems)
    if not problems:
        params = CogenerateParams(**values)
        assert CogenerateParams(**params.as_dict()) == params


def test_one_size_is_needed() -> None:
    both = CogenerateParams.problems_with({"min_area": 400, "parcels": 10})
    neither = CogenerateParams.problems_with({})
    assert both == ["Give min-area or parcels, not both."]
    assert len(neither) == 1
    assert "min-area" in neither[0]
    assert "parcels" in neither[0]


@pytest.mark.parametrize("value", [0, -400, math.nan, math.inf])
def test_min_area_must_be_positive_and_finite(value: float) -> None:
    assert len(CogenerateParams.problems_with({"min_area": value})) == 1


def test_weights_must_not_all_be_zero_or_negative() -> None:
    names = ("weight_size", "weight_regularity", "weight_access")
    zero = CogenerateParams.problems_with({"parcels": 5, **dict.fromkeys(names, 0)})
    assert len(zero) == 1
    assert "all zero" in zero[0]
    assert len(CogenerateParams.problems_with({"parcels": 5, **dict.fromkeys(names, -1)})) == 3


def test_presets_give_the_weights_that_are_not_given() -> None:
    chen = CogenerateParams(parcels=5, preset=Preset.CHEN2024, weight_size=0.9)
    assert chen.weights == (0.9, 0.5, 0.2)
    assert chen.weights != CogenerateParams(parcels=5, weight_size=0.9).weights
    assert chen.pattern is StreetPattern.LOOP


def test_mistakes_are_told_with_the_names_that_the_user_knows() -> None:
    said = CogenerateParams.problems_with({"min_area": -1, "parcels": 3}, lambda name: f"<{name}>")
    assert said == [
        "<min_area> must be above 0 m²; got -1.",
        "Give <min_area> or <parcels>, not both.",
    ]


def test_readable_names_are_unique() -> None:
    labels = [field.param.label for field in CogenerateParams.fields()]
    assert all(labels)
    assert len(set(labels)) == len(labels)
