"""`GeoSession`: a steering session whose parcels, streets and candidates are GeoDataFrames."""

from __future__ import annotations

import geopandas as gpd
import pandas as pd

from urban_processing.io.frames import GeoLayout
from urban_processing.session.session import Session


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
        """Parcels as they are now, indexed by the numbers that edits take."""
        frame = self.view.frame("parcels").drop(columns="parcel_id")
        return frame.set_index(pd.Index(self.parcels, name="parcel"))

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
