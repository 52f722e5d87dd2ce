"""Local control: follows a path by choosing among forecasts, as the dynamic window approach does.

D. Fox, W. Burgard, S. Thrun: The dynamic window approach to collision avoidance. IEEE Robotics &
Automation Magazine 4(1), 1997. Unlike there, all admissible twists are tried, not only those that the next
period can reach: the forecasts accelerate towards them.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise

import numpy as np

from regraft.planar import FloatArray, Twist2D
from regraft.services.navigator.driving.local_controller import TURN_FROM, TURN_UNTIL, Decision, Manoeuvres, Situation
from regraft.services.navigator.driving.rollouts import Rollouts, candidates
from regraft.services.navigator.polyline import lengths_along, points_along, stretch_ahead

AIM = 0.35  # m along the path: where to look when deciding whether to turn in place first
AIMED = np.array([AIM])
SHORTEST = 0.005  # m: the length of a forecast for a robot that is hardly allowed to drive
# A slow robot has short forecasts, and still looks this far ahead (m): else staying on the path outweighs progress.
NEAREST_TARGET = 0.2
SIDEWAYS = 0.4
ROOMY = 0.10  # m beyond the margin to drive at full speed
SLACK = 0.01  # m, far more than single precision rounds
PORTIONS = (8, 24, 56)


@dataclass(frozen=True, slots=True)
class Weights:
    """The weights of the choice among forecasts, each against ending a full forecast's length off target."""

    off_path: float = 0.6  # for a full length, mean over the forecast
    heading: float = 0.12  # per rad, at the end
    closeness: float = 0.15  # for touching; fades out at `close`
    unsteadiness: float = 0.025  # per rad/s of change
    close: float = 0.20  # m


@dataclass(frozen=True, slots=True)
class RolloutController:
    """Tries about a hundred twists, each driven for a while, and takes the one that serves the path best.

    How near they come to obstacles takes most of the time. So those that serve the path best are looked at first, in
    ``portions`` that end at these numbers. One that costs more by its course alone than another in all is never best.
    """

    manoeuvres: Manoeuvres = field(default=Manoeuvres())
    weights: Weights = field(default=Weights())
    portions: tuple[int, ...] = PORTIONS

    def follow(self, now: Situation, path: FloatArray, turning: bool = False) -> Decision:
        """Choose the twist that brings the robot along `path` (N, 2)."""
        length = self.manoeuvres.foresight(now) * now.limits.max_velocity + 2 * AIM
        ahead = now.pose.inward(stretch_ahead(path, now.pose, length))
        along = lengths_along(ahead)
        aim = points_along(ahead, AIMED, along)[0]
        bearing = math.atan2(aim[1], aim[0])
        if abs(bearing) > (TURN_UNTIL if turning else TURN_FROM):
            turn = self.manoeuvres.turn_by(now, bearing)
            if not turn.blocked:
                return turn
        return self._best(now, ahead, along)

    def _best(self, now: Situation, ahead: FloatArray, along: FloatArray) -> Decision:
        doing, greatest = self.manoeuvres, now.limits.max_velocity
        tried = doing.forecast(now, candidates(now.limits))
        points = doing.near(now, doing.foresight(now) * greatest + self.weights.close)
        # Room beyond these clearances makes no difference. Rounding must not either, so a little more is looked at.
        matters = max(self.weights.close, doing.margin + ROOMY) + SLACK
        passed = tried.passed(points, doing.footprint.circumradius + matters)
        gap = doing.required_gap(points)
        course, change = self._costs(now, tried, ahead, along)
        least = course + change
        order = least.argsort(kind="stable")
        moving = (tried.v > 0.0) | (greatest == 0.0)
        costs = np.full(len(least), np.inf)
        ends = (*self.portions, len(order)) if gap == doing.margin else (len(order),)
        for start, end in pairwise((0, *ends)):
            chosen = order[start:end]
            if np.isfinite(costs[moving]).any() and costs.min() < least[chosen[0]]:
                break
            closeness = self._closeness(tried.only(chosen), passed, gap, greatest)
            costs[chosen] = course[chosen] + closeness + change[chosen]
        if not np.isfinite(costs[moving]).any():
            return doing.halt(now)
        best = int(costs.argmin())
        return Decision(now.reachable(Twist2D(float(tried.v[best]), float(tried.w[best]))))

    def _closeness(self, tried: Rollouts, passed: FloatArray, gap: float, greatest: float) -> FloatArray:
        """Return what it costs each forecast to come near to the points ``passed``; infinite where it is not allowed.

        The robot has to keep ``gap`` (m), or the margin where all forecasts do.
        """
        doing, weights = self.manoeuvres, self.weights
        clearances = tried.clearances(doing.footprint, passed)
        nearest = clearances.min(axis=1)
        # Slow down where it is tight, not only where a collision is near; but not long before, or the robot
        # would rather creep straight on than steer around something.
        soon = clearances[:, : max(1, round(doing.horizon / doing.step / 3))].min(axis=1)
        room = np.minimum(np.maximum((soon - doing.margin) / ROOMY, 0.25), 1.0)
        kept = doing.margin if nearest.min() >= doing.margin else gap
        admissible = (nearest >= kept) & (tried.v <= room * greatest + 1e-9)
        return np.where(admissible, weights.closeness * np.maximum(1.0 - nearest / weights.close, 0.0), np.inf)

    def _costs(
        self, now: Situation, tried: Rollouts, ahead: FloatArray, along: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return what each forecast costs by where it leads, and by the change of the turning rate."""
        length = max(self.manoeuvres.foresight(now) * now.limits.max_velocity, SHORTEST)
        aim = max(length, NEAREST_TARGET)
        line = points_along(ahead, _looked_at(aim), along)
        target, beyond = line[-2], line[-1]
        # Being next to the target matters less than being short of it. Otherwise the robot prefers a stop before an
        # obstacle to a way around it.
        direction = target / max(float(np.hypot(target[0], target[1])), 1e-9)
        miss_x, miss_y = tried.x[:, -1] - target[0], tried.y[:, -1] - target[1]
        along = miss_x * direction[0] + miss_y * direction[1]
        beside = SIDEWAYS * (miss_y * direction[0] - miss_x * direction[1])
        short = np.hypot(along, beside)
        # Points of the line along the first axis: the minimum over that one is the fastest.
        some_x, some_y = tried.x[:, 1::3], tried.y[:, 1::3]
        squares, off_y = line[:26, 0, None] - some_x.ravel(), line[:26, 1, None] - some_y.ravel()
        squares *= squares
        off_y *= off_y
        squares += off_y
        off_path = np.sqrt(squares.min(axis=0)).reshape(some_x.shape)
        way_x, way_y = beyond[0] - tried.x[:, -1], beyond[1] - tried.y[:, -1]
        misdirected = np.abs(np.remainder(np.arctan2(way_y, way_x) - tried.yaw[:, -1] + math.pi, math.tau) - math.pi)
        # A direction means little once its target is near.
        misdirected *= np.minimum(np.hypot(way_x, way_y) / AIM, 1.0)
        weights = self.weights
        course = (short + weights.off_path * (off_path.sum(axis=1) / off_path.shape[1])) / length
        return course + weights.heading * misdirected, weights.unsteadiness * np.abs(tried.w - now.twist.w)


@lru_cache(maxsize=8)
def _looked_at(aim: float) -> FloatArray:
    """Return where along the path (m) forecasts with a target at `aim` (m) are compared with it."""
    return np.append(np.linspace(0.0, 1.25 * aim, 26), [aim, aim + AIM])
