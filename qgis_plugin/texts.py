"""Texts in the language of the user."""

from __future__ import annotations

from qgis.PyQt.QtCore import QCoreApplication

CONTEXT = "UrbanProcessing"
"""Where translators find the texts."""


def tr(text: str) -> str:
    """Return a text in the language of the user."""
    return str(QCoreApplication.translate(CONTEXT, text))
