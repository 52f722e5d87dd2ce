"""In which directions a scan determines where the robot is: in a bare corridor, not along it.

J. Zhang, M. Kaess, S. Singh: On degeneracy of optimization-based state estimation problems. ICRA 2016. The directions
are the eigenvectors of the information matrix. Here an eigenvalue counts by its share of the echoes.
"""

from __future__ import annotations

import numpy as np

from regraft.planar import FloatArray

CONSTRAINED = 0.1
"""Least share of the echoes that lie across a direction: in bare corridors it is at most 0.07, in FROG's rooms 0.16."""


def constrained_directions(information: FloatArray, lever: float, echoes: float) -> FloatArray:
    """Return the matrix (3, 3) that keeps the constrained part of a change of the pose.

    The pose is x and y (m) and yaw (rad).

    Args:
        information: the information matrix (3, 3) of a match, without any prior.
        lever: how far (m) a turn by one radian moves an echo (root mean square); it makes turns comparable with moves.
        echoes: the sum of the echoes' weights, which is the eigenvalue of a direction that all echoes lie across.
    """
    scale = np.array([1.0, 1.0, lever])
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = vectors[:, values >= CONSTRAINED * echoes]
    directions: FloatArray = (kept @ kept.T) * np.outer(1.0 / scale, scale)
    return directions
