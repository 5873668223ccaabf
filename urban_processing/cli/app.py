"""The group of all commands, and the translation of errors into exit codes."""

from __future__ import annotations

import json
from typing import Any

import click
from rich.text import Text

from urban_processing.algorithms import AlgorithmSpec, get, specs
from urban_processing.cli import help as help_pages
from urban_processing.cli.call import BadCallError
from urban_processing.cli.command import AlgorithmCommand
from urban_processing.cli.help import PanelCommand
from urban_processing.cli.options import HelpArgument
from urban_processing.cli.terminal import Terminal, plain_table
from urban_processing.errors import (
    BoundaryError,
    Cancelled,
    ParameterError,
    UrbanError,
)
from urban_processing.version import __version__

FAILED, BAD_CALL, STOPPED = 1, 2, 130
"""Exit codes: the run failed; something is wrong with what was given; the user stopped it."""

_SUMMARY = "Parcels and streets, generated together on real land boundaries."
_COMPLETION = 'eval "$(_URBAN_PROCESSING_COMPLETE=bash_source urban-processing)"'


class App(click.Group):
    """A group that shows its commands in a panel and turns errors into sentences."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; say errors on stderr and exit with their code."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, Cancelled):
            click.echo("Stopped; no file was left half-written.", err=True)
            ctx.exit(STOPPED)
        except (BadCallError, ParameterError, BoundaryError) as error:
            Terminal().error(error.problems)
            ctx.exit(BAD_CALL)
        except UrbanError as error:
            Terminal().error(error.problems)
            ctx.exit(FAILED)

    def get_help(self, ctx: click.Context) -> str:
        """Return the help page."""
        commands = [self.commands[name] for name in self.list_commands(ctx)]
        rows = [(c.name or "", "", Text(c.get_short_help_str(limit=200))) for c in commands]
        return help_pages.page(
            [
                help_pages.usage(ctx),
                help_pages.paragraphs(f"{_SUMMARY}\n"),
                help_pages.panel("Commands", rows),
                *help_pages.option_panels(ctx),
                help_pages.verbatim(
                    "Completion with the tab key in bash; zsh and fish likewise", [_COMPLETION]
                ),
            ]
        )

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the algorithms first, in their own order."""
        del ctx
        return list(self.commands)


def list_algorithms() -> None:
    """List the algorithms."""
    table = plain_table("Name", "Group", "What it does")
    for spec in specs():
        table.add_row(spec.name, spec.group, spec.summary)
    click.echo(help_pages.page([table]))


def describe(name: str, as_json: bool, as_markdown: bool) -> None:
    """Describe an algorithm: what it reads and makes, its parameters, sources."""
    spec = get(name)
    if as_json:
        from urban_processing.algorithms.json_schema import description

        click.echo(json.dumps(description(spec), indent=2, ensure_ascii=False))
    elif as_markdown:
        from urban_processing.algorithms.reference import algorithm_page

        click.echo(algorithm_page(spec), nl=False)
    else:
        from urban_processing.cli.describe import description_page

        click.echo(description_page(spec))


def make_app(algorithms: tuple[AlgorithmSpec, ...]) -> App:
    """Return the group of the commands of these algorithms, and those about them."""
    app = App(
        "urban-processing",
        help=_SUMMARY,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    for spec in algorithms:
        app.add_command(AlgorithmCommand(spec))
    app.add_command(PanelCommand("list", callback=list_algorithms, help="List the algorithms."))
    app.add_command(
        PanelCommand(
            "describe",
            callback=describe,
            help="Describe an algorithm: what it reads and makes, its parameters, its sources.",
            params=[
                HelpArgument(["name"], help="As `urban-processing list` shows it."),
                click.Option(["--json", "as_json"], is_flag=True, help="As JSON, for programs."),
                click.Option(
                    ["--markdown", "as_markdown"], is_flag=True, help="As a page of Markdown."
                ),
            ],
        )
    )
    return click.version_option(__version__, prog_name="urban-processing")(app)


app = make_app(specs())
