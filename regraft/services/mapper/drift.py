"""How far the odometry has come to differ from the scans."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from regraft.planar import Pose2D, wrap_angle

WINDOW = 30.0
"""s over which corrections are added up: errors of single matches cancel, those of the odometry do not."""
MUCH, MUCH_TURN = 0.10, 0.10
"""m and rad within the window that are called drift, until it is less than half of that."""


@dataclass(frozen=True, slots=True)
class Drift:
    """The odometry's drift within the window: ahead and to the left (m), and in heading (rad)."""

    forward: float
    left: float
    turn: float

    @property
    def distance(self) -> float:
        """The loss of position (m)."""
        return math.hypot(self.forward, self.left)


class DriftWatch:
    """Adds up the corrections of the last half minute."""

    def __init__(self) -> None:
        self._corrections: deque[tuple[float, Pose2D]] = deque()
        self._drifting = False

    def add(self, stamp: float, guess: Pose2D, fixed: Pose2D) -> None:
        """Take in that, at a time (s), the odometry led to ``guess`` and the scan to ``fixed``."""
        self._corrections.append((stamp, guess.to(fixed)))
        while self._corrections[0][0] < stamp - WINDOW:
            self._corrections.popleft()

    def forget(self) -> None:
        """Begin again: the robot was found elsewhere, which is no drift."""
        self._corrections.clear()

    @property
    def drift(self) -> Drift:
        """The sum of the corrections, each as seen from the robot."""
        steps = [step for _, step in self._corrections]
        turn = sum(wrap_angle(step.yaw) for step in steps)
        return Drift(sum(step.x for step in steps), sum(step.y for step in steps), turn)

    @property
    def mean_correction(self) -> float:
        """Mean length (m) of the corrections; 0 without any."""
        lengths = [math.hypot(step.x, step.y) for _, step in self._corrections]
        return sum(lengths) / len(lengths) if lengths else 0.0

    @property
    def drifting(self) -> bool:
        """Whether the odometry drifts: so from ``MUCH`` on, until it is less than half of that."""
        share = 0.5 if self._drifting else 1.0
        now = self.drift
        self._drifting = now.distance > share * MUCH or abs(now.turn) > share * MUCH_TURN
        return self._drifting
