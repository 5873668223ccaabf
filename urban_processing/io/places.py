"""Boundaries by the name of a place, from OpenStreetMap."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from urban_processing.errors import BoundaryError, DependencyError

if TYPE_CHECKING:
    import geopandas

TIMEOUT_SECONDS = 30


def fetch_place(
    name: str, *, cache_folder: str | os.PathLike[str] | None = None
) -> geopandas.GeoDataFrame:
    """Return the boundary of a place, as OpenStreetMap's geocoder Nominatim knows it.

    Answers are cached on disk, so that the same name needs no network again.
    © OpenStreetMap contributors, Open Database License 1.0.

    Parameters
    ----------
    name
        What one would type into a map's search box: ``"Wandsworth, London"``.
    cache_folder
        Where to keep answers; by default the user's cache folder.

    Returns
    -------
    GeoDataFrame
        One row with a polygon in EPSG:4326, and the attributes that Nominatim gives.

    Raises
    ------
    BoundaryError
        If there is no such place, or it has no polygon.
    DependencyError
        If osmnx is not installed or the geocoder cannot be reached.
    """
    if not name.strip():
        raise BoundaryError("The name of the place is empty.")
    osmnx = import_osmnx("Places by name")
    folder = default_cache_folder() if cache_folder is None else Path(cache_folder)
    with asking(
        osmnx,
        folder,
        unreached=f"The place {name!r} could not be looked up: the geocoder of OpenStreetMap",
        instead="give the boundary as a file",
        what=repr(name),
    ):
        try:
            return osmnx.geocode_to_gdf(name)
        except TypeError as error:
            raise BoundaryError(
                f"OpenStreetMap knows {name!r}, but only as a point or a line, not as an area. "
                "Name the district or municipality, or give the boundary as a file."
            ) from error
        except ValueError as error:
            if "0 results" in str(error):
                raise BoundaryError(
                    f"OpenStreetMap has no place {name!r}. Write it as 'district, city, country'."
                ) from error
            raise DependencyError(
                f"The geocoder of OpenStreetMap gave no usable answer for {name!r}: try again "
                "later, or give the boundary as a file."
            ) from error


def default_cache_folder() -> Path:
    """Return this package's folder in the user's cache, where the system keeps caches."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "urban_processing" / "places"


def import_osmnx(purpose: str) -> Any:
    """Return the package osmnx.

    Raises
    ------
    DependencyError
        If it is not installed; says what it was needed for.
    """
    try:
        import osmnx
    except ImportError as error:
        raise DependencyError(f"{purpose} need the package osmnx: install it.") from error
    return osmnx


@contextmanager
def asking(
    osmnx: Any,
    folder: Path,
    *,
    unreached: str,
    instead: str,
    what: str,
    settings: Mapping[str, Any] | None = None,
) -> Iterator[None]:
    """Ask a server of OpenStreetMap by osmnx, with its answers kept in a folder of ours.

    Parameters
    ----------
    osmnx
        The package.
    folder
        Where to keep answers.
    unreached
        How the sentence begins that says that a server cannot be reached.
    instead
        What the user may do without a network.
    what
        What the answer is about.
    settings
        Settings of osmnx besides those of its cache.

    Raises
    ------
    DependencyError
        If the server cannot be reached, or the answer not be kept.
    """
    import requests

    own = {"use_cache": True, "cache_folder": folder, "requests_timeout": TIMEOUT_SECONDS}
    try:
        with _settings_of(osmnx, own | dict(settings or {})):
            yield
    except requests.exceptions.RequestException as error:
        raise DependencyError(
            f"{unreached} cannot be reached. Check the network, or {instead}."
        ) from error
    except OSError as error:
        raise DependencyError(
            f"The answer for {what} cannot be kept in {folder}: {error.strerror or error}."
        ) from error


@contextmanager
def _settings_of(osmnx: Any, changes: dict[str, Any]) -> Iterator[None]:
    """Set osmnx's global settings for a moment."""
    before = {key: getattr(osmnx.settings, key) for key in changes}
    for key, value in changes.items():
        setattr(osmnx.settings, key, value)
    try:
        yield
    finally:
        for key, value in before.items():
            setattr(osmnx.settings, key, value)
