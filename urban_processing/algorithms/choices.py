"""Inputs that can be given in more than one way."""

from __future__ import annotations

from collections.abc import Callable, Collection

from urban_processing.algorithms.spec import AlgorithmSpec, InputKind

_LAYERS = (InputKind.PARCEL_LAYER, InputKind.STREET_LAYER)


def layout_problems(
    spec: AlgorithmSpec, given: Collection[str], called: Callable[[str], str]
) -> list[str]:
    """Return what is wrong with how a layout was given: as a file, or as its two layers.

    Parameters
    ----------
    spec
        The algorithm.
    given
        Names of the inputs that were given.
    called
        Name of an input as the user knows it.
    """
    files = [i.name for i in spec.inputs if i.kind is InputKind.LAYOUT]
    layers = [i.name for i in spec.inputs if i.kind in _LAYERS]
    if not files or not layers:
        return []
    file, both = called(files[0]), " and ".join(map(called, layers))
    if files[0] in given:
        if any(name in given for name in layers):
            return [f"Give {file}, or {both}, not both."]
        return []
    missing = [name for name in layers if name not in given]
    if len(missing) == len(layers):
        return [f"Give {file}, a layout file, or {both}, two layers."]
    return [f"{called(name)} is missing: parcels and streets belong together." for name in missing]
