"""What reads the inputs of a command, one function for each kind of input."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from urban_processing.algorithms.choices import layout_problems
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.errors import DependencyError, UrbanError
from urban_processing.params.base import option_name
from urban_processing.params.compare import CompareParams
from urban_processing.params.measure import MeasureParams
from urban_processing.params.subdivide import SubdivideParams

Reader = Callable[[AlgorithmSpec, Input, Mapping[str, Any], list[str]], Any]
"""Reads an input from what was given; adds to the list what is wrong with it, and returns None
then, and where it was not given."""


def _collecting(read: Reader) -> Reader:
    """Add what a reader raises to the list of what is wrong."""

    @functools.wraps(read)
    def collected(
        spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
    ) -> Any:
        try:
            return read(spec, item, given, problems)
        except DependencyError:
            raise
        except UrbanError as error:
            problems += error.problems
            return None

    return collected


@_collecting
def _read_boundary(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read the land."""
    if given[item.name] is None and not item.required:
        return None
    source, place = given[item.name], given["place"]
    metavar = option_name(item.name).upper()
    if source is not None and place is not None:
        problems.append(f"Give {metavar} or --place, not both.")
    if source is None and place is None:
        problems.append(f"Give {metavar}, a file with the land, or --place with a name.")
    if place is not None and (given["layer"] is not None or given["where"] is not None):
        problems.append(
            "--layer and --where choose features of a file: leave them out with --place."
        )
    if source is None:
        if problems:  # no call over the network for a run that cannot begin
            return None
        from urban_processing.io.places import fetch_place

        source = fetch_place(place)
    from urban_processing.io.boundaries import read_boundary

    return read_boundary(
        source,
        layer=None if place is not None else given["layer"],
        where=None if place is not None else given["where"],
        crs=given["crs"],
        **{i.kind.of_site: given[i.name] for i in spec.inputs if i.kind.of_site},
    )


@_collecting
def _read_layout(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read a layout, from its file or from two layers."""
    names = [i.name for i in spec.inputs if given[i.name] is not None]
    wrong = layout_problems(spec, names, lambda name: _called(spec, name))
    if not wrong and given[item.name] is None and item.required:
        wrong = [f"Give {option_name(item.name).upper()}, {_lower_first(item.help)}"]
    problems += wrong
    if wrong or not names:
        return None
    snap = _usable(spec, given, "snap")
    if given[item.name] is not None:
        from urban_processing.io.files import read_layout

        return read_layout(given[item.name], snap=snap).layout
    from urban_processing.io.layouts import read_layers

    parcels, streets = (
        _given_of(spec, given, kind) for kind in (InputKind.PARCEL_LAYER, InputKind.STREET_LAYER)
    )
    min_area = _usable(spec, given, "min_area")
    return read_layers(parcels, streets, snap=snap or 0.0, min_area=min_area)


@_collecting
def _read_steered(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read what a session began with, and its edits."""
    edits = next(i for i in spec.inputs if i.kind is InputKind.EDITS)
    missing = [i for i in (item, edits) if given[i.name] is None]
    problems += [f"Give {option_name(i.name).upper()}, {_lower_first(i.help)}" for i in missing]
    if missing:
        return None
    from urban_processing.io.sessions import read_start
    from urban_processing.session.files import Steered, read

    saved = None
    try:
        saved = read(given[edits.name])
    except UrbanError as error:
        problems += error.problems
    start = read_start(
        given[item.name],
        snap=_usable(spec, given, "snap") or 0.0,
        **{name: given[name] for name in ("layer", "where", "crs")},
        **{i.kind.of_site: given[i.name] for i in spec.inputs if i.kind.of_site},
    )
    return None if saved is None else Steered(start, saved)


def _usable(spec: AlgorithmSpec, given: Mapping[str, Any], name: str) -> float | None:
    """Value of a number that layers are read with, the default where it is no number.

    None where an algorithm has no such parameter.
    """
    if name not in given:
        return None
    values = {} if given[name] is None else {name: given[name]}
    usable = {} if spec.params.problems_with(values) else values
    value = spec.params.from_values(usable).as_dict()[name]
    return None if value is None else float(value)


def _called(spec: AlgorithmSpec, name: str) -> str:
    """Name of an input on the command line."""
    kind = next(item.kind for item in spec.inputs if item.name == name)
    return option_name(name).upper() if kind is InputKind.LAYOUT else f"--{option_name(name)}"


@_collecting
def _read_editions(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read the two states of a layout."""
    del item
    by_kind = {i.kind: given[i.name] for i in spec.inputs}
    missing = [
        i for i in spec.inputs if i.required and given[i.name] is None and i.kind in _EDITIONS
    ]
    problems += [f"Give {option_name(i.name).upper()}, {_lower_first(i.help)}" for i in missing]
    if missing:
        return None
    from urban_processing.io.editions import read_editions

    return read_editions(*(by_kind[kind] for kind in _EDITIONS))


@_collecting
def _read_centrelines(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read streets and the land they are on."""
    if given[item.name] is None:
        problems.append(f"Give {option_name(item.name).upper()}, a file with lines of streets.")
        return None
    from urban_processing.io.blocks import read_streets

    land = _given_of(spec, given, InputKind.LAND)
    return read_streets(
        given[item.name],
        land=land,
        layer=given["layer"],
        where=given["where"],
        crs=given["crs"],
    )


@_collecting
def _read_blocks(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read blocks and the streets along them."""
    if given[item.name] is None:
        problems.append(f"Give {option_name(item.name).upper()}, a file with polygons of blocks.")
        return None
    from urban_processing.io.blocks import read_blocks

    streets = _given_of(spec, given, InputKind.BLOCK_STREETS)
    return read_blocks(
        given[item.name],
        streets=streets,
        layer=given["layer"],
        where=given["where"],
        crs=given["crs"],
        params=SubdivideParams.usable(values_given(spec, given)),
    )


@_collecting
def _read_observed(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read observed parcels and the blocks that they are in."""
    if given[item.name] is None:
        problems.append(f"Give {option_name(item.name).upper()}, a file with polygons of parcels.")
        return None
    from urban_processing.io.observed import read_observed

    blocks = _given_of(spec, given, InputKind.OBSERVED_BLOCKS)
    return read_observed(
        given[item.name],
        blocks,
        layer=given["layer"],
        where=given["where"],
        crs=given["crs"],
    )


@_collecting
def _read_subdivision(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read a subdivision made before, if one is given."""
    del spec, problems
    if given[item.name] is None:
        return None
    from urban_processing.io.files import read_subdivision

    return read_subdivision(given[item.name])


@_collecting
def _read_fabric(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read what is measured, from its file or from layers."""
    parcels, streets, land = _layers_of(spec, given)
    flags = "--parcel-layer and --street-layer"
    if given[item.name] is not None and (parcels is not None or streets is not None):
        problems.append(f"Give {option_name(item.name).upper()}, or {flags}, not both.")
        return None
    if given[item.name] is None and parcels is None and streets is None:
        problems.append(
            f"Give {option_name(item.name).upper()}, {_lower_first(item.help).rstrip('.')}; "
            f"or layers with {flags}."
        )
        return None
    from urban_processing.io.fabrics import read_fabric

    return read_fabric(
        given[item.name],
        parcels=parcels,
        streets=streets,
        land=land,
        crs=given["crs"],
        params=MeasureParams.usable(values_given(spec, given)),
    )


@_collecting
def _read_fabrics(
    spec: AlgorithmSpec, item: Input, given: Mapping[str, Any], problems: list[str]
) -> Any:
    """Read what is compared: files, and what is there."""
    named = [named_file(text) for text in given[item.name]]
    if not named:
        problems.append(
            f"Give {option_name(item.name).upper()}, one file or more, to compare with each other "
            "or with what is there."
        )
        return None
    parcels, streets, land = _layers_of(spec, given)
    from urban_processing.io.comparison import read_compared

    return read_compared(
        named,
        parcels=parcels,
        streets=streets,
        land=land,
        osm_file=given["osm_file"],
        osm=given["osm"],
        crs=given["crs"],
        params=CompareParams.usable(values_given(spec, given)) or CompareParams(),
        fetch=not problems,  # no call over the network for a run that cannot begin
    )


def _layers_of(spec: AlgorithmSpec, given: Mapping[str, Any]) -> list[Any]:
    """Parcels, streets and land that were given as layers."""
    kinds = (InputKind.PARCEL_LAYER, InputKind.STREET_LAYER, InputKind.LAND)
    return [_given_of(spec, given, kind) for kind in kinds]


def _given_of(spec: AlgorithmSpec, given: Mapping[str, Any], kind: InputKind) -> Any:
    """What was given for the input of a kind; None where nothing was, or there is no such input."""
    return next((given[i.name] for i in spec.inputs if i.kind is kind), None)


def named_file(text: str) -> tuple[str, str]:
    """Name of a side, empty where none is given, and its file, from ``NAME=FILE`` or a file.

    >>> named_file("loops=a.gpkg"), named_file("a.gpkg")
    (('loops', 'a.gpkg'), ('', 'a.gpkg'))
    """
    name, sign, path = text.partition("=")
    if not sign or Path(text).exists() or "|" in name or "/" in name:
        return "", text
    return name.strip(), path


def values_given(spec: AlgorithmSpec, given: Mapping[str, Any]) -> dict[str, Any]:
    """Values of the parameters that were given."""
    names = [field.name for field in spec.params.fields()]
    return {name: given[name] for name in names if given[name] is not None}


_EDITIONS = (
    InputKind.PARCELS_BEFORE,
    InputKind.PARCELS_AFTER,
    InputKind.BLOCKS_BEFORE,
    InputKind.BLOCKS_AFTER,
)

READERS: Mapping[InputKind, Reader] = {
    InputKind.BOUNDARY: _read_boundary,
    InputKind.LAYOUT: _read_layout,
    InputKind.STEERED: _read_steered,
    InputKind.CENTRELINES: _read_centrelines,
    InputKind.BLOCK_LAYER: _read_blocks,
    InputKind.OBSERVED_PARCELS: _read_observed,
    InputKind.SUBDIVISION: _read_subdivision,
    InputKind.PARCELS_BEFORE: _read_editions,
    InputKind.FABRIC: _read_fabric,
    InputKind.FABRICS: _read_fabrics,
}
"""What reads an input of a kind; inputs of other kinds are read together with one of these."""


def _lower_first(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
