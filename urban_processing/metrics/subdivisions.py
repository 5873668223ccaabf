"""Subdivisions measured, and as tables."""

from __future__ import annotations

from collections import Counter
from functools import cached_property

import numpy as np
import shapely

from urban_processing.blocks.model import ragged_rows
from urban_processing.fabric.model import ParcelRings
from urban_processing.layout import PARCEL_USE
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.parcels import ParcelMeasures, box_sides, measure_rings
from urban_processing.metrics.tables import parcel_columns
from urban_processing.parcelling.layers import SUBDIVIDED_BLOCKS, SUBDIVIDED_PARCELS
from urban_processing.parcelling.rules import rule_values
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.persistence.layers import CHANGES
from urban_processing.schema import ISSUES
from urban_processing.tables import (
    LayerSet,
    Table,
    issue_table,
    issues_in_words,
    make_table,
    to_map,
)

SUBDIVISION_KIND = "subdivision"
"""What files say that they hold."""

PATIO_USE = "patio"
"""Land use of the inside of a perimeter block."""


class MeasuredSubdivision:
    """A subdivision and all that is worked out of it, each thing once."""

    def __init__(self, made: Subdivision) -> None:
        self.made = made

    @cached_property
    def parcels(self) -> ParcelMeasures:
        """Measures of the parcels."""
        made = self.made
        rings = ragged_rows(np.arange(len(made.pieces.face) + 1), self._shells)
        edges = ragged_rows(made.pieces.offsets, rings)
        return measure_rings(
            ParcelRings(
                xy=made.pieces.xy[made.pieces.vertex[edges]],
                offsets=np.append(0, np.cumsum(np.diff(made.pieces.offsets)[rings])),
                on_street=made.edge_frontage[edges],
                frontage=made.frontage,
                polygons=made.polygons,
                area=np.asarray(shapely.area(made.polygons)),
                rim=self._rim,
            )
        )

    @cached_property
    def boxes(self) -> FloatArray:
        """(F, 2) shorter and longer side of the smallest rotated rectangle around each parcel."""
        return box_sides(self.made.polygons)

    @property
    def _shells(self) -> IntArray:
        return np.flatnonzero(np.diff(self.made.pieces.face, prepend=-1))

    @property
    def _rim(self) -> BoolArray:
        """(F,) parcels with an edge that no other parcel of the block has."""
        pieces = self.made.pieces
        a, b = pieces.vertex, pieces.vertex[pieces.following]
        pair = np.minimum(a, b) * np.int64(len(pieces.xy)) + np.maximum(a, b)
        _, inverse, count = np.unique(pair, return_inverse=True, return_counts=True)
        alone = count[inverse.ravel()] == 1
        out = np.zeros(pieces.n_faces, dtype=bool)
        out[pieces.edge_face[alone]] = True
        return out

    def layers(self) -> LayerSet:
        """Return parcels, blocks and issues as layers, with a summary."""
        made = self.made
        return LayerSet(
            kind=SUBDIVISION_KIND,
            tables={
                SUBDIVIDED_PARCELS: self._parcel_table(),
                SUBDIVIDED_BLOCKS: self._block_table(),
                ISSUES: issue_table(made.issues, made.blocks.frame),
                **({} if made.changes is None else {CHANGES: made.changes}),
            },
            frame=made.blocks.frame,
            history=made.history,
            summary=tuple(self._summary()),
        )

    def _parcel_table(self) -> Table:
        made, p = self.made, self.parcels
        pieces = made.pieces
        n = pieces.n_faces
        strategy = rule_values(made.wanted)["strategy"]
        return make_table(
            SUBDIVIDED_PARCELS,
            {
                "parcel_id": made.parcel_id,
                "part": pieces.block,
                "level": pieces.level,
                "net_area_m2": p.area,
                **parcel_columns(p),
                "land_use": np.where(pieces.patio, PATIO_USE, PARCEL_USE),
                "locked": np.zeros(n, dtype=bool),
                "lineage": [f"{v:016x}" for v in pieces.lineage.tolist()],
                "block_id": made.blocks.block_id[pieces.block],
                "strategy": strategy[pieces.block],
                "box_width_m": self.boxes[:, 0],
                "box_length_m": self.boxes[:, 1],
            },
            to_map(made.polygons, made.blocks.frame),
        )

    def _block_table(self) -> Table:
        made = self.made
        values = rule_values(made.wanted)
        return make_table(
            SUBDIVIDED_BLOCKS,
            {
                "block_id": made.blocks.block_id,
                "part": np.arange(len(made.blocks)),
                "area_m2": shapely.area(made.blocks.polygons),
                "parcels": np.bincount(made.pieces.block, minlength=len(made.blocks)),
                "block_key": made.block_key,
                **values,
            },
            to_map(made.blocks.polygons, made.blocks.frame),
        )

    def _summary(self) -> list[tuple[str, str]]:
        p, pieces = self.parcels, self.made.pieces
        parcels = ~pieces.patio
        area, land = p.area[parcels], float(shapely.area(self.made.blocks.polygons).sum())
        rows = [
            ("blocks", f"{len(self.made.blocks):,}, {land / 1e4:,.2f} ha"),
            (
                "parcels",
                f"{int(parcels.sum()):,}, {area.mean():,.0f} m² in the mean, "
                f"{(p.sides[parcels] == 4).mean():.1%} with four sides, "
                f"{p.reached[parcels].mean():.1%} at a street",
            ),
        ]
        if self.made.changes is not None:
            count = Counter(self.made.changes["change"].tolist())
            rows.append(("changes", ", ".join(f"{n:,} {name}" for name, n in count.items())))
        if pieces.patio.any():
            rows.append(("patios", f"{int(pieces.patio.sum()):,}"))
        if self.made.issues:
            rows.append(("issues", f"{issues_in_words(self.made.issues)} (see the layer issues)"))
        return rows
