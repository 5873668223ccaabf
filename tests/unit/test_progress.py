"""Progress: views of a range, and stopping."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from urban_processing.errors import Cancelled
from urban_processing.progress import SILENT, CallbackProgress

fractions = st.floats(min_value=0, max_value=1)


def test_silent_says_nothing() -> None:
    SILENT.update(0.5, "half")
    SILENT.warn("careful")
    assert SILENT.slice(0.2, 0.4).on_update is None


@given(a=fractions, b=fractions, c=fractions, d=fractions, f=fractions)
def test_slices_of_slices_stay_in_their_range(
    a: float, b: float, c: float, d: float, f: float
) -> None:
    seen: list[float] = []
    whole = CallbackProgress(on_update=lambda fraction, _message: seen.append(fraction))
    (a, b), (c, d) = sorted((a, b)), sorted((c, d))
    whole.slice(a, b).slice(c, d).update(f)
    assert a - 1e-12 <= seen[0] <= b + 1e-12
    assert seen[0] == pytest.approx(a + (b - a) * (c + (d - c) * f))


def test_fractions_beyond_the_ends_are_clipped() -> None:
    seen: list[float] = []
    half = CallbackProgress(on_update=lambda fraction, _message: seen.append(fraction)).slice(
        0, 0.5
    )
    half.update(-3)
    half.update(7)
    assert seen == [0.0, 0.5]


def test_warnings_pass_through_slices() -> None:
    said: list[str] = []
    CallbackProgress(on_warning=said.append).slice(0, 0.1).warn("careful")
    assert said == ["careful"]


def test_an_update_may_stop_the_run() -> None:
    def stop(_fraction: float, _message: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        CallbackProgress(on_update=stop).slice(0, 0.5).update(0.1)
