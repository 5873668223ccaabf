"""The description of an algorithm, for reading on a terminal."""

from __future__ import annotations

from rich.console import RenderableType
from rich.text import Text

from urban_processing.algorithms.spec import AlgorithmSpec
from urban_processing.algorithms.words import (
    column_in_words,
    default_in_words,
    kind_in_words,
    limits_in_words,
)
from urban_processing.cli import help as help_pages
from urban_processing.cli.terminal import plain_table
from urban_processing.params.base import ParamField


def description_page(spec: AlgorithmSpec) -> str:
    """Return all that is declared about an algorithm as a page of text."""
    parts: list[RenderableType] = [
        Text(f"{spec.title} ({spec.name})", style="bold"),
        help_pages.paragraphs(f"{spec.summary}\n\n{spec.description}\n"),
    ]
    for title, items in (("Reads", spec.inputs), ("Makes", spec.outputs)):
        table = plain_table(title, "Kind", "What it is")
        for item in items:
            name = item.name if item.required else f"{item.name} (optional)"
            table.add_row(name, item.kind.value, item.help)
        parts += [table, Text()]
    table = plain_table("Parameter", "Value", "What it means")
    for field in spec.params.fields():
        table.add_row(field.name, _values(field), field.param.help)
    parts += [table, Text()]
    if spec.references:
        parts += [Text("Sources", style="bold"), help_pages.paragraphs("\n".join(spec.references))]
    return help_pages.page(parts)


def _values(field: ParamField) -> str:
    default = default_in_words(field)
    words = (
        kind_in_words(field),
        limits_in_words(field),
        default and f"default {default}",
        column_in_words(field),
    )
    return ", ".join(word for word in words if word)
