"""The examples in docstrings give what they say."""

from __future__ import annotations

import doctest
import importlib
import importlib.util
import pkgutil
from pathlib import Path

import pytest

import urban_processing

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(urban_processing.__path__, "urban_processing.")
    if not module.name.endswith("__main__")
)


def _has_examples(name: str) -> bool:
    spec = importlib.util.find_spec(name)
    return spec is not None and spec.origin is not None and ">>> " in Path(spec.origin).read_text()


@pytest.mark.parametrize("name", [name for name in MODULES if _has_examples(name)])
def test_examples_of(name: str) -> None:
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0
