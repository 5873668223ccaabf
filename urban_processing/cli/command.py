"""The command of one algorithm."""

from __future__ import annotations

from typing import Any

import click
from rich.text import Text

from urban_processing.algorithms.spec import AlgorithmSpec
from urban_processing.cli import help as help_pages
from urban_processing.cli.options import command_parameters
from urban_processing.cli.terminal import Terminal


class AlgorithmCommand(click.Command):
    """A command made from an algorithm's declaration."""

    def __init__(self, spec: AlgorithmSpec) -> None:
        def callback(**given: Any) -> None:
            from urban_processing.cli.run import run_algorithm

            run_algorithm(spec, given, Terminal(quiet=given.pop("quiet")))

        super().__init__(
            spec.name,
            callback=callback,
            params=command_parameters(spec),
            help=spec.description,
            short_help=spec.summary,
        )
        self.spec = spec

    def get_help(self, ctx: click.Context) -> str:
        """Return the help page."""
        spec = self.spec
        parts = [
            help_pages.usage(ctx),
            help_pages.paragraphs(f"{spec.summary}\n\n{spec.description}\n"),
            *help_pages.option_panels(ctx),
        ]
        if spec.examples:
            lines = [f"{ctx.command_path} {example}" for example in spec.examples]
            parts.append(help_pages.verbatim("Examples", lines))
        if spec.references:
            parts.append(Text("\nSources", style="bold"))
            parts.append(help_pages.paragraphs("\n".join(spec.references)))
        return help_pages.page(parts)
