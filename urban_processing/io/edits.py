"""Layouts after they were edited by hand, with what became of their parcels."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path
from typing import TypeAlias

import geopandas as gpd

from urban_processing.errors import BoundaryError
from urban_processing.io.features import Source
from urban_processing.io.files import read_layout
from urban_processing.io.frames import GeoLayout, table_frame
from urban_processing.io.layouts import read_layers
from urban_processing.layout import Layout
from urban_processing.params.optimize import OptimizeParams
from urban_processing.persistence.layers import CHANGES
from urban_processing.pipelines.hand_edits import edits_listed

Given: TypeAlias = GeoLayout | Layout | str | PathLike[str]
"""A layout, or its file."""


def read_edited(
    before: Given,
    after: Given | None = None,
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    snap: float = OptimizeParams.snap,
) -> tuple[GeoLayout, gpd.GeoDataFrame]:
    """Read a layout that was edited by hand, and list what became of its parcels.

    Parameters
    ----------
    before
        The layout as it was, or its file.
    after
        The file of the same layout after the edit.
    parcels, streets
        Instead: its edited layers, as files, GeoDataFrames or geometries. Their columns count
        where no geometry tells the same; all that layers do not say is as it was before.
    snap
        Metres within which parcels and streets are fitted together.

    Returns
    -------
    layout, changes
        The edited layout, whose issues say in one row how many parcels are the same, moved,
        split, merged, gone and new; and one row for each parcel, with its numbers (`parcel_id`)
        before and after: the layer `changes` of `urban_processing.transfer`.

    Raises
    ------
    BoundaryError
        If there is no such file, or it is no layout file; if the layers cannot be read.

    Examples
    --------
    >>> import shapely
    >>> import urban_processing as up
    >>> made = up.cogenerate(shapely.box(0, 0, 200, 120), crs="EPSG:32630", min_area=1500)
    >>> edited = made.parcels.drop(index=12)
    >>> edited.loc[11, "geometry"] = made.parcels.geometry[11].union(made.parcels.geometry[12])
    >>> layout, changes = read_edited(made, parcels=edited, streets=made.streets)
    >>> changes.change.value_counts().to_dict()
    {'kept': 10, 'moved': 1, 'merged': 1}
    """
    if (after is None) == (parcels is None) or (parcels is None) != (streets is None):
        raise BoundaryError("Give the layout after the edit, or its parcels and streets.")
    old = as_layout(before, snap=snap)
    if after is not None:
        new = as_layout(after, snap=snap)
    else:
        new = read_layers(parcels, streets, snap=snap, before=old)
    layout, made = edits_listed(old, new, called=_name(before))
    table = made.table(CHANGES.name)
    return GeoLayout(layout), table_frame(CHANGES, table, crs=layout.frame.crs)


def as_layout(given: Given, *, snap: float) -> Layout:
    """Return a layout that may be given as its file, edited by hand or not.

    Parameters
    ----------
    given
        The layout, or its file.
    snap
        Metres within which parcels and streets of an edited file are fitted together.
    """
    if isinstance(given, GeoLayout):
        return given.layout
    return given if isinstance(given, Layout) else read_layout(given, snap=snap).layout


def _name(given: Given) -> str:
    """What to call the layout before: the name of its file."""
    if isinstance(given, GeoLayout | Layout):
        return "the layout before"
    return Path(fspath(given)).name
