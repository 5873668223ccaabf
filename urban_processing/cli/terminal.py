"""What the command line says: results on stdout, everything else on stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.table import Table

from urban_processing.progress import CallbackProgress, Progress


class Terminal:
    """Speaks to the user; quiet, it says only warnings and errors."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.quiet = quiet

    def note(self, message: str) -> None:
        """Say something worth knowing on stderr."""
        if not self.quiet:
            click.echo(message, err=True)

    def warn(self, message: str) -> None:
        """Say on stderr what the user should look at."""
        click.secho("Warning: ", fg="yellow", bold=True, nl=False, err=True)
        click.echo(message, err=True)

    def error(self, problems: Sequence[str]) -> None:
        """Say on stderr why there is no result."""
        click.secho("Error: ", fg="red", bold=True, nl=False, err=True)
        if len(problems) == 1:
            click.echo(problems[0], err=True)
            return
        click.echo(f"{len(problems)} things are wrong with this call.", err=True)
        for problem in problems:
            click.echo(f"  - {problem}", err=True)

    def table(self, rows: Sequence[tuple[str, str]]) -> None:
        """Print names and values on stdout, never cut or wrapped: paths are copied from it."""
        if self.quiet:
            return
        width = max(len(name) for name, _ in rows)
        for name, value in rows:
            click.echo(f"{click.style(name.ljust(width), bold=True)}  {value}")

    @contextmanager
    def progress(self, title: str) -> Iterator[Progress]:
        """Show a bar on stderr while a run lasts; none where stderr is no terminal."""
        console = Console(file=sys.stderr)
        if self.quiet or not console.is_terminal:
            yield CallbackProgress(on_warning=self.warn)
            return
        bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=console,
            transient=True,
        )
        with bar:
            task = bar.add_task(title, total=1.0)

            def update(fraction: float, message: str) -> None:
                bar.update(task, completed=fraction, description=message or title)

            yield CallbackProgress(on_update=update, on_warning=self.warn)


def plain_table(*headers: str) -> Table:
    """Return an empty table without lines, for lists on a terminal."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column(headers[0], no_wrap=True)
    for header in headers[1:]:
        table.add_column(header)
    return table
