"""Where the thread has the session: nothing here touches the window.

Imported on the thread, after `dependencies.require_engine`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from qgis.core import QgsProcessingContext, QgsProcessingFeedback

from qgis_plugin.geopackage import OGR
from qgis_plugin.sources import Sources
from qgis_plugin.steering.model import (
    BranchName,
    Hovered,
    Option,
    Place,
    Start,
    View,
)
from qgis_plugin.steering.picture import Picture, difference, picture_of
from urban_processing.errors import EditError
from urban_processing.layout import Layout
from urban_processing.layout_file.files import read_layout
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.progress import Progress
from urban_processing.session.session import Session
from urban_processing.site import Site


class Bench:
    """A session, and what the window has seen of it."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.seen = Picture()

    def view(self, sentence: str | None = None, *, whole: bool = False) -> View:
        """Return what there is to see, and what differs from what was seen last."""
        session = self.session
        now = picture_of(session)
        view = View(
            sentence=session.sentence if sentence is None else sentence,
            level=session.level,
            finished=session.finished,
            complete=session.is_complete,
            can_undo=session.can_undo,
            can_redo=session.can_redo,
            figures=session.figures(),
            branches=tuple(BranchName(b.number, b.sentence, b.current) for b in session.branches()),
            difference=difference(self.seen, now, whole=whole),
            crs=session.layout.frame.crs,
            parcels=len(now.parcels),
        )
        self.seen = now
        return view

    def edit(self, act: Callable[[Session], Any]) -> View:
        """Change the session, and return what there is to see."""
        return self.view(act(self.session).sentence)

    def edit_parcel(self, place: Place, act: Callable[[Session, int], Any]) -> View:
        """Change the parcel at a place."""
        parcel = self.parcel_at(place)
        return self.edit(lambda session: act(session, parcel))

    def cut(self, line: Sequence[Place]) -> View:
        """Cut the parcel in which the middle of a drawn line lies."""
        middle = shapely.LineString(line).interpolate(0.5, normalized=True)
        drawn = np.asarray(line, dtype=np.float64)
        return self.edit_parcel(
            (middle.x, middle.y), lambda session, parcel: session.cut(parcel, drawn)
        )

    def add_street(self, line: Sequence[Place], *, follow: bool, width: float | None) -> View:
        """Lay a street along a drawn line, or along the boundaries of parcels next to it."""
        drawn = np.asarray(line, dtype=np.float64)
        return self.edit(lambda session: session.add_street(drawn, follow=follow, width=width))

    def adopt(self, parcels: Sequence[bytes], streets: Sequence[bytes]) -> View:
        """Take over parcels and streets that were edited by hand, given as WKB."""
        polygons = _single(parcels, "Polygon")
        lines = _single(streets, "LineString")
        sentence = self.session.adopt(polygons, lines).sentence
        return self.view(sentence, whole=True)

    def parcel_at(self, place: Place) -> int:
        """Return the parcel at a place; an error where there is none."""
        parcel = self.session.parcel_at(place)
        if parcel is None:
            raise EditError("There is no parcel here: click inside the land.")
        return int(parcel)

    def hovered(self, place: Place, *, with_options: bool) -> Hovered | None:
        """Return the parcel at a place, and its candidates if they are asked for."""
        parcel = self.session.parcel_at(place)
        if parcel is None:
            return None
        outline = self.seen.parcels[parcel].outline
        if not with_options:
            return Hovered(parcel, outline)
        try:
            found = self.session.candidates(parcel)
        except EditError as error:
            return Hovered(parcel, outline, reason="\n".join(error.problems))
        options = tuple(
            Option(c.rank, c.quality, shapely.to_wkb(c.line), c.areas, c.reason) for c in found
        )
        none = f"Parcel {parcel} is too small to be cut, or no cut of it is allowed."
        return Hovered(parcel, outline, options, "" if options else none)

    def outlines(self, parcels: Sequence[int]) -> tuple[Hovered, ...]:
        """Return the outlines of some parcels."""
        return tuple(Hovered(p, self.seen.parcels[p].outline) for p in parcels)


def bench_for(
    start: Start,
    saved: Path | None,
    algorithm: Any,
    context: QgsProcessingContext,
    progress: Progress,
) -> Bench:
    """Begin a session with a layer or a layout file, or replay a saved one on it."""
    progress.update(0.0, "Reading the land")
    made = _start(start, algorithm, context)
    if saved is not None:
        return Bench(Session.load(saved, made, progress=progress))
    if isinstance(made, Layout):
        return Bench(Session.of_layout(made))
    params = CogenerateParams.from_values(start.values, _given(start))
    return Bench(Session.begin(made, params))


def _start(start: Start, algorithm: Any, context: QgsProcessingContext) -> Site | Layout:
    if start.layout_file:
        return read_layout(start.layout_file, library=OGR)
    params = CogenerateParams.from_values(start.values, _given(start))
    sources = Sources(algorithm, start.layers, context, QgsProcessingFeedback(), params)
    site: Site = sources.read()["boundary"]
    return site


def _given(start: Start) -> list[str]:
    return [name.lower() for name in start.layers if name != "BOUNDARY"]


def _single(shapes: Sequence[bytes], kind: str) -> list[Any]:
    """Geometries of a kind, those of several pieces apart."""
    found = shapely.get_parts(shapely.from_wkb(list(shapes)))
    return [shape for shape in found if shape.geom_type == kind]
