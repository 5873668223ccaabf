"""The levels of co-generation, each a pure function from one state to the next (Chen 2024, 4)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.land import default_tolerance
from urban_processing.layout import Layout, Stage
from urban_processing.mesh.planar import IntArray
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.pipelines.dimensions import check_dimensions
from urban_processing.pipelines.ground import land_area, lay_ground, settle_islands
from urban_processing.pipelines.last_levels import divide_street_blocks
from urban_processing.quotas import divided, shared_out
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way.net_floor import gross_floor
from urban_processing.site import AREA_ROUNDING, Site
from urban_processing.streets.generate import extend_streets
from urban_processing.subdivision.first_cuts import tie_together
from urban_processing.subdivision.holes import cut_through_holes
from urban_processing.subdivision.level import cut_level

MEAN_OVER_MIN = 1.37
"""Mean parcel area over the smallest allowed one, as measured over many lands."""

FLOOR_SHARE = 0.6
"""Smallest area allowed where the number of parcels is given, over their mean area."""

TOO_LARGE = 4.0
"""Parcels above so many smallest ones are cut along streamlines after another strategy."""


@dataclass(frozen=True, eq=False)
class State:
    """Everything a level needs of the one before.

    Parameters
    ----------
    layout
        Parcels and streets so far; each parcel knows whether it goes on to be cut (`Stage`), and
        how many parcels it is still to become where their total was given.
    params
        The run's parameters.
    min_area
        Smallest gross area in m² of parcels.
    level
        Number of levels so far.
    blocks_divided
        Whether another strategy than streamlines has done its last levels.
    completed
        Whether the layout has been through `finish`.
    """

    layout: Layout
    params: CogenerateParams
    min_area: float
    level: int = 0
    blocks_divided: bool = False
    completed: bool = False

    @property
    def floor(self) -> float:
        """Smallest gross area in m² that a cut along streamlines may leave."""
        return self.min_area if self.blocks_divided else self.min_area * _coarser(self.params)

    @property
    def has_quota(self) -> bool:
        """Whether each parcel is to become a given number of parcels."""
        return self.params.parcels is not None

    def to_cut(self) -> IntArray:
        """Parcels that the next level cuts."""
        return self._large_enough(Stage.OPEN, Stage.BEHIND)

    def _large_enough(self, *stages: Stage) -> IntArray:
        layout, mesh = self.layout, self.layout.mesh
        can = np.isin(layout.face_stage, stages) & ~layout.face_locked & (mesh.face_n_loops == 1)
        if self.has_quota:
            return np.flatnonzero(can & (layout.face_quota >= 2))
        return np.flatnonzero(can & (mesh.face_area >= 2.0 * self.floor * (1.0 - AREA_ROUNDING)))

    @property
    def finished(self) -> bool:
        """Whether no level is to come any more."""
        return not self.divides_blocks and not len(self.left_to_cut())

    def left_to_cut(self) -> IntArray:
        """Parcels that the next or a later level cuts along streamlines, as they are now."""
        return self._large_enough(Stage.OPEN, Stage.BEHIND, Stage.AHEAD)

    @property
    def divides_blocks(self) -> bool:
        """Whether the next level divides the blocks by another strategy than streamlines."""
        if self.blocks_divided or self.params.strategy is Strategy.STREAMLINE:
            return False
        return not len(self.left_to_cut())


def smallest_area(site: Site, params: CogenerateParams) -> float:
    """Smallest gross area in m² that a cut may leave."""
    if params.min_area is not None:
        rules = params.street_rules
        return gross_floor(params.min_area, rules) if rules.net_min_area else params.min_area
    return FLOOR_SHARE * land_area(site) / (params.parcels or 1)


def begin(site: Site, params: CogenerateParams) -> State:
    """The state before the first level: one parcel a part, cut through its holes."""
    min_area = smallest_area(site, params)
    check_dimensions(params, min_area=min_area)
    tolerance = params.simplify
    if tolerance is None:
        mean = land_area(site) / params.parcels if params.parcels else MEAN_OVER_MIN * min_area
        tolerance = default_tolerance(mean / MEAN_OVER_MIN)
    layout = lay_ground(site, params, min_area=min_area, tolerance=tolerance)
    layout = layout.replace(street_rules=params.street_rules)
    quota = np.zeros(layout.mesh.n_faces, dtype=np.int64)
    if params.parcels is not None:
        quota = shared_out(np.where(layout.face_locked, 0.0, layout.mesh.face_area), params.parcels)
    layout, parent = cut_through_holes(layout, min_area=min_area)
    quota = divided(quota, parent, layout.mesh.face_area)
    layout = settle_islands(layout, min_area=min_area)
    layout, parent = tie_together(layout, min_area=min_area, params=params)
    layout = layout.replace(
        face_quota=divided(quota, parent, layout.mesh.face_area),
        face_stage=np.full(layout.mesh.n_faces, Stage.OPEN, dtype=np.int8),
    )
    return with_streets(State(layout, params, min_area))


def step(state: State) -> State:
    """One level: cut all parcels that are large enough, then reach every parcel by street.

    Where no parcel is left to cut and another strategy makes the last levels, it divides the
    blocks.
    """
    if state.divides_blocks:
        return divide_blocks(state)
    faces = state.to_cut()
    # numbered by the parcels alone: a state that was written and read again goes on the same way
    before = canonical(state.layout)
    layout, cut, parent = cut_level(
        before,
        faces,
        min_area=state.floor,
        params=state.params,
        quota=before.face_quota[faces] if state.has_quota else None,
    )
    quota = layout.face_quota
    if state.has_quota:
        kept = before.face_quota.copy()
        kept[faces[~cut]] = 1
        quota = divided(kept, parent, layout.mesh.face_area)
    layout = layout.replace(face_stage=_next_stage(before, faces[cut])[parent], face_quota=quota)
    return with_streets(dataclasses.replace(state, layout=layout, level=state.level + 1))


def _next_stage(layout: Layout, cut: IntArray) -> npt.NDArray[np.int8]:
    """(F,) stages after a level; what could not be cut is done, unless it is locked."""
    stage = layout.face_stage
    after = np.where(stage == Stage.AHEAD, Stage.OPEN, Stage.DONE)
    after[layout.face_locked] = stage[layout.face_locked]
    after[cut] = Stage.OPEN
    return after.astype(np.int8)


def with_streets(state: State) -> State:
    """The state with the streets that its parcels need (Chen 2024, section 4.2)."""
    layout = extend_streets(
        state.layout, state.params, level=state.level, keep_ends=_keeps_ends(state)
    )
    return dataclasses.replace(state, layout=layout)


def _keeps_ends(state: State) -> bool:
    """Whether dead ends of this level stay (Chen 2024, section 6: street patterns)."""
    pattern = state.params.pattern
    if pattern is StreetPattern.CUL_DE_SAC:
        return _levels_left(state) < state.params.cul_de_sac_levels
    return pattern is StreetPattern.TREE


def _levels_left(state: State) -> int:
    """Number of levels that are still to come, as the largest parcel suggests."""
    faces = state.to_cut()
    if len(faces) == 0:
        return 0
    if state.has_quota:
        return math.ceil(math.log2(int(state.layout.face_quota[faces].max())))
    largest = float(state.layout.mesh.face_area[faces].max())
    return max(1, math.ceil(math.log2(largest / (MEAN_OVER_MIN * state.floor))))


def divide_blocks(state: State) -> State:
    """The last levels by another strategy: divide the blocks, then reach every parcel again.

    What it leaves too large goes on being cut along streamlines.
    """
    params, min_area = state.params, state.min_area
    bounds = SubdivideParams(
        strategy=params.strategy,
        min_area=min_area,
        max_area=2.0 * min_area,
        seed=params.seed,
    )
    layout = divide_street_blocks(state.layout, bounds)
    large = layout.mesh.face_area > TOO_LARGE * min_area
    layout = layout.replace(face_stage=np.where(large, Stage.OPEN, Stage.DONE).astype(np.int8))
    after = dataclasses.replace(
        state, layout=layout, level=state.level + params.last_levels, blocks_divided=True
    )
    return with_streets(after)


def _coarser(params: CogenerateParams) -> float:
    """How many smallest parcels the smallest one is that streamlines leave to another strategy."""
    return 1.0 if params.strategy is Strategy.STREAMLINE else 2.0**params.last_levels
