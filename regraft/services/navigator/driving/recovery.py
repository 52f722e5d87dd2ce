"""Finding out that the robot is stuck, and getting it going again."""

import math
from typing import Any, Literal

from regraft.planar import Pose2D, wrap_angle
from regraft.services.navigator.driving.local_controller import Decision, Manoeuvres, Situation

Action = Literal["none", "turn", "back_up", "wait"]

TURN_ANGLE = 0.8  # rad
BACK_UP_DISTANCE = 0.15  # m
BACK_UP_SPEED = 0.05  # m/s, as Nav2's
LONGEST = {"turn": 5.0, "back_up": 6.0, "wait": 2.0}  # s
MAX_ATTEMPTS = 6  # Nav2's number of retries
# Once the robot has come this far from its last trouble, the next trouble is a new one.
OUT_OF_TROUBLE = 0.5  # m


class ProgressMonitor:
    """Notices that a robot which tries to move neither moves nor turns for `window` seconds."""

    def __init__(self, window: float = 5.0, distance: float = 0.05, angle: float = 0.1) -> None:
        """Moving less than `distance` (m) and turning less than `angle` (rad) in `window` (s) is stuck."""
        self._window, self._distance, self._angle = window, distance, angle
        self._since: float | None = None
        self._from = Pose2D(0.0, 0.0, 0.0)

    def reset(self) -> None:
        """Start watching again: the robot did not try."""
        self._since = None

    def stuck(self, time: float, pose: Pose2D, max_velocity: float) -> bool:
        """Return whether the robot, at `pose` and `time` (s), is stuck.

        A robot that is only allowed to creep needs to cover no more than a tenth of what it could.
        """
        distance = min(self._distance, 0.1 * max_velocity * self._window)
        moved = math.hypot(pose.x - self._from.x, pose.y - self._from.y) >= distance
        turned = abs(wrap_angle(pose.yaw - self._from.yaw)) >= self._angle
        if self._since is None or time < self._since or moved or turned:
            self._since, self._from = time, pose
        return time - self._since >= self._window

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return {"since": self._since, "from": [self._from.x, self._from.y, self._from.yaw]}

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self._since, self._from = state["since"], Pose2D(*state["from"])


class Recovery:
    """One manoeuvre per attempt, in turns: turn in place, back up, or wait where neither is free.

    After each the caller replans. `attempts` counts since the robot last got away from its trouble.
    """

    def __init__(self) -> None:
        self.attempts = 0
        self.total = 0
        self._action: Action = "none"
        self._started = 0.0
        self._from = Pose2D(0.0, 0.0, 0.0)
        self._yaw = 0.0

    @property
    def active(self) -> bool:
        """Whether a manoeuvre is under way."""
        return self._action != "none"

    @property
    def exhausted(self) -> bool:
        """Whether another attempt would be one too many."""
        return self.attempts >= MAX_ATTEMPTS

    def begin(self, time: float, now: Situation, manoeuvres: Manoeuvres) -> None:
        """Choose the next manoeuvre for a robot that is stuck."""
        self.attempts += 1
        self.total += 1
        self._started, self._from = time, now.pose
        turns = [angle for angle in (TURN_ANGLE, -TURN_ANGLE) if manoeuvres.can_turn(now, angle)]
        can_back_up = manoeuvres.can_back_up(now, BACK_UP_DISTANCE)
        if turns and (self.attempts % 2 == 1 or not can_back_up):
            self._action, self._yaw = "turn", wrap_angle(now.pose.yaw + turns[0])
        else:
            self._action = "back_up" if can_back_up else "wait"

    def step(self, time: float, now: Situation, manoeuvres: Manoeuvres) -> Decision | None:
        """Return what the manoeuvre commands next, or None when it is over."""
        decision = manoeuvres.stop(now)
        over = not self.active or time - self._started > LONGEST[self._action]
        if self._action == "turn":
            decision = manoeuvres.turn(now, self._yaw)
            over |= decision.blocked or abs(wrap_angle(self._yaw - now.pose.yaw)) < 0.1
        elif self._action == "back_up":
            decision = manoeuvres.back_up(now, BACK_UP_SPEED)
            driven = math.hypot(now.pose.x - self._from.x, now.pose.y - self._from.y)
            over |= decision.blocked or driven >= BACK_UP_DISTANCE
        if not over:
            return decision
        self._action, self._from = "none", now.pose
        return None

    def watch(self, pose: Pose2D) -> None:
        """Forget past attempts once the robot is well away from where it was stuck."""
        away = math.hypot(pose.x - self._from.x, pose.y - self._from.y)
        if not self.active and away > OUT_OF_TROUBLE:
            self.attempts = 0

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return {
            "attempts": self.attempts,
            "total": self.total,
            "action": self._action,
            "started": self._started,
            "from": [self._from.x, self._from.y, self._from.yaw],
            "yaw": self._yaw,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.attempts, self.total, self._action = state["attempts"], state["total"], state["action"]
        self._started, self._from, self._yaw = state["started"], Pose2D(*state["from"]), state["yaw"]
