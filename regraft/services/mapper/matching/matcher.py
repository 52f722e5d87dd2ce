"""Scan matching: the pose at which a scan fits the map best, found step by step from a good guess.

A. Censi: An ICP variant using a point-to-line metric. ICRA 2008. Here it is against the surfaces of the map, with
weights that let far misses count less. Directions that the scan does not constrain are left to the odometry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from regraft.planar import FloatArray, Pose2D, wrap_angle
from regraft.services.mapper.matching.degeneracy import constrained_directions
from regraft.services.mapper.matching.surface import Surface

STEPS = 10
CLOSE_ENOUGH = 5e-4
"""m and rad: a step shorter than that is the last."""
REACH = 0.3
"""m: an echo further away from every surface is left out."""
TYPICAL_MISS = 0.03
"""m: misses much larger count less and less (Cauchy's weights)."""
FITS = 0.08
"""m: an echo within that distance of a surface fits."""
MAX_ECHOES = 120
"""Echoes that are matched, evenly chosen."""


@dataclass(frozen=True, slots=True)
class Prior:
    """How far the guess may be off: standard deviations of the position (m, each axis) and the heading (rad)."""

    position: float = 0.05
    heading: float = 0.05


NARROW = Prior()


@dataclass(frozen=True, slots=True)
class Match:
    """A pose and how well the scan fits there.

    ``inliers`` echoes lie at known surfaces, of ``expected`` that lie on known ground or at known surfaces.
    """

    pose: Pose2D
    inliers: int
    expected: int

    @property
    def ratio(self) -> float:
        """The share of the expected echoes that fit; 1 if none is expected."""
        return self.inliers / self.expected if self.expected else 1.0


def fit(surface: Surface, echoes: FloatArray, pose: Pose2D) -> Match:
    """Return how well echoes (n, 2; m, base frame) fit the map at a pose."""
    placed = pose.outward(echoes)
    distances, _ = surface.tree.query(placed, distance_upper_bound=FITS)
    matched = np.isfinite(distances)
    expected = matched | surface.knows(placed)
    return Match(pose, int(np.count_nonzero(matched)), int(np.count_nonzero(expected)))


def match(
    surface: Surface, echoes: FloatArray, guess: Pose2D, prior: Prior = NARROW, start: Pose2D | None = None
) -> Match:
    """Return the best pose near a guess for echoes (n, 2; m, base frame), which is looked for from ``start`` on.

    In directions that the echoes do not constrain, the pose is that of the guess.
    """
    if not len(echoes) or not len(surface.points):
        return fit(surface, echoes, guess)
    echoes = echoes[:: math.ceil(len(echoes) / MAX_ECHOES)]
    stiffness = np.array([prior.position, prior.position, prior.heading]) ** -2 * TYPICAL_MISS**2
    pose = start or guess
    for _ in range(STEPS):
        pull = _pull(surface, echoes, pose)
        force = pull.force - stiffness * _between(guess, pose)
        step: list[float] = np.linalg.solve(pull.curvature + np.diag(stiffness), force).tolist()
        pose = _moved(pose, step)
        if math.hypot(step[0], step[1]) < CLOSE_ENOUGH and abs(step[2]) < CLOSE_ENOUGH:
            break
    pull = _pull(surface, echoes, pose)
    kept = constrained_directions(pull.curvature, pull.lever, pull.weight)
    return fit(surface, echoes, _moved(guess, (kept @ _between(guess, pose)).tolist()))


@dataclass(frozen=True, slots=True)
class _Pull:
    """How a surface pulls at echoes: the gradient and curvature of half the sum of the squared misses, by pose.

    ``weight`` is the sum of the echoes' weights, ``lever`` how far (m) a turn by one radian moves them.
    """

    force: FloatArray
    curvature: FloatArray
    weight: float
    lever: float


def _pull(surface: Surface, echoes: FloatArray, pose: Pose2D) -> _Pull:
    placed = pose.outward(echoes)
    distances, nearest = surface.tree.query(placed, distance_upper_bound=REACH)
    near = np.isfinite(distances)
    placed, nearest, distances = placed[near], nearest[near], distances[near]
    weights = 1.0 / (1.0 + (distances / TYPICAL_MISS) ** 2)
    xx, xy, yy = (surface.weights[nearest] * weights[:, None]).T
    miss_x, miss_y = (surface.points[nearest] - placed).T
    # Turning by one radian moves an echo by its distance from the robot, across the direction to it.
    turn_x, turn_y = pose.y - placed[:, 1], placed[:, 0] - pose.x
    pull_x, pull_y = xx * miss_x + xy * miss_y, xy * miss_x + yy * miss_y
    lever_x, lever_y = xx * turn_x + xy * turn_y, xy * turn_x + yy * turn_y
    force: FloatArray = np.array([pull_x.sum(), pull_y.sum(), (pull_x * turn_x + pull_y * turn_y).sum()])
    x_y, x_yaw, y_yaw = xy.sum(), lever_x.sum(), lever_y.sum()
    yaw_yaw = (lever_x * turn_x + lever_y * turn_y).sum()
    curvature: FloatArray = np.array([[xx.sum(), x_y, x_yaw], [x_y, yy.sum(), y_yaw], [x_yaw, y_yaw, yaw_yaw]])
    weight = float(weights.sum())
    lever = math.sqrt(float((weights * (turn_x**2 + turn_y**2)).sum()) / weight) if weight else 1.0
    return _Pull(force, curvature, weight, lever)


def _between(one: Pose2D, other: Pose2D) -> FloatArray:
    return np.array([other.x - one.x, other.y - one.y, wrap_angle(other.yaw - one.yaw)])


def _moved(pose: Pose2D, step: list[float]) -> Pose2D:
    x, y, yaw = step
    return Pose2D(pose.x + x, pose.y + y, wrap_angle(pose.yaw + yaw))
