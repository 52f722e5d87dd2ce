"""Products of many vectors at once.

Written without matrix multiplication: the BLAS behind it would keep all cores busy with products this narrow.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Vectors = npt.NDArray[Any]


def dot(first: Vectors, second: Vectors) -> Vectors:
    """Return the scalar products (n) of vectors (n, 3) with others, or with one vector (3)."""
    product = first[:, 0] * second[..., 0]
    product += first[:, 1] * second[..., 1]
    product += first[:, 2] * second[..., 2]
    return np.asarray(product)


def rotate(vectors: Vectors, rotation: Vectors) -> Vectors:
    """Return vectors (n, 3) turned by a rotation matrix given as 9 numbers, row by row."""
    return np.stack([dot(vectors, row) for row in rotation.reshape(3, 3)], axis=1)


def unrotate(vectors: Vectors, rotation: Vectors) -> Vectors:
    """Return vectors (n, 3) turned by the inverse of a rotation matrix given as 9 numbers, row by row."""
    return rotate(vectors, rotation.reshape(3, 3).T)
