"""What Qt 6 wants: every enum by its full name, checked against the classes of this QGIS."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import qgis.core
import qgis.gui
import qgis.PyQt.QtCore
import qgis.PyQt.QtGui
import qgis.PyQt.QtWidgets
import qgis.PyQt.QtXml

LIBRARIES = (
    qgis.core,
    qgis.gui,
    qgis.PyQt.QtCore,
    qgis.PyQt.QtGui,
    qgis.PyQt.QtWidgets,
    qgis.PyQt.QtXml,
)


def names(path: Path) -> dict[str, Any]:
    """Classes of QGIS and Qt that a module imports, by the name it gives them."""
    found = {}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("qgis."):
            for alias in node.names:
                for library in LIBRARIES:
                    if hasattr(library, alias.name):
                        found[alias.asname or alias.name] = getattr(library, alias.name)
    return found


def chains(tree: ast.Module) -> Iterator[list[str]]:
    """``Qgs.A.b`` as ``["Qgs", "A", "b"]``, the longest ones only."""
    inner = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and id(node) not in inner:
            words: list[str] = []
            at: ast.expr = node
            while isinstance(at, ast.Attribute):
                words.insert(0, at.attr)
                at = at.value
            if isinstance(at, ast.Name):
                yield [at.id, *words]


def unscoped(path: Path) -> list[str]:
    """Members of enums that are named without their enum."""
    known, wrong = names(path), []
    for chain in chains(ast.parse(path.read_text(encoding="utf-8"))):
        owner = known.get(chain[0])
        for word in chain[1:]:
            if owner is None or not hasattr(owner, word):
                break
            value = getattr(owner, word)
            of_enum = isinstance(value, int) and type(value) not in (int, bool)
            if of_enum and owner is not type(value) and word in vars(owner):
                wrong.append(".".join(chain))
            owner = value if isinstance(value, type) else None
    return wrong


def test_enums_are_named_in_full(plugins: Path) -> None:
    folder = plugins / "urban_processing_qgis"
    modules = sorted([*folder.glob("*.py"), *folder.glob("steering/*.py")])
    assert len(modules) > 30
    assert {path.name: unscoped(path) for path in modules} == {path.name: [] for path in modules}


def test_the_check_finds_what_it_is_to_find(tmp_path: Path) -> None:
    module = tmp_path / "old.py"
    module.write_text(
        "from qgis.core import QgsProcessing, QgsProcessingParameterNumber, Qgis\n"
        "a = QgsProcessing.TypeVectorPolygon\n"
        "b = QgsProcessing.SourceType.TypeVectorPolygon\n"
        "c = [QgsProcessingParameterNumber.Double, Qgis.MessageLevel.Warning, Qgis.Warning]\n"
        "d = QgsProcessing.TEMPORARY_OUTPUT, Qgis.QGIS_VERSION_INT\n"
    )
    assert sorted(unscoped(module)) == [
        "Qgis.Warning",
        "QgsProcessing.TypeVectorPolygon",
        "QgsProcessingParameterNumber.Double",
    ]
