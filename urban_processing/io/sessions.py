"""Steering sessions from files, and with parcels, streets and candidates as GeoDataFrames."""

from __future__ import annotations

from os import PathLike
from typing import Any

import geopandas as gpd
import pandas as pd

from urban_processing.errors import BoundaryError
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.fabrics import is_layout_file
from urban_processing.io.files import read_layout
from urban_processing.io.frames import GeoLayout
from urban_processing.layout import Layout, Stage
from urban_processing.session.session import Session
from urban_processing.site import Site


def read_start(start: str | PathLike[str], *, snap: float, **options: Any) -> Site | Layout:
    """Read what a session began with: a layout file, or land.

    Parameters
    ----------
    start
        The layout file, or the file of the land.
    snap
        Metres within which parcels and streets of an edited layout file are fitted together.
    **options
        With land: as in `urban_processing.io.boundaries.read_boundary`.

    Raises
    ------
    BoundaryError
        If the file is neither, or something is given that a layout has already.
    """
    if not is_layout_file(start):
        return read_boundary(start, **options)
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise BoundaryError(f"{start} is a layout: leave out {', '.join(sorted(given))}.")
    return read_layout(start, snap=snap).layout


class GeoSession(Session):
    """A layout that is steered level by level; see `urban_processing.session.session.Session`.

    Examples
    --------
    >>> import shapely
    >>> import urban_processing as up
    >>> session = up.steer(shapely.box(0, 0, 300, 200), crs="EPSG:32630", min_area=2000)
    >>> session.step().sentence
    'Level 1: 2 parcels.'
    >>> change = session.choose(2, candidate=2)
    >>> session.lock(3, "park").sentence
    'Parcel 3 is kept as park.'
    >>> session.finish().gone
    (4, 5)
    >>> int((session.view.parcels.land_use == "park").sum())
    1
    """

    @property
    def view(self) -> GeoLayout:
        """The layout as it is now, its layers as GeoDataFrames."""
        return GeoLayout(self.layout)

    @property
    def numbered_parcels(self) -> gpd.GeoDataFrame:
        """Parcels as they are now, indexed by the numbers that edits take.

        With level, area, frontage, land use and stage; `view` has all that is known of them.
        """
        layout = self.layout
        columns = {
            "level": layout.face_level,
            "area_m2": layout.mesh.face_area,
            "frontage_m": layout.frontage,
            "land_use": [layout.land_uses[use] for use in layout.face_use.tolist()],
            "locked": layout.face_locked,
            "stage": [Stage(stage).name.lower() for stage in layout.face_stage.tolist()],
        }
        return gpd.GeoDataFrame(
            columns,
            geometry=layout.mesh.face_polygons(layout.frame.origin),
            crs=layout.frame.crs or None,
            index=pd.Index(self.parcels, name="parcel"),
        )

    def candidate_lines(self, parcel: int | tuple[float, float]) -> gpd.GeoDataFrame:
        """Ways of cutting a parcel, indexed by rank, with their scores and what they are made of.

        Parameters
        ----------
        parcel
            Number of the parcel, or a place (x, y) in it.
        """
        found = self.candidates(parcel)
        columns = {
            "rank": [c.rank for c in found],
            "quality": [c.quality for c in found],
            "smaller_m2": [c.areas[0] for c in found],
            "larger_m2": [c.areas[1] for c in found],
            "reason": [c.reason for c in found],
            **({term: [c.terms[term] for c in found] for term in found[0].terms} if found else {}),
        }
        lines = [c.line for c in found]
        crs = self.layout.frame.crs or None
        return gpd.GeoDataFrame(columns, geometry=lines, crs=crs).set_index("rank")
