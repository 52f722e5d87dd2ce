"""Local control: follows a path by choosing among forecasts, as the dynamic window approach does.

D. Fox, W. Burgard, S. Thrun: The dynamic window approach to collision avoidance. IEEE Robotics &
Automation Magazine 4(1), 1997. Unlike there, all admissible twists are tried, not only those that the next
period can reach: the forecasts accelerate towards them.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from services.navigator.geometry import FloatArray, Pose, Twist, to_base_frame, wrap_angle
from services.navigator.robot import Footprint, Limits
from services.navigator.rollouts import Rollouts, candidates, forecast, in_place, nearby

# Turn in place first when the way lies further aside than TURN_FROM, until it does by less than TURN_UNTIL.
TURN_FROM = 0.785
TURN_UNTIL = 0.25
AIM = 0.35  # m along the path: where to look when deciding on that
SHORTEST = 0.005  # m: the length of a forecast for a robot that is hardly allowed to drive
# A slow robot, whose forecasts are short, still looks this far ahead (m), or it would put being on the path
# before getting on.
NEAREST_TARGET = 0.2
SIDEWAYS = 0.4
ROOMY = 0.10  # m beyond the margin to drive at full speed
TURN_GAIN = 2.0  # 1/s
SLOWEST_TURN = 0.12  # rad/s: slower turns may never overcome friction
# The next forecast step is checked even for a turn that is nearly done.
TURN_CHECK_STEP = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """What a decision depends on besides the task: where the robot is, what is around, what it can do.

    `pose` is in a fixed frame, `obstacles` (N, 2) are points (m) in the same frame, `twist` is the robot's
    motion now, `period` (s) the time until the next decision.
    """

    pose: Pose
    twist: Twist
    obstacles: FloatArray
    limits: Limits
    period: float = 0.05

    def reachable(self, target: Twist) -> Twist:
        """Return the twist nearest to `target` that the robot can have at the next decision."""
        return self.limits.approach(self.twist, target, self.period)


@dataclass(frozen=True, slots=True)
class Decision:
    """What to command next.

    `turning`: a turn in place is under way (give it back at the next call). `blocked`: obstacles forbid
    every way on, so the twist brings the robot to a stand.
    """

    twist: Twist
    turning: bool = False
    blocked: bool = False


@dataclass(frozen=True, slots=True)
class Weights:
    """What the choice among forecasts weighs, each against ending a full forecast's length off target."""

    off_path: float = 0.6  # for a full length, mean over the forecast
    heading: float = 0.12  # per rad, at the end
    closeness: float = 0.15  # for touching; fades out at `close`
    unsteadiness: float = 0.025  # per rad/s of change
    close: float = 0.20  # m


@dataclass(frozen=True, slots=True)
class LocalController:
    """Chooses twists at about 20 Hz; keeps no state.

    Forecasts reach `horizon` seconds ahead in steps of `step`. The outline keeps `margin` (m) to every
    echo; where the robot already is nearer, it at least gets no nearer.
    """

    footprint: Footprint = field(default=Footprint())
    horizon: float = 1.5
    step: float = 0.15
    margin: float = 0.03
    weights: Weights = field(default=Weights())

    def follow(self, now: Situation, path: FloatArray, turning: bool = False) -> Decision:
        """Choose the twist that brings the robot along `path` (N, 2)."""
        length = self.horizon * now.limits.max_velocity + 2 * AIM
        ahead = to_base_frame(_stretch(path, now.pose, length), now.pose)
        aim = _points_along(ahead, np.array([AIM]))[0]
        bearing = math.atan2(aim[1], aim[0])
        if abs(bearing) > (TURN_UNTIL if turning else TURN_FROM):
            turn = self._turn_by(now, bearing)
            if not turn.blocked:
                return turn
        return self._best(now, ahead)

    def turn(self, now: Situation, yaw: float) -> Decision:
        """Choose the twist that turns the robot in place towards `yaw` (rad), the way round that is free."""
        return self._turn_by(now, wrap_angle(yaw - now.pose.yaw))

    def back_up(self, now: Situation, speed: float) -> Decision:
        """Choose the twist that drives straight back at `speed` (m/s) while the rear is free."""
        target = now.limits.saturate(Twist(-speed, 0.0))
        targets = (np.array([target.v]), np.zeros(1))
        back = forecast(targets, now.twist, now.limits, self.horizon, self.step)
        if not self._admissible(back, self._near(now, self.horizon * speed))[0]:
            return replace(self.stop(now), blocked=True)
        return Decision(now.reachable(target))

    def can_turn(self, now: Situation, angle: float) -> bool:
        """Tell whether the robot can turn in place by `angle` (rad) without coming too close to anything."""
        points = self._near(now, 0.0)
        if not len(points):
            return True
        count = max(2, math.ceil(abs(angle) / TURN_CHECK_STEP) + 1)
        return bool(self._admissible(in_place(np.linspace(0.0, angle, count)[1:]), points)[0])

    def can_back_up(self, now: Situation, distance: float) -> bool:
        """Tell whether the robot can drive straight back by `distance` (m)."""
        x = -np.linspace(0.0, distance, max(2, math.ceil(distance / 0.05) + 1))[None, 1:]
        back = Rollouts(np.zeros(1), np.zeros(1), x, np.zeros_like(x), np.zeros_like(x))
        return bool(self._admissible(back, self._near(now, distance))[0])

    def stop(self, now: Situation) -> Decision:
        """Brake as hard as the limits allow."""
        return Decision(now.reachable(Twist()))

    def _turn_by(self, now: Situation, angle: float) -> Decision:
        # Near half a turn both ways are equally long: keep the way that is already taken.
        if abs(angle) > 2.5 and abs(now.twist.w) > 0.1 and now.twist.w * angle < 0:
            angle -= math.copysign(math.tau, angle)
        for way in (angle, angle - math.copysign(math.tau, angle)):
            if self.can_turn(now, way):
                rate = min(max(TURN_GAIN * abs(way), SLOWEST_TURN), now.limits.max_turn_rate)
                return Decision(now.reachable(Twist(0.0, math.copysign(rate, way))), turning=True)
        return replace(self.stop(now), blocked=True)

    def _best(self, now: Situation, ahead: FloatArray) -> Decision:
        greatest = now.limits.max_velocity
        tried = forecast(candidates(now.limits), now.twist, now.limits, self.horizon, self.step)
        points = self._near(now, self.horizon * greatest + self.weights.close)
        clearances = tried.clearances(self.footprint, points)
        nearest = clearances.min(axis=1)
        # Slow down where it is tight, not only where a collision is near; but not long before, or the robot
        # would rather creep straight on than steer around something.
        soon = clearances[:, : max(1, round(self.horizon / self.step / 3))].min(axis=1)
        room = np.clip((soon - self.margin) / ROOMY, 0.25, 1.0)
        admissible = self._clear_enough(nearest, points) & (tried.v <= room * greatest + 1e-9)
        costs = np.where(admissible, self._costs(now, tried, nearest, ahead), np.inf)
        if not admissible[tried.v > 0.0].any() and not (greatest == 0.0 and admissible.any()):
            return replace(self.stop(now), blocked=True)
        best = int(np.argmin(costs))
        return Decision(now.reachable(Twist(float(tried.v[best]), float(tried.w[best]))))

    def _costs(self, now: Situation, tried: Rollouts, nearest: FloatArray, ahead: FloatArray) -> FloatArray:
        length = max(self.horizon * now.limits.max_velocity, SHORTEST)
        aim = max(length, NEAREST_TARGET)
        distances = np.append(np.linspace(0.0, 1.25 * aim, 26), [aim, aim + AIM])
        line = _points_along(ahead, distances)
        target, beyond = line[-2], line[-1]
        # Being beside the target matters less than being short of it, or the robot would rather stop before
        # an obstacle than steer around it.
        direction = target / max(float(np.hypot(target[0], target[1])), 1e-9)
        miss_x, miss_y = tried.x[:, -1] - target[0], tried.y[:, -1] - target[1]
        along = miss_x * direction[0] + miss_y * direction[1]
        beside = SIDEWAYS * (miss_y * direction[0] - miss_x * direction[1])
        short = np.hypot(along, beside)
        some = slice(1, None, 3)
        off_x, off_y = tried.x[:, some, None] - line[:26, 0], tried.y[:, some, None] - line[:26, 1]
        off_path = np.sqrt((off_x * off_x + off_y * off_y).min(axis=-1))
        way = beyond - np.stack([tried.x[:, -1], tried.y[:, -1]], axis=1)
        misdirected = np.abs(
            np.remainder(np.arctan2(way[:, 1], way[:, 0]) - tried.yaw[:, -1] + math.pi, math.tau) - math.pi
        )
        # A direction means little once its target is near.
        misdirected *= np.clip(np.hypot(way[:, 0], way[:, 1]) / AIM, 0.0, 1.0)
        weights = self.weights
        costs: FloatArray = (
            (short + weights.off_path * off_path.mean(axis=1)) / length
            + weights.heading * misdirected
            + weights.closeness * np.clip(1.0 - nearest / weights.close, 0.0, None)
            + weights.unsteadiness * np.abs(tried.w - now.twist.w)
        )
        return costs

    def _near(self, now: Situation, travel: float) -> FloatArray:
        """Return, in the base frame, the obstacles that matter for a way of `travel` (m)."""
        reach = self.footprint.circumradius + self.margin + travel
        return nearby(to_base_frame(now.obstacles, now.pose), reach)

    def _admissible(self, tried: Rollouts, points: FloatArray) -> NDArray[np.bool_]:
        return self._clear_enough(tried.clearances(self.footprint, points).min(axis=1), points)

    def _clear_enough(self, nearest: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
        now = float(in_place(np.zeros(1)).clearances(self.footprint, points)[0, 0])
        clear: NDArray[np.bool_] = nearest >= min(self.margin, now)
        return clear


def _stretch(path: FloatArray, pose: Pose, length: float) -> FloatArray:
    """Return the part of a path that begins beside the robot and is at least `length` (m) long, if it is."""
    position = np.array([pose.x, pose.y])
    if len(path) < 2:
        return path
    starts, ways = path[:-1], np.diff(path, axis=0)
    squares = np.maximum((ways * ways).sum(axis=1), 1e-12)
    fractions = np.clip(((position - starts) * ways).sum(axis=1) / squares, 0.0, 1.0)
    feet = starts + fractions[:, None] * ways
    offsets = feet - position
    nearest = int(np.argmin((offsets * offsets).sum(axis=1)))
    rest = np.concatenate([feet[nearest : nearest + 1], path[nearest + 1 :]])
    along = np.cumsum(np.hypot(*np.diff(rest, axis=0).T))
    return rest[: int(np.searchsorted(along, length)) + 2]


def _points_along(points: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the points (K, 2) at `distances` (K,) in m along a polyline (N, 2), its end beyond the end."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return np.column_stack([np.interp(distances, along, points[:, 0]), np.interp(distances, along, points[:, 1])])
