"""Layouts out of the layers of their files, as they were written or after they were edited."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.assembly import EDITED, Kept, assemble_layout
from urban_processing.errors import BoundaryError, TopologyError
from urban_processing.layer_rows import (
    PARCEL_COLUMNS,
    QUOTA,
    STAGE,
    STREET_COLUMNS,
    ParcelRows,
    kept_for_uses,
    parcel_rows,
    street_rows,
    values_of_faces,
)
from urban_processing.layout import GivenStreet, Layout, Stage
from urban_processing.layout_file.by_hand import barred_where_deleted, land_note
from urban_processing.layout_file.geopackage import LayerLibrary
from urban_processing.mesh.places import line_segments
from urban_processing.provenance import Step
from urban_processing.rebuild import LayoutParts, rebuild_layout
from urban_processing.schema import (
    BOUNDARY,
    INPUT_BOUNDARY,
    ISSUES,
    OBSTACLES,
    PARCELS,
    PROVENANCE,
    STREETS,
)
from urban_processing.site import FloatArray, Frame, Issue
from urban_processing.street_rules import StreetRules

STAGES_SINCE = 2
"""Files of older formats know no stages of parcels: they were all finished."""


@dataclass(frozen=True)
class LayoutFile:
    """A layout file, the frame of its local coordinates, and what reads it."""

    path: Path
    frame: Frame
    library: LayerLibrary

    def layer(
        self, name: str, *columns: str
    ) -> tuple[npt.NDArray[np.object_], dict[str, npt.NDArray[Any]]]:
        """Geometries in local coordinates and columns, in the order in which they were written."""
        geometry, values = self.library.read_layer(self.path, name, columns)
        return self.local(geometry), values

    def known(self, name: str, columns: Sequence[str]) -> list[str]:
        """Those of some columns that a layer has."""
        there = self.library.column_names(self.path, name)
        return [column for column in columns if column in there]

    def local(self, geometry: Any) -> Any:
        """Geometries in local coordinates."""
        return shapely.transform(geometry, lambda xy: xy - np.asarray(self.frame.origin))


def read_exactly(file: LayoutFile, state: Mapping[str, Any]) -> Layout:
    """Read the layout that was written.

    Parameters
    ----------
    file
        The file.
    state
        What its layers do not say, as `urban_processing.layout_file.files` writes it.

    Raises
    ------
    TopologyError
        If parcels and streets do not fit together.
    BoundaryError
        If what was written is not there, or not as it was.
    """
    source = file.path
    try:
        parts, split = _read_parts(file, state)
        if not shapely.coverage_is_valid(parts.polygons):
            raise TopologyError("Parcels overlap, or a corner of one lies on the side of another.")
        issues = (*([_NOTE_OF_EDIT] if split else []), *_read_issues(file))
        layout = rebuild_layout(parts, frame=file.frame, min_area=state["min_area"], issues=issues)
        layout = layout.replace(
            street_rules=StreetRules.from_dict(state.get("street_rules", {})),
            corners_given=state["corners_given"],
            history=_read_history(file),
            input_parts=_read_polygons(file, INPUT_BOUNDARY.name),
        )
        return barred_where_deleted(layout, state, 0.0)
    except TopologyError as error:
        raise TopologyError(
            [
                f"The parcels and streets of {source} do not fit together any more; were they "
                "edited?",
                *error.problems,
            ]
        ) from error
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise BoundaryError(f"{source} is damaged or was changed: {error}") from error


def read_edited(file: LayoutFile, state: Mapping[str, Any], snap: float) -> Layout:
    """Read parcels and streets, whatever was done to them, and fit them together.

    Parameters
    ----------
    file, state
        As for `read_exactly`.
    snap
        Metres within which they fit.

    Raises
    ------
    BoundaryError
        If a layer is missing, or nothing is left of the parcels.
    """
    try:
        parcels, parcel = file.layer(PARCELS.name, *file.known(PARCELS.name, PARCEL_COLUMNS))
        streets, street = file.layer(STREETS.name, *file.known(STREETS.name, STREET_COLUMNS))
        polygons, of_parcel = _single(parcels, "Polygon")
        lines, of_street = _single(streets, "LineString")
        kept = _kept(file, state)
        rows = _parcel_rows(parcel, len(parcels), state)
        given = street_rows(street, len(streets), n_given=len(kept.fixed_streets))
        layout = assemble_layout(
            polygons,
            lines,
            frame=file.frame,
            snap=snap,
            kept=kept,
            rows=(rows.taken(of_parcel), given.taken(of_street)),
        )
        note = land_note(layout, _read_polygons(file, BOUNDARY.name), snap)
        layout = layout.replace(issues=(_NOTE_OF_EDIT, *note, *layout.issues))
        return barred_where_deleted(layout, state, snap)
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise BoundaryError(f"{file.path} cannot be read: {error}") from error


_NOTE_OF_EDIT = Issue(EDITED, "Parcels or streets of the file were edited.")


def _kept(file: LayoutFile, state: Mapping[str, Any]) -> Kept:
    """What the file says of a layout besides its parcels and streets."""
    steered, steering = _steering(state)
    return Kept(
        min_area=state["min_area"],
        corners=_places(state["corners"]),
        entries=_places(state["entries"]),
        steered=steered,
        steering=steering,
        corners_given=state["corners_given"],
        street_rules=StreetRules.from_dict(state.get("street_rules", {})),
        obstacles=_read_polygons(file, OBSTACLES.name),
        fixed_streets=_given_streets(state),
        land_uses=tuple(state["land_uses"]),
        history=_read_history(file),
        input_parts=_read_polygons(file, INPUT_BOUNDARY.name),
        issues=_read_issues(file),
    )


def _parcel_rows(
    parcel: Mapping[str, npt.NDArray[Any]], n: int, state: Mapping[str, Any]
) -> ParcelRows:
    """What the rows of a file say of parcels; all are done where it knows no stages."""
    if state["format"] < STAGES_SINCE:
        parcel = {**parcel, STAGE: np.full(n, Stage.DONE.name, dtype=object)}
    return kept_for_uses(parcel_rows(parcel, n))


def _steering(state: Mapping[str, Any]) -> tuple[FloatArray, npt.NDArray[np.uint8]]:
    """Ends of the edges that a planner decided something of, and what."""
    steered = np.asarray(state.get("steered_edges", []), dtype=np.float64).reshape(-1, 5)
    return steered[:, :4].reshape(-1, 2, 2), steered[:, 4].astype(np.uint8)


def _single(
    geometry: npt.NDArray[np.object_], kind: str
) -> tuple[npt.NDArray[np.object_], npt.NDArray[np.int64]]:
    """Valid single geometries of a kind, and the row that each comes from."""
    rows = np.flatnonzero(~shapely.is_missing(geometry))
    valid = shapely.make_valid(shapely.force_2d(geometry[rows]))
    parts, index = shapely.get_parts(valid, return_index=True)
    chosen = [i for i, p in enumerate(parts) if p.geom_type == kind and not p.is_empty]
    return parts[chosen], rows[index[chosen]]


def _given_streets(state: Mapping[str, Any]) -> tuple[GivenStreet, ...]:
    return tuple(
        GivenStreet(name, math.nan if width is None else width)
        for name, width in state["fixed_streets"]
    )


def _read_parts(file: LayoutFile, state: Mapping[str, Any]) -> tuple[LayoutParts, bool]:
    """What the file holds, and whether parcels of it were split by hand."""
    columns = ["parcel_id", "part", *PARCEL_COLUMNS]
    if state["format"] < STAGES_SINCE:
        columns = [name for name in columns if name not in (STAGE, QUOTA)]
    polygons, parcel = file.layer(PARCELS.name, *columns)
    rows = _parcel_rows(parcel, len(polygons), state)
    if not rows.is_whole:
        raise ValueError("not all parcels have all of the values that they had")
    order = np.argsort(parcel["parcel_id"], kind="stable")
    polygons = polygons[order]
    lines, street = file.layer(STREETS.name, *STREET_COLUMNS)
    segments, line = line_segments(lines)
    of_streets = street_rows(street, len(lines), n_given=len(state["fixed_streets"]))
    if (of_streets.level < 0).any():
        raise ValueError("not all streets have the level that they had")
    said = values_of_faces(
        rows.taken(order),
        polygons,
        min_area=state["min_area"],
        origin=file.frame.origin,
        land_uses=state["land_uses"],
    )
    steered, steering = _steering(state)
    parts = LayoutParts(
        polygons=polygons,
        face_part=parcel["part"][order],
        segments=segments,
        segment_level=of_streets.level[line].astype(np.int16),
        segment_fixed=of_streets.fixed[line],
        corners=_places(state["corners"]),
        entries=_places(state["entries"]),
        steered=steered,
        steering=steering,
        obstacles=_read_polygons(file, OBSTACLES.name),
        fixed_streets=_given_streets(state),
        **said.fields(),
    )
    return parts, bool(said.in_pieces.any())


def _places(xy: Any) -> FloatArray:
    return np.asarray(xy, dtype=np.float64).reshape(-1, 2)


def _read_issues(file: LayoutFile) -> tuple[Issue, ...]:
    geometry, column = file.layer(ISSUES.name, *ISSUES.column_names)
    return tuple(
        Issue(
            code=str(column["code"][i]),
            message=str(column["message"][i]),
            part=_whole(column["part"][i]),
            parcel_id=_whole(column["parcel_id"][i]),
            value=_number(column["value"][i]),
            limit=_number(column["limit"][i]),
            geometry=place,
        )
        for i, place in enumerate(geometry)
    )


def _read_history(file: LayoutFile) -> tuple[Step, ...]:
    _, column = file.layer(PROVENANCE.name, *PROVENANCE.column_names)
    return tuple(
        Step(
            algorithm=str(column["algorithm"][i]),
            parameters=json.loads(column["parameters"][i]),
            seed=int(column["seed"][i]),
            version=str(column["version"][i]),
            input_sha256=str(column["input_sha256"][i]),
            seconds=float(column["seconds"][i]),
            results=json.loads(column["results"][i]),
        )
        for i in np.argsort(column["step"], kind="stable")
    )


def _read_polygons(file: LayoutFile, name: str) -> tuple[shapely.Polygon, ...]:
    """Polygons of a layer, none where there is no such layer."""
    if name not in file.library.layer_names(file.path):
        return ()
    geometry, _ = file.layer(name, "part")
    return tuple(geometry)


def _whole(value: float | None) -> int | None:
    number = _number(value)
    return None if number is None else int(number)


def _number(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else float(value)
