"""Land and the parameters of co-generation, read together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.api.gathering import gathered
from urban_processing.errors import BoundaryError
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.features import Source
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.ground import given_layers
from urban_processing.site import Site

_LAYERS = ("streets", "obstacles", "locked", "rim_lines", "entries")


def land_and_params(
    boundary: Source | Site, parameters: Mapping[str, Any], **options: Any
) -> tuple[Site, CogenerateParams]:
    """Read land and check parameters; what is wrong with both is told together.

    Parameters
    ----------
    boundary
        The land, or a `Site` that is ready.
    parameters
        Fields of `CogenerateParams`.
    **options
        As in `urban_processing.io.boundaries.read_boundary`.
    """
    given = [name for name in _LAYERS if options.get(name) is not None]
    if isinstance(boundary, Site):
        given += given_layers(boundary)
    params, site = gathered(
        lambda: CogenerateParams.from_values(parameters, given),
        lambda: _site(boundary, **options),
    )
    return site, params


def _site(boundary: Source | Site, **options: Any) -> Site:
    if not isinstance(boundary, Site):
        return read_boundary(boundary, **options)
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise BoundaryError(f"A Site is ready as it is: leave out {', '.join(given)}.")
    return boundary
