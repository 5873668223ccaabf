"""Connected components of things joined by pairs."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from urban_processing.mesh.planar import IntArray


def components(n: int, pairs: IntArray) -> IntArray:
    """(n,) component of each of n things joined by pairs, numbered by their lowest member."""
    if n == 0:
        return np.empty(0, dtype=np.int64)
    ones = np.ones(len(pairs), dtype=np.int8)
    _, label = connected_components(
        coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(n, n)), directed=False
    )
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse]
