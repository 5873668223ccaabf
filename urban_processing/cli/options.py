"""Options of a command, made from an algorithm's declaration."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

import click

from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind, Output, OutputKind
from urban_processing.algorithms.words import column_in_words, default_in_words, limits_in_words
from urban_processing.params.base import ParamField, option_name
from urban_processing.params.export import ExportKind, ExportParams

INPUT, OUTPUT, OTHER = "Input", "Output", "Options"
"""Panels of the help page."""

Completion = Callable[[click.Context, click.Parameter, str], list[str]]

_UNITS = {"m": "METRES", "m²": "M²", "°": "DEGREES"}


class PanelOption(click.Option):
    """An option that knows the panel of the help page it stands in, and a note on its values."""

    def __init__(self, *args: Any, panel: str, note: str = "", **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.panel = panel
        self.note = note


def command_parameters(spec: AlgorithmSpec) -> list[click.Parameter]:
    """Return the arguments and options of an algorithm's command."""
    parameters: list[click.Parameter] = []
    for item in spec.inputs:
        parameters += _input_parameters(item)
    of_layout = any(output.kind is OutputKind.LAYOUT for output in spec.outputs)
    for output in spec.outputs:
        parameters += _output_options(output, of_layout=of_layout)
    parameters += _writing_options(spec)
    for panel, fields in spec.panels().items():
        parameters += [parameter_option(field, panel) for field in fields]
    if spec.parallel:
        side_by_side = "Number of processes that work side by side; the result is the same."
        parameters.append(
            _option(
                "--processes",
                metavar="N",
                type=click.IntRange(min=1),
                default=1,
                panel=OTHER,
                help=side_by_side,
                note="at least 1; default 1",
            )
        )
    quiet = "Say nothing but warnings and errors."
    parameters.append(_option("--quiet", "-q", is_flag=True, panel=OTHER, help=quiet))
    return parameters


def parameter_option(field: ParamField, panel: str) -> PanelOption:
    """Return the option of one parameter; its value is checked by the parameter class."""
    flag = f"--{option_name(field.name)}"
    notes = [limits_in_words(field)]
    if default_in_words(field):
        notes.append(f"default {default_in_words(field)}")
    if column_in_words(field):
        notes.append(column_in_words(field))
    complete: Completion | None = None
    metavar: str | None = None
    if field.kind is bool:
        flag = f"{flag}/--no-{option_name(field.name)}"
    elif issubclass(field.kind, enum.Enum):
        choices = tuple(str(member.value) for member in field.kind)
        notes.insert(0, ", ".join(choices))
        complete, metavar = _completing(*choices), "CHOICE"
    else:
        metavar = _UNITS.get(field.param.unit) or {int: "N", float: "NUMBER"}.get(
            field.kind, "TEXT"
        )
    return PanelOption(
        [flag],
        shell_complete=complete,
        metavar=metavar,
        default=None,
        help=field.param.help,
        panel=panel,
        note="; ".join(note for note in notes if note),
    )


def _completing(*choices: str) -> Completion:
    """Complete choices in the shell; they are checked with all else, not by the parser."""
    return lambda _ctx, _param, begun: [c for c in choices if c.startswith(begun)]


def _option(*flags: str, **kwargs: Any) -> PanelOption:
    return PanelOption(list(flags), **kwargs)


def _file(*flags: str, metavar: str = "FILE", **kwargs: Any) -> PanelOption:
    return _option(*flags, type=click.Path(), metavar=metavar, **kwargs)


_BY_OPTION = (
    InputKind.PARCEL_LAYER,
    InputKind.STREET_LAYER,
    InputKind.BLOCK_STREETS,
    InputKind.SUBDIVISION,
    InputKind.LAND,
    InputKind.BLOCKS_BEFORE,
    InputKind.BLOCKS_AFTER,
    InputKind.OBSERVED_BLOCKS,
)
"""Inputs that are options; the others are arguments."""


def _input_parameters(item: Input) -> list[click.Parameter]:
    if item.kind.of_site or item.kind in _BY_OPTION:
        return [_file(f"--{option_name(item.name)}", panel=INPUT, help=item.help)]
    if item.kind is InputKind.OPEN_STREET_MAP:
        fetch = "Fetch it from OpenStreetMap's server, within the land; kept for the next time."
        return [
            _file(f"--{option_name(item.name)}", panel=INPUT, help=item.help),
            _option("--osm", is_flag=True, panel=INPUT, help=fetch),
        ]
    several = item.kind is InputKind.FABRICS
    argument = HelpArgument(
        [item.name],
        required=False,
        type=click.Path(),
        nargs=-1 if several else 1,
        metavar=option_name(item.name).upper() + ("..." if several else ""),
        help=item.help,
    )
    if not item.kind.is_layer:
        return [argument, *([_crs_option()] if item.kind.chooses_crs else [])]
    if item.kind is not InputKind.BOUNDARY:
        return [argument, *_choice_of_features()]
    place = "Instead of a file: a place that OpenStreetMap knows, as 'Wandsworth, London'."
    return [
        argument,
        _option("--place", metavar="NAME", panel=INPUT, help=place),
        *_choice_of_features(),
    ]


def _choice_of_features() -> list[click.Parameter]:
    return [
        _option("--layer", metavar="NAME", panel=INPUT, help="Layer of a file that has several."),
        _option(
            "--where",
            metavar="FILTER",
            panel=INPUT,
            help="Which features to take, as after WHERE in SQL: \"name = 'Schaan'\".",
        ),
        _crs_option(),
    ]


def _crs_option() -> click.Parameter:
    crs = "Projected CRS in metres to work in, as EPSG:32630; the CRS of a file that has none."
    return _option("--crs", metavar="CODE", panel=INPUT, help=crs)


class HelpArgument(click.Argument):
    """An argument with a help text."""

    def __init__(self, *args: Any, help: str, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.help = help


def _writing_options(spec: AlgorithmSpec) -> list[click.Parameter]:
    replace = "Replace files that exist already."
    options: list[click.Parameter] = [
        _option("--overwrite", is_flag=True, panel=OUTPUT, help=replace)
    ]
    if any(output.kind.is_geopackage for output in spec.outputs):
        seconds = "Record how long the run took; the same seed then no longer gives the same bytes."
        options.append(_option("--record-seconds", is_flag=True, panel=OUTPUT, help=seconds))
    return options


def _output_options(output: Output, *, of_layout: bool) -> list[click.Parameter]:
    flag = f"--{option_name(output.name)}"
    if output.kind.is_geopackage:
        return [_file("-o", flag, panel=OUTPUT, help=output.help, note=".gpkg")]
    if output.kind.endings:
        *others, last = output.kind.endings
        note = f"{', '.join(others)} or {last}" if others else last
        return [_file(flag, panel=OUTPUT, help=output.help, note=note)]
    folder = {"metavar": "FOLDER", "panel": OUTPUT, "help": output.help}
    if not output.of:  # the format is a parameter of the algorithm
        return [_file("-o", flag, **folder)]
    field = next(field for field in ExportParams.fields() if field.kind is ExportKind)
    formats = [kind.value for kind in ExportKind if of_layout or not kind.of_layouts]
    return [
        _file(flag, **folder),
        _option(
            f"{flag}-format",
            shell_complete=_completing(*formats),
            metavar="CHOICE",
            default=default_in_words(field),
            panel=OUTPUT,
            help=field.param.help,
            note=f"{', '.join(formats)}; default {default_in_words(field)}",
        ),
    ]
