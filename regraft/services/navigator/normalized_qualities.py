"""Qualities of driving from 0 to 1: safety by the distance to obstacles, performance by the time, energy by the power.

They are those of skills of navigation (D. Bozhinoski and others: A Modeling Tool for Reconfigurable Skills in ROS,
section III), as formulas. The publication only names what each stands for.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

REACTION: Final = 0.25
"""s until a robot brakes for what it sees: one scan of five a second, and one tick of the controller."""
AMPLE: Final = 0.25
"""m beyond the stopping distance from which on more room makes a robot no safer."""
RECENT: Final = 10.0
"""s over which the performance of a drive under way is measured."""
PAUSE: Final = 1.0
"""s without any motion after which a drive is over."""


def stopping_distance(speed: float, deceleration: float, reaction: float = REACTION) -> float:
    """Return how far (m) a robot gets that brakes from a speed (m/s) at a deceleration (m/s², above 0)."""
    return abs(speed) * reaction + speed * speed / (2.0 * deceleration)


def safety(gap: float, speed: float, deceleration: float, ample: float = AMPLE) -> float:
    """Return how safe a speed (m/s) is with a gap (m) between the robot's rim and the next obstacle.

    That is the gap beyond the stopping distance as a share of ``ample`` (m). It is 0 where the robot could not stop
    before an obstacle ahead, and 1 from ``ample`` on.
    """
    return min(max((gap - stopping_distance(speed, deceleration)) / ample, 0.0), 1.0)


def performance(distance: float, seconds: float, fastest: float) -> float:
    """Return the best possible time over the time taken for a way: a distance (m) in ``seconds``, at most 1.

    The best possible time is that at the speed ``fastest`` (m/s) of the robot. A way that takes no time is as good as
    can be.
    """
    return min(distance / (fastest * seconds), 1.0) if seconds > 0.0 else 1.0


def energy(power: float, largest: float) -> float:
    """Return a robot's power (W) as a share of the largest power (W), at most 1."""
    return min(max(power / largest, 0.0), 1.0)


@dataclass(slots=True)
class RecentWay:
    """The way of the last `RECENT` seconds of a drive."""

    _steps: deque[tuple[float, float]] = field(default_factory=deque)

    def rest(self, stamp: float) -> None:
        """Take in that nothing moves the robot at a time (s)."""
        if self._steps and stamp - self._steps[-1][0] > PAUSE:
            self._steps.clear()

    def take(self, stamp: float, speed: float) -> None:
        """Take in the speed (m/s) along the way at a time (s); it holds until the next one."""
        if self._steps and stamp <= self._steps[-1][0]:
            return
        self._steps.append((stamp, abs(speed)))
        while self._steps[0][0] < stamp - RECENT:
            self._steps.popleft()

    def performance(self, fastest: float) -> float | None:
        """Return the performance of the way so far, for a robot as fast as ``fastest`` (m/s); None at its beginning."""
        if len(self._steps) < 2:
            return None
        times = [stamp for stamp, _ in self._steps]
        distance = sum(speed * (then - stamp) for (stamp, speed), then in zip(self._steps, times[1:], strict=False))
        return performance(distance, times[-1] - times[0], fastest)
