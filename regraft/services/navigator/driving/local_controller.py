"""The interface of a local controller, and the manoeuvres that all of them share."""

import math
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from regraft.planar import FloatArray, Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.robot import Footprint, Limits
from regraft.services.navigator.driving.rollouts import Rollouts, forecast, in_place, nearby
from regraft.services.navigator.normalized_qualities import REACTION, stopping_distance

# Turn in place first when the way lies further aside than TURN_FROM, until it does by less than TURN_UNTIL.
TURN_FROM = 0.785
TURN_UNTIL = 0.25
TURN_GAIN = 2.0  # 1/s
SLOWEST_TURN = 0.12  # rad/s: slower turns may never overcome friction
# The next forecast step is checked even for a turn that is nearly done.
TURN_CHECK_STEP = 0.1
LONGEST = 12.0  # s: forecasts reach no further, however weak the brakes are


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """The inputs of a decision besides the task: where the robot is, what is around, what it can do.

    `pose` is in a fixed frame, and `obstacles` (N, 2) are points (m) in it. `twist` is the robot's motion now, `period`
    (s) the time until the next decision.
    """

    pose: Pose2D
    twist: Twist2D
    obstacles: FloatArray
    limits: Limits
    period: float = 0.05

    def reachable(self, target: Twist2D) -> Twist2D:
        """Return the twist nearest to `target` that the robot can have at the next decision."""
        return self.limits.approach(self.twist, target, self.period)


@dataclass(frozen=True, slots=True)
class Decision:
    """The next command.

    `turning`: a turn in place is under way (give it back at the next call). `blocked`: obstacles forbid
    every way ahead, so the twist stops the robot.
    """

    twist: Twist2D
    turning: bool = False
    blocked: bool = False


class Controller(Protocol):
    """Chooses twists at about 20 Hz, keeps no state, and keeps the outline off all given obstacles."""

    @property
    def manoeuvres(self) -> "Manoeuvres":
        """The manoeuvre besides following: turning in place, backing up, stopping."""
        ...

    def follow(self, now: Situation, path: FloatArray, turning: bool = False) -> Decision:
        """Choose the twist that brings the robot along `path` (N, 2), in the frame of `now`."""
        ...


@dataclass(frozen=True, slots=True)
class Manoeuvres:
    """Turning in place, backing up and standing, as far as there is room.

    Forecasts reach `horizon` seconds ahead in steps of `step`, and further for a robot that takes longer to stop. The
    outline keeps `margin` (m) to every obstacle; where the robot already is nearer, it at least gets no nearer.
    """

    footprint: Footprint = field(default=Footprint())
    horizon: float = 1.5
    step: float = 0.15
    margin: float = 0.03

    def foresight(self, now: Situation) -> float:
        """Return how far (s) forecasts reach: at full speed the robot can stop before all that they show."""
        limits = now.limits
        fastest, quickest = max(limits.max_velocity, abs(now.twist.v)), max(limits.max_turn_rate, abs(now.twist.w))
        braking = max(fastest / limits.acceleration, quickest / limits.turn_acceleration)
        # A robot that brakes evenly gets half as far as one that does not.
        needed = braking / 2 + REACTION + now.period
        if needed <= self.horizon:
            return self.horizon
        return max(self.horizon, min(math.ceil(needed / self.step) * self.step, LONGEST))

    def forecast(self, now: Situation, targets: tuple[FloatArray, FloatArray]) -> Rollouts:
        """Return where the robot gets by each of the target twists (v, w), each (N,)."""
        return forecast(targets, now.twist, now.limits, self.foresight(now), self.step)

    def turn(self, now: Situation, yaw: float) -> Decision:
        """Choose the twist that turns the robot in place towards `yaw` (rad), the way round that is free."""
        return self.turn_by(now, wrap_angle(yaw - now.pose.yaw))

    def turn_by(self, now: Situation, angle: float) -> Decision:
        """Choose the twist that turns the robot in place by `angle` (rad), or to there the other way round."""
        # Near half a turn both ways are equally long: keep the way that is already taken.
        if abs(angle) > 2.5 and abs(now.twist.w) > 0.1 and now.twist.w * angle < 0:
            angle -= math.copysign(math.tau, angle)
        for way in (angle, angle - math.copysign(math.tau, angle)):
            if self.can_turn(now, way):
                rate = min(max(TURN_GAIN * abs(way), SLOWEST_TURN), now.limits.max_turn_rate)
                return Decision(now.reachable(Twist2D(0.0, math.copysign(rate, way))), turning=True)
        return self.halt(now)

    def back_up(self, now: Situation, speed: float) -> Decision:
        """Choose the twist that drives straight back at `speed` (m/s) while the rear is free."""
        target = now.limits.saturate(Twist2D(-speed, 0.0))
        targets = (np.array([target.v]), np.zeros(1))
        if not self._admissible(self.forecast(now, targets), self.near(now, self.foresight(now) * speed)):
            return self.halt(now)
        return Decision(now.reachable(target))

    def can_drive(self, now: Situation, target: Twist2D) -> bool:
        """Return whether the robot can drive at `target` as far as it foresees without coming too close to anything."""
        aimed = now.limits.saturate(target)
        targets = (np.array([aimed.v]), np.array([aimed.w]))
        return self._admissible(self.forecast(now, targets), self.near(now, self.foresight(now) * abs(aimed.v)))

    def can_turn(self, now: Situation, angle: float) -> bool:
        """Return whether the robot can turn in place by `angle` (rad) without coming too close to anything."""
        points = self.near(now, 0.0)
        if not len(points):
            return True
        count = max(2, math.ceil(abs(angle) / TURN_CHECK_STEP) + 1)
        return self._admissible(in_place(np.linspace(0.0, angle, count)[1:]), points)

    def can_back_up(self, now: Situation, distance: float) -> bool:
        """Return whether the robot can drive straight back by `distance` (m)."""
        x = -np.linspace(0.0, distance, max(2, math.ceil(distance / 0.05) + 1))[None, 1:]
        back = Rollouts(np.zeros(1), np.zeros(1), x, np.zeros_like(x), np.zeros_like(x))
        return self._admissible(back, self.near(now, distance))

    def stop(self, now: Situation) -> Decision:
        """Brake as hard as the limits allow."""
        return Decision(now.reachable(Twist2D()))

    def halt(self, now: Situation) -> Decision:
        """Brake because obstacles forbid every way on."""
        return replace(self.stop(now), blocked=True)

    def near(self, now: Situation, travel: float) -> FloatArray:
        """Return, in the base frame, the obstacles (N, 2) that matter for a way of `travel` (m)."""
        around = self.footprint.circumradius + self.margin
        fastest = max(now.limits.max_velocity, abs(now.twist.v))
        critical = around + stopping_distance(fastest, now.limits.acceleration)
        return nearby(now.pose.inward(now.obstacles), around + travel, critical)

    def gap(self, points: FloatArray) -> float:
        """Return how far (m) the outline is from the nearest of some points (N, 2) in the base frame."""
        if not len(points):
            return math.inf
        return float(self.footprint.nearest(points[:, 0] - self.footprint.centre, points[:, 1].copy()))

    def required_gap(self, points: FloatArray) -> float:
        """Return the gap (m) to keep to some points (N, 2): the margin, or what there is if that is less."""
        return min(self.margin, self.gap(points))

    def _admissible(self, tried: Rollouts, points: FloatArray) -> bool:
        return float(tried.clearances(self.footprint, points).min()) >= self.required_gap(points)
