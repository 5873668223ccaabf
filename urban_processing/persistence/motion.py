"""How a layout as a whole was moved, turned or scaled between two states."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from urban_processing.mesh.planar import FloatArray, IntArray

ObjectArray = npt.NDArray[np.object_]

_SAMPLE = 200
"""Blocks that candidates are tried on."""

_LEADERS = 12
"""Largest blocks whose shapes are looked for among the new ones, and finalists that are measured
by the area that they bring to cover."""

_REACH = 0.5
"""A block is found again if its centre comes this near to that of a new one, relative to √area."""

_SETTLED = 0.7
"""Nothing is searched for where this share of the blocks is covered in place."""

_CLOSE_CALL = 0.02
"""Candidates whose scores differ by no more are equal: the one that moves least is taken."""


@dataclass(frozen=True, eq=False)
class Motion:
    """An affine map of the plane: ``xy @ matrix.T + shift``.

    Parameters
    ----------
    matrix
        (2, 2) linear part.
    shift
        (2,) metres.
    """

    matrix: FloatArray
    shift: FloatArray

    def points(self, xy: FloatArray) -> FloatArray:
        """(n, 2) points after the motion."""
        return np.asarray(xy @ self.matrix.T + self.shift)

    def geometry(self, geometries: ObjectArray) -> ObjectArray:
        """(n,) geometries after the motion."""
        if self.is_none:
            return geometries
        return np.asarray(shapely.transform(geometries, self.points), dtype=object)

    @property
    def is_none(self) -> bool:
        """Whether everything stays in place."""
        return bool((self.matrix == np.eye(2)).all() and (self.shift == 0).all())

    @property
    def scale(self) -> float:
        """Ratio of lengths after and before, the mean of all directions."""
        return float(np.sqrt(abs(np.linalg.det(self.matrix))))


IN_PLACE = Motion(np.eye(2), np.zeros(2))


@dataclass(frozen=True, eq=False)
class Shapes:
    """What the search looks at of n blocks.

    Parameters
    ----------
    polygons
        (n,) the blocks.
    corners
        Corners of each shell, counter-clockwise.
    """

    polygons: ObjectArray
    corners: list[FloatArray]

    @cached_property
    def centre(self) -> FloatArray:
        """(n, 2) centroids."""
        return np.asarray(shapely.get_coordinates(shapely.centroid(self.polygons)))

    @cached_property
    def area(self) -> FloatArray:
        """(n,) areas."""
        return np.asarray(shapely.area(self.polygons))

    def rows(self, rows: IntArray) -> Shapes:
        """Some of the blocks."""
        return Shapes(self.polygons[rows], [self.corners[i] for i in rows])


def find_motion(old: Shapes, new: Shapes) -> tuple[Motion, float, float]:
    """Find the motion that brings most old blocks onto new ones.

    Candidates are those that bring centroid and extent of all blocks together, and those that
    bring one of the largest old blocks onto a new one of like shape (corners by least
    squares). They are tried on the centres and areas of a sample of blocks; the best are
    adjusted by least squares and then measured by the area that they bring to cover.

    Parameters
    ----------
    old, new
        Blocks before and after, at least one each.

    Returns
    -------
    motion
        The best.
    score
        Share of the blocks that it brings onto new ones, 0 to 1: area in common over area of
        both, summed over a sample.
    in_place
        The same where nothing moves.
    """
    few = old.rows(_spread(old.area, _SAMPLE))
    index = shapely.STRtree(new.polygons)
    in_place = _covered(IN_PLACE, few, new, index)
    if in_place >= _SETTLED:
        return IN_PLACE, in_place, in_place
    tree, area = cKDTree(new.centre), new.area
    candidates = [IN_PLACE, *_by_extent(old, new), *_by_shape(old, new)]
    rough = np.array([_rough_score(motion, few, tree, area) for motion in candidates])
    finalists = np.argsort(-np.round(rough, 6), kind="stable")[:_LEADERS]
    moving = [_adjusted(candidates[i], few, new, tree) for i in finalists if i > 0]
    scores = [_covered(motion, few, new, index) for motion in moving]
    if not moving:
        return IN_PLACE, in_place, in_place
    near = [m for m, s in zip(moving, scores, strict=True) if s >= max(scores) - _CLOSE_CALL]
    travel = [np.round(_travel(motion, few), 3) for motion in near]
    return near[int(np.argmin(travel))], max(scores), in_place


def _spread(area: FloatArray, count: int) -> IntArray:
    """Rows of some blocks, large and small."""
    order = np.argsort(-area, kind="stable")
    step = np.linspace(0, len(order) - 1, min(count, len(order)))
    return np.asarray(order[np.unique(step.astype(np.int64))])


def _by_extent(old: Shapes, new: Shapes) -> list[Motion]:
    """Motions that bring centroid and extent of all blocks together."""
    (a, weight_a), (b, weight_b) = (old.centre, old.area), (new.centre, new.area)
    mean_a, mean_b = (
        np.average(a, axis=0, weights=weight_a),
        np.average(b, axis=0, weights=weight_b),
    )
    scale = float(np.sqrt(weight_b.sum() / weight_a.sum()))
    box_a = shapely.total_bounds(old.polygons)
    box_b = shapely.total_bounds(new.polygons)
    stretch = np.diag((box_b[2:] - box_b[:2]) / (box_a[2:] - box_a[:2]))
    out = [
        Motion(stretch, box_b[:2] - stretch @ box_a[:2]),
        Motion(scale * np.eye(2), mean_b - scale * mean_a),
        Motion(np.eye(2), mean_b - mean_a),
    ]
    if len(a) > 1 and len(b) > 1:
        turn = _main_direction(b - mean_b, weight_b) - _main_direction(a - mean_a, weight_a)
        for angle in (turn, turn + np.pi):
            matrix = scale * _rotation(angle)
            out.append(Motion(matrix, mean_b - matrix @ mean_a))
    return out


def _main_direction(xy: FloatArray, weight: FloatArray) -> float:
    z2 = (weight * (xy[:, 0] + 1j * xy[:, 1]) ** 2).sum()
    return 0.5 * float(np.angle(z2))


def _rotation(angle: float) -> FloatArray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _by_shape(old: Shapes, new: Shapes) -> list[Motion]:
    """Motions that bring one of the largest old blocks onto a new one of the same shape."""
    out = []
    size = np.array([len(corners) for corners in new.corners])
    for i in _largest(old.area):
        rows = np.flatnonzero(size == len(old.corners[i]))
        if not len(rows):
            continue
        a = _complex(old.corners[i])
        b = np.array([_complex(new.corners[j]) for j in rows])
        out += _fitted(a, b)
    return out


def _largest(area: FloatArray) -> list[int]:
    return [int(i) for i in np.argsort(-area, kind="stable")[:_LEADERS]]


def _fitted(a: npt.NDArray[np.complex128], b: npt.NDArray[np.complex128]) -> list[Motion]:
    """Similarities by least squares from one ring to others, the best few of all rotations."""
    mean_a, mean_b = a.mean(), b.mean(axis=1)
    centred_a, centred_b = a - mean_a, b - mean_b[:, None]
    turned = (np.arange(len(a))[:, None] + np.arange(len(a))) % len(a)  # rotation, vertex
    product = np.einsum("v,nrv->nr", centred_a.conj(), centred_b[:, turned])
    norm_a = (abs(centred_a) ** 2).sum()
    norm_b = (abs(centred_b) ** 2).sum(axis=1)
    likeness = abs(product) / np.sqrt(norm_a * norm_b)[:, None]
    best = np.argsort(-np.round(likeness, 6), axis=None, kind="stable")[:_LEADERS]
    out = []
    for j, r in zip(*np.unravel_index(best, likeness.shape), strict=True):
        factor = product[j, r] / norm_a
        matrix = np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])
        shift = mean_b[j] - factor * mean_a
        out.append(Motion(matrix, np.array([shift.real, shift.imag])))
    return out


def _complex(xy: FloatArray) -> npt.NDArray[np.complex128]:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _found_again(
    motion: Motion, old: Shapes, tree: cKDTree, area: FloatArray
) -> tuple[FloatArray, IntArray]:
    """(n,) how well each old block is found again, and (n,) the new one nearest to it."""
    distance, rows = tree.query(motion.points(old.centre))
    nearest = np.asarray(rows, dtype=np.int64)
    moved = np.maximum(old.area * motion.scale**2, 1e-12)
    like = np.minimum(moved, area[nearest]) / np.maximum(moved, area[nearest])
    off = distance / np.sqrt(np.minimum(moved, area[nearest]))
    return np.asarray(like * np.clip(1.0 - off / _REACH, 0.0, None)), nearest


def _rough_score(motion: Motion, old: Shapes, tree: cKDTree, area: FloatArray) -> float:
    return float(_found_again(motion, old, tree, area)[0].mean())


def _adjusted(motion: Motion, old: Shapes, new: Shapes, tree: cKDTree) -> Motion:
    """Fit a motion to the blocks that it finds again, by least squares, twice."""
    for _ in range(2):
        found, nearest = _found_again(motion, old, tree, new.area)
        good = np.flatnonzero(found > 0.2)
        centre = old.centre[good]
        if len(good) < 4 or np.linalg.matrix_rank(centre - centre.mean(axis=0), tol=1e-3) < 2:
            return motion
        middle = centre.mean(axis=0)
        design = np.column_stack([centre - middle, np.ones(len(good))])
        fit, *_ = np.linalg.lstsq(design, new.centre[nearest[good]], rcond=None)
        if np.linalg.det(fit[:2]) <= 0:
            return motion
        motion = Motion(fit[:2].T, fit[2] - fit[:2].T @ middle)
    return motion


def _covered(motion: Motion, old: Shapes, new: Shapes, index: shapely.STRtree) -> float:
    """Area in common with the new blocks over the area of both, best pair of each old block."""
    moved = motion.geometry(old.polygons)
    a, b = index.query(moved)
    common = shapely.area(shapely.intersection(moved[a], new.polygons[b]))
    both = shapely.area(moved)[a] + new.area[b] - common
    best = np.zeros(len(moved))
    np.maximum.at(best, a, common / both)
    return float(best.mean())


def _travel(motion: Motion, old: Shapes) -> float:
    """Mean way of the corners."""
    xy = np.vstack(old.corners)
    return float(np.hypot(*(motion.points(xy) - xy).T).mean())
