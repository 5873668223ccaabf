"""Minimizing an objective: Gauss-Newton with one sparse factorization for each step.

The energies are nearly quadratic around a layout, so that two to four steps suffice; a general
least-squares routine with an iterative inner solver takes several times as long.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from urban_processing.mesh.planar import FloatArray
from urban_processing.progress import SILENT, Progress

MOST_STEPS = 12
SMALL_GAIN = 1e-3
"""Steps end when one lowers the objective by less than this share."""

SHORTEST_STEP = 1e-3
DAMPING = 1e-9
"""Added to the diagonal, relative to its mean: keeps the factorization regular."""


class LeastSquares(Protocol):
    """A sum of squares."""

    @property
    def size(self) -> int:
        """Number of unknowns."""
        ...

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals at `x`."""
        ...

    def jacobian(self, x: FloatArray) -> sp.csr_array:
        """Their derivatives at `x`."""
        ...


def minimize(problem: LeastSquares, *, progress: Progress = SILENT) -> FloatArray:
    """Return the unknowns, from zero on, that make the sum of squares small.

    The first step is taken whole, since promises that begin to count only where something is
    at its limit are not seen before it; every other one is shortened until it is a gain.
    """
    x = np.zeros(problem.size)
    if problem.size == 0:
        return x
    residuals = problem.residuals(x)
    first_cost = cost = float(residuals @ residuals)
    for i in range(MOST_STEPS):
        progress.update(i / MOST_STEPS, "Smoothing parcels and streets")
        step = _step(problem.jacobian(x), residuals)
        share = 1.0
        while True:
            new = problem.residuals(x + share * step)
            new_cost = float(new @ new)
            if i == 0 or new_cost < cost or share < SHORTEST_STEP:
                break
            share /= 2
        gain = cost - new_cost
        if i > 0 and gain <= 0:
            break
        x, residuals, cost = x + share * step, new, new_cost
        if 0 <= gain < SMALL_GAIN * cost:
            break
    return x if cost < first_cost else np.zeros(problem.size)


def _step(jacobian: sp.csr_array, residuals: FloatArray) -> FloatArray:
    normal = (jacobian.T @ jacobian).tocsc()
    diagonal = normal.diagonal()
    normal = normal + sp.diags_array(DAMPING * diagonal.mean() * np.ones(len(diagonal)))
    factor = splu(
        normal.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.asarray(-factor.solve(jacobian.T @ residuals))
