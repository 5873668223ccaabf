"""The command line, made from the algorithm specs."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command ``urban-processing``."""
    try:
        from urban_processing.cli.app import app

        app(prog_name="urban-processing")
    except KeyboardInterrupt:  # before the command has begun
        sys.exit(130)
