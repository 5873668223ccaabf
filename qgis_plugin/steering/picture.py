"""A state of a session as features of QGIS, and what differs between two of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import shapely
from qgis.core import QgsFeature, QgsFields, QgsGeometry

from qgis_plugin.steering.fields import DONE, LOCKED, TO_CUT, parcel_fields, street_fields
from qgis_plugin.steering.model import Difference, StreetKey
from urban_processing.layout import Layout
from urban_processing.session.session import Session
from urban_processing.streets.network import street_network

K = TypeVar("K")
V = TypeVar("V")


@dataclass(frozen=True)
class ParcelLook:
    """What there is to see of a parcel; `outline` is WKB in map coordinates."""

    outline: bytes
    state: str
    land_use: str
    area: float


@dataclass(frozen=True)
class Picture:
    """Parcels by number, and streets by what there is to see of them.

    The value of a street is the number of the given street that it lies on, or None.
    """

    parcels: Mapping[int, ParcelLook] = field(default_factory=dict)
    streets: Mapping[StreetKey, int | None] = field(default_factory=dict)


def picture_of(session: Session) -> Picture:
    """Return what there is to see of a session's layout."""
    layout = session.layout
    return Picture(_parcels(layout, session), _streets(layout))


def difference(before: Picture, after: Picture, *, whole: bool = False) -> Difference:
    """Return the features that go and come from one picture to another.

    With `whole` all features of the one go and all of the other come.
    """
    parcels = _new(before.parcels, after.parcels, whole=whole)
    streets = _new(before.streets, after.streets, whole=whole)
    return Difference(
        parcels_gone=_gone(before.parcels, after.parcels, whole=whole),
        parcels=dict(_parcel_features(parcels)),
        streets_gone=_gone(before.streets, after.streets, whole=whole),
        streets=dict(_street_features(streets)),
        whole=whole,
    )


def _gone(before: Mapping[K, V], after: Mapping[K, V], *, whole: bool) -> tuple[K, ...]:
    return tuple(key for key, look in before.items() if whole or after.get(key) != look)


def _new(before: Mapping[K, V], after: Mapping[K, V], *, whole: bool) -> Mapping[K, V]:
    if whole:
        return after
    # a parcel's look is never None; a street that is not given is known by its key alone
    return {key: look for key, look in after.items() if key not in before or before[key] != look}


def _parcels(layout: Layout, session: Session) -> dict[int, ParcelLook]:
    outlines = shapely.to_wkb(layout.mesh.face_polygons(layout.frame.origin)).tolist()
    to_cut = np.isin(session.parcels, session.to_cut)
    states = np.where(layout.face_locked, LOCKED, np.where(to_cut, TO_CUT, DONE))
    return {
        number: ParcelLook(outline, state, layout.land_uses[use], area)
        for number, outline, state, use, area in zip(
            session.parcels,
            outlines,
            states.tolist(),
            layout.face_use.tolist(),
            layout.mesh.face_area.tolist(),
            strict=True,
        )
    }


def _streets(layout: Layout) -> dict[StreetKey, int | None]:
    net = street_network(layout)
    lines = shapely.to_wkb(net.lines(layout.mesh, layout.frame.origin)).tolist()
    fixed = [None if number < 0 else number + 1 for number in net.edge_fixed.tolist()]
    keys = zip(lines, net.edge_class.tolist(), net.edge_width.tolist(), strict=True)
    return dict(zip(keys, fixed, strict=True))


def _parcel_features(parcels: Mapping[int, ParcelLook]) -> Iterator[tuple[int, QgsFeature]]:
    fields = parcel_fields()
    for number, look in parcels.items():
        values = [number, look.state, look.land_use, look.area]
        yield number, _feature(fields, values, look.outline)


def _street_features(
    streets: Mapping[StreetKey, int | None],
) -> Iterator[tuple[StreetKey, QgsFeature]]:
    fields = street_fields()
    for key, fixed in streets.items():
        line, class_, width = key
        yield key, _feature(fields, [class_, width, fixed], line)


def _feature(fields: QgsFields, values: list[Any], wkb: bytes) -> QgsFeature:
    feature = QgsFeature(fields)
    feature.setAttributes(values)
    shape = QgsGeometry()
    shape.fromWkb(wkb)
    feature.setGeometry(shape)
    return feature
