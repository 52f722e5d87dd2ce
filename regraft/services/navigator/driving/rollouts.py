"""Short forecasts: where a robot gets when it is asked for a twist, and what it comes close to."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Twist2D
from regraft.services.navigator.driving.robot import Footprint, Limits

# Shares of the greatest velocity and of the greatest turning rate that are tried. Gentle curves are tried
# more finely: they decide whether a narrow gap is met straight.
SPEEDS = (1.0, 0.75, 0.5, 0.25, 0.1)
CURVES = tuple(float(np.sign(share) * share**2) for share in np.linspace(-1.0, 1.0, 19))
TURNS = (-0.6, -0.3, 0.3, 0.6)
# Of more echoes the nearest ones decide, and those that the robot may hit before it stops. So many are rare.
MAX_POINTS = 80


@dataclass(frozen=True, slots=True, eq=False)
class Rollouts:
    """Forecasts for N target twists at T moments.

    `v`, `w` (N,) are the targets; `x`, `y` (m), `yaw` (rad) (N, T) the poses in the base frame of now.
    """

    v: FloatArray
    w: FloatArray
    x: FloatArray
    y: FloatArray
    yaw: FloatArray

    def only(self, chosen: NDArray[np.intp]) -> Self:
        """Return the forecasts with these indices, in their order."""
        return type(self)(self.v[chosen], self.w[chosen], self.x[chosen], self.y[chosen], self.yaw[chosen])

    def passed(self, points: FloatArray, reach: float) -> FloatArray:
        """Return those of (M, 2) base-frame points that may be within `reach` (m) of the axle's middle at some pose."""
        if not self.x.size or len(points) < 2:
            return points
        px, py = points[:, 0], points[:, 1]
        inside = (px >= self.x.min() - reach) & (px <= self.x.max() + reach)
        inside &= (py >= self.y.min() - reach) & (py <= self.y.max() + reach)
        kept: FloatArray = points[inside]
        # The product with a single column is rounded differently: clearances must not depend on what is left out.
        return points if len(kept) == 1 else kept

    def clearances(self, footprint: Footprint, points: FloatArray) -> FloatArray:
        """Return (N, T) distances (m) from the outline to the nearest of (M, 2) base-frame points."""
        if not len(points):
            return np.full(self.x.shape, np.inf)
        # Single precision is far finer than a lidar and halves the time; this is where it goes.
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        to_x, to_y = np.empty((2, *cos.shape, 3), np.float32)
        to_x[..., 0], to_x[..., 1] = cos, sin
        to_x[..., 2] = -(cos * self.x + sin * self.y) - footprint.centre
        to_y[..., 0], to_y[..., 1] = -sin, cos
        to_y[..., 2] = sin * self.x - cos * self.y
        columns = np.ones((3, len(points)), np.float32)
        columns[:2] = points.T
        return footprint.nearest(to_x @ columns, to_y @ columns).astype(np.float64)


@lru_cache(maxsize=8)
def candidates(limits: Limits) -> tuple[FloatArray, FloatArray]:
    """Return the target twists worth trying, (v, w), each (N,): curves, turns in place, and standing."""
    tried = [
        limits.saturate(Twist2D(speed * limits.max_velocity, curve * limits.max_turn_rate))
        for speed in SPEEDS
        for curve in CURVES
    ]
    tried += [limits.saturate(Twist2D(0.0, turn * limits.max_turn_rate)) for turn in TURNS]
    tried.append(Twist2D())
    return np.array([twist.v for twist in tried]), np.array([twist.w for twist in tried])


def forecast(
    targets: tuple[FloatArray, FloatArray], current: Twist2D, limits: Limits, horizon: float, step: float
) -> Rollouts:
    """Drive each target (v, w) for `horizon` seconds, accelerating from `current`; a pose every `step`."""
    v, w = targets
    middle = _moments(horizon, step)
    reached_v = _ramp(current.v, v, limits.acceleration, middle)
    reached_w = _ramp(current.w, w, limits.turn_acceleration, middle)
    yaw = reached_w.cumsum(axis=1) * step
    heading = yaw - reached_w * (step / 2)
    x = (reached_v * np.cos(heading)).cumsum(axis=1) * step
    y = (reached_v * np.sin(heading)).cumsum(axis=1) * step
    return Rollouts(v, w, x, y, yaw)


@lru_cache(maxsize=8)
def _moments(horizon: float, step: float) -> FloatArray:
    """Return the middles (s) of the steps of a forecast."""
    return np.arange(step / 2, horizon, step, dtype=np.float64)


def in_place(angles: FloatArray) -> Rollouts:
    """Return one forecast of a turn in place through the given headings (T,) in rad."""
    still = np.zeros((1, len(angles)))
    return Rollouts(np.zeros(1), np.zeros(1), still, still, angles[None, :])


def nearby(points: FloatArray, reach: float, critical: float) -> FloatArray:
    """Return those of (N, 2) base-frame points within `reach` (m).

    If there are many, they are the nearest ones, and none within `critical` (m) is left out.
    """
    distance = np.hypot(points[:, 0], points[:, 1])
    close = distance <= reach
    if np.count_nonzero(close) > MAX_POINTS:
        close &= distance <= max(float(np.partition(distance, MAX_POINTS - 1)[MAX_POINTS - 1]), critical)
    near: FloatArray = points[close]
    return near


def _ramp(start: float, targets: FloatArray, rate: float, times: FloatArray) -> FloatArray:
    """Return (N, T) values that move from `start` towards (N,) targets by at most `rate` per second."""
    change = targets[:, None] - start
    most = rate * times
    ramp: FloatArray = start + np.minimum(np.maximum(change, -most), most)
    return ramp
