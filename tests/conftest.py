"""Fixtures that several rooms share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

SAMPLES = Path(__file__).resolve().parents[1] / "sample_data"


@pytest.fixture(scope="session")
def sample() -> Callable[[str], Path]:
    """Path of a sample boundary by its name."""

    def find(name: str) -> Path:
        path = SAMPLES / f"{name}.gpkg"
        if not path.exists():
            pytest.skip(f"{path} is not there")
        return path

    return find
