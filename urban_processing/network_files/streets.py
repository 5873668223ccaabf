"""Streets as other programs see them: carriageway, lanes, speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import IntArray, PlanarMesh
from urban_processing.street_rules import (
    ANY_HIGHWAY,
    HIGHWAYS,
    LEAST_CARRIAGEWAY,
    LEAST_LANE,
    TRAFFIC,
    VERGES,
    Traffic,
)
from urban_processing.streets.network_model import StreetNetwork


@dataclass(frozen=True)
class Street:
    """A network edge.

    Parameters
    ----------
    edge_id, street_id
        Its numbers in the layer of streets.
    street_class
        Its class there, which may be any text.
    width
        Width of the right-of-way in metres.

    Examples
    --------
    >>> street = Street(1, 1, "local", 12.0)
    >>> street.highway, street.carriageway, street.lanes, street.traffic.speed
    ('residential', 6.0, 2, 30)
    """

    edge_id: int
    street_id: int
    street_class: str
    width: float

    @property
    def highway(self) -> str:
        """Value of OpenStreetMap's ``highway``."""
        return HIGHWAYS.get(self.street_class, ANY_HIGHWAY)

    @property
    def traffic(self) -> Traffic:
        """Speed, lanes and priority."""
        return TRAFFIC[self.highway]

    @property
    def carriageway(self) -> float | None:
        """Width in metres less verges and pavements; None where these leave too little."""
        left = round(self.width - VERGES, 3)
        return left if left >= LEAST_CARRIAGEWAY else None

    @property
    def lanes(self) -> int | None:
        """Lanes of both directions together; None for paths, or where no width is left.

        They are as many as fit and such a street has at most: one, on which both directions take
        turns, or an even number.
        """
        if self.traffic.users or self.carriageway is None:
            return None
        fitting = min(int(self.carriageway / LEAST_LANE), self.traffic.lanes)
        return max(1, fitting - fitting % 2)


def streets_of(network: StreetNetwork) -> list[Street]:
    """Return the streets of a network, edge by edge."""
    return [
        Street(k + 1, street + 1, street_class, width)
        for k, (street, street_class, width) in enumerate(
            zip(
                network.edge_street.tolist(),
                network.edge_class.tolist(),
                network.edge_width.tolist(),
                strict=True,
            )
        )
    ]


def vertices_along(network: StreetNetwork, mesh: PlanarMesh) -> list[IntArray]:
    """Return the mesh vertices along each network edge, its ends included."""
    half = np.split(network.half_edges, network.offsets[1:-1]) if network.n_edges else []
    return [np.append(mesh.origin[h], mesh.target[h[-1]]) for h in half]
