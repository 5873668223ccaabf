"""Help pages: a command's options in panels."""

from __future__ import annotations

import sys
from collections.abc import Iterable

import click
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from urban_processing.cli.options import OTHER, PanelOption

MAX_WIDTH = 100


def page(parts: Iterable[RenderableType]) -> str:
    """Render a page for stdout, in colour where that is a terminal."""
    console = Console(file=sys.stdout, highlight=False)
    console.width = min(console.width, MAX_WIDTH)
    with console.capture() as captured:
        for part in parts:
            # bare text is there to be copied: it is never wrapped
            console.print(part, soft_wrap=isinstance(part, Text))
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def usage(ctx: click.Context) -> RenderableType:
    """Return the usage line."""
    pieces = " ".join(ctx.command.collect_usage_pieces(ctx))
    return Text.assemble(("Usage: ", "bold"), f"{ctx.command_path} {pieces}\n")


def paragraphs(text: str) -> RenderableType:
    """Return text that is wrapped to the page."""
    return Padding(Text(text), (0, 1))


def verbatim(title: str, lines: Iterable[str]) -> RenderableType:
    """Return lines to copy, which are never wrapped."""
    indented = "".join(f"\n {line}" for line in lines)
    return Text.assemble((f"\n{title}", "bold"), indented)


def panel(title: str, rows: Iterable[tuple[str, str, Text]]) -> RenderableType:
    """Return a framed list of names, values and what they mean."""
    table = Table.grid(padding=(0, 2), expand=True)
    table.add_column(style="bold cyan", no_wrap=True)
    table.add_column(style="yellow", no_wrap=True)
    table.add_column(ratio=1)
    for name, value, meaning in rows:
        table.add_row(name, value, meaning)
    return Panel(table, title=title, title_align="left", border_style="dim", padding=(0, 1))


class PanelCommand(click.Command):
    """A command whose help page shows its options in panels."""

    def get_help(self, ctx: click.Context) -> str:
        """Return the help page."""
        return page([usage(ctx), paragraphs(f"{self.help}\n"), *option_panels(ctx)])


def option_panels(ctx: click.Context) -> list[RenderableType]:
    """Return the panels of a command's arguments and options, in the order of declaration."""
    panels: dict[str, list[tuple[str, str, Text]]] = {}
    for parameter in ctx.command.get_params(ctx):
        if isinstance(parameter, click.Argument):
            name, value = parameter.make_metavar(ctx), ""
            help_text = getattr(parameter, "help", "") or ""
            panels.setdefault("Input", []).append((name.strip("[]"), value, Text(help_text)))
        elif isinstance(parameter, click.Option):
            title = parameter.panel if isinstance(parameter, PanelOption) else OTHER
            panels.setdefault(title, []).append(_row(parameter))
    return [panel(title, rows) for title, rows in panels.items()]


def _row(option: click.Option) -> tuple[str, str, Text]:
    names = sorted([*option.opts, *option.secondary_opts], key=lambda name: name.count("-"))
    value = "" if option.is_flag or option.metavar is None else option.metavar
    meaning = Text(option.help or "")
    note = option.note if isinstance(option, PanelOption) else ""
    if note:
        meaning.append(f" [{note}]", style="dim")
    return ", ".join(names), value, meaning
