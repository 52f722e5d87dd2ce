"""Single motions: turning in place, driving straight, standing, and driving by hand. Nav2 calls them behaviours."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from regraft.bus_schema.messages.nav2.motions import MotionError
from regraft.planar import Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.local_controller import SLOWEST_TURN, Manoeuvres, Situation
from regraft.services.navigator.servers.motion import Ended, Patience

SLOWEST: Final = 0.02
"""m/s: the slowest approach to the end of a straight way."""
TURNED: Final = 0.01
"""rad: a turn that is this near to its end is done."""
SHARES: Final = (1.0, 0.5, 0.25)
"""Shares of a twist given by hand that are tried where the whole of it leads into something."""


@dataclass(slots=True)
class Behaviour:
    """The base: a time limit, error codes, and the robot's motion since the first step."""

    manoeuvres: Manoeuvres
    codes: Mapping[MotionError, int]
    allowance: float
    checks: bool
    sightless: Patience
    ended: Ended | None = None
    travelled: float = 0.0
    started: float | None = field(init=False, default=None)
    elapsed: float = field(init=False, default=0.0)
    _has_begun: bool = field(init=False, default=False)

    @property
    def unknown(self) -> int:
        """The code of an error that has none of its own."""
        return self.codes[MotionError.UNKNOWN]

    def end(self, ended: Ended) -> None:
        """End it, unless it has ended."""
        self.ended = self.ended or ended

    def fail(self, error: MotionError, why: str) -> None:
        """End it with an error."""
        self.end(Ended(self.codes[error], why))

    def blind(self, time: float, why: str) -> None:
        """Stand without seeing anything; give up after a while."""
        if self._in_time(time) and self.sightless.is_over(time):
            self.fail(MotionError.NO_POSE, f"{why}, for {self.sightless.longest:g} s")

    def step(self, time: float, now: Situation) -> Twist2D:
        """Return the twist to command."""
        self.sightless.reset()
        if not self._has_begun:
            self._has_begun = True
            self.begin(now)
        if not self._in_time(time):
            return Twist2D()
        return self.move(now)

    def begin(self, now: Situation) -> None:
        """Note where it begins."""

    def move(self, now: Situation) -> Twist2D:
        """Return the twist to command."""
        raise NotImplementedError(f"{type(self).__name__} does not implement move()")

    def _in_time(self, time: float) -> bool:
        self.started = time if self.started is None else self.started
        self.elapsed = time - self.started
        if self.elapsed > self.allowance > 0.0:
            self.out_of_time()
        return self.ended is None

    def out_of_time(self) -> None:
        """End it because its time is over."""
        self.fail(MotionError.TIMEOUT, f"it was not done within {self.allowance:g} s")


@dataclass(slots=True)
class Turn(Behaviour):
    """Turns in place by ``angle`` (rad), to the left where that is positive."""

    angle: float = 0.0
    _last: float = field(init=False, default=0.0)
    _turned: float = field(init=False, default=0.0)

    def begin(self, now: Situation) -> None:
        """Note the heading."""
        self._last = now.pose.yaw

    def move(self, now: Situation) -> Twist2D:
        """Return the turn, slower towards its end."""
        self._turned += wrap_angle(now.pose.yaw - self._last)
        self._last = now.pose.yaw
        self.travelled = abs(self._turned)
        left = abs(self.angle) - self.travelled
        if left <= TURNED:
            self.end(Ended())
            return Twist2D()
        limits = now.limits
        rate = min(max(math.sqrt(2.0 * limits.turn_acceleration * left), SLOWEST_TURN), limits.max_turn_rate)
        soon = math.copysign(min(left, rate * self.manoeuvres.foresight(now)), self.angle)
        if self.checks and not self.manoeuvres.can_turn(now, soon):
            self.fail(MotionError.COLLISION_AHEAD, f"{left:.2f} rad before the end of the turn something is in the way")
            return Twist2D()
        return now.reachable(Twist2D(0.0, math.copysign(rate, self.angle)))


@dataclass(slots=True)
class Straight(Behaviour):
    """Drives straight by ``distance`` (m) at ``speed`` (m/s); both are negative for backwards."""

    distance: float = 0.0
    speed: float = 0.0
    _from: Pose2D = field(init=False, default_factory=Pose2D)

    def begin(self, now: Situation) -> None:
        """Note the place."""
        self._from = now.pose

    def move(self, now: Situation) -> Twist2D:
        """Return the speed, slower towards the end."""
        self.travelled = self._from.distance(now.pose)
        left = abs(self.distance) - self.travelled
        if left <= 0.0:
            self.end(Ended())
            return Twist2D()
        slow_enough = max(math.sqrt(2.0 * now.limits.acceleration * left), SLOWEST)
        target = Twist2D(math.copysign(min(abs(self.speed), slow_enough), self.speed), 0.0)
        reach = abs(now.limits.saturate(target).v) * self.manoeuvres.foresight(now)
        ahead = Twist2D(target.v * min(left / reach, 1.0) if reach > 0.0 else 0.0, 0.0)
        if self.checks and not self.manoeuvres.can_drive(now, ahead):
            self.fail(MotionError.COLLISION_AHEAD, f"{left:.2f} m before the end of the way something is in the way")
            return Twist2D()
        return now.reachable(now.limits.saturate(target))


@dataclass(slots=True)
class Stand(Behaviour):
    """Stands until its time is over."""

    def out_of_time(self) -> None:
        """End it well: that is what was asked for."""
        self.end(Ended())

    def move(self, now: Situation) -> Twist2D:
        """Return the twist that brakes."""
        return self.manoeuvres.stop(now).twist

    def blind(self, time: float, why: str) -> None:
        """Stand on: that takes no sense."""
        self._in_time(time)


@dataclass(slots=True)
class ByHand(Behaviour):
    """Drives as somebody states, as far as nothing is in the way; fails when its time is over, as in Nav2."""

    given: Callable[[], Twist2D] = field(default=Twist2D)
    """Returns the twist to drive."""

    def move(self, now: Situation) -> Twist2D:
        """Return the given twist, or the greatest share of it that leads into nothing."""
        given = self.given()
        for share in SHARES:
            target = now.limits.saturate(Twist2D(share * given.v, share * given.w))
            if self.manoeuvres.can_drive(now, target):
                return now.reachable(target)
        return self.manoeuvres.stop(now).twist
