"""Following a given path to its last pose, without planning another."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.nav2.paths import FollowError, TrackingFeedback
from regraft.planar import FloatArray, Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.local_controller import Controller, Decision, Situation
from regraft.services.navigator.driving.recovery import ProgressMonitor
from regraft.services.navigator.polyline import lengths_along
from regraft.services.navigator.servers.motion import Ended, Patience
from regraft.services.navigator.servers.paths import MAP_FRAME, nearest_index

STANDING: Final = 0.02
"""m/s and rad/s: a robot that is slower stands."""


@dataclass(frozen=True, slots=True)
class GoalCheck:
    """When the end of a path is reached: ``distance`` (m), ``angle`` (rad), and perhaps standing there."""

    distance: float
    angle: float = math.inf
    standing: bool = False


@dataclass(slots=True)
class Following:
    """Drives along ``path`` (N, 3), at least one pose; deterministic.

    ``blocked`` and ``sightless`` are for how long obstacles may block it and a sense may be missing.
    """

    path: FloatArray
    controller: Controller
    check: GoalCheck
    progress: ProgressMonitor
    blocked: Patience
    sightless: Patience
    ended: Ended | None = None
    _turning: bool = False
    _arrived: bool = False
    _points: FloatArray = field(init=False)
    _along: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self._points = np.ascontiguousarray(self.path[:, :2])
        self._along = lengths_along(self._points)

    @property
    def goal(self) -> Pose2D:
        """The last pose of the path."""
        x, y, yaw = self.path[-1].tolist()
        return Pose2D(x, y, yaw)

    @property
    def unknown(self) -> int:
        """The code of an error that has none of its own."""
        return FollowError.UNKNOWN

    def end(self, ended: Ended) -> None:
        """End it, unless it has ended."""
        self.ended = self.ended or ended

    def blind(self, time: float, why: str) -> None:
        """Stand without seeing anything; give up after a while."""
        self.progress.reset()
        if self.sightless.is_over(time):
            self.end(Ended(FollowError.NO_POSE, f"{why}, for {self.sightless.longest:g} s"))

    def step(self, time: float, now: Situation) -> Twist2D:
        """Return the twist along the path, or at its end that to its heading."""
        self.sightless.reset()
        decision = self._decide(now)
        self._turning = decision.turning
        if self.ended is not None:
            return Twist2D()
        self._judge(time, now, decision)
        return decision.twist

    def _decide(self, now: Situation) -> Decision:
        manoeuvres = self.controller.manoeuvres
        goal = self.goal
        # Turning in place may shift the robot a little: that need not be driven back.
        slack = 2.0 if self._arrived else 1.0
        if now.pose.distance(goal) > slack * self.check.distance:
            self._arrived = False
            return self.controller.follow(now, self._points, self._turning)
        self._arrived = True
        if abs(wrap_angle(goal.yaw - now.pose.yaw)) > self.check.angle:
            return manoeuvres.turn(now, goal.yaw)
        stop = manoeuvres.stop(now)
        moves = max(abs(now.twist.v), abs(now.twist.w)) > STANDING
        if not (self.check.standing and moves):
            self.end(Ended())
        return stop

    def _judge(self, time: float, now: Situation, decision: Decision) -> None:
        """Give up where obstacles forbid every way on, or where the robot does not get on."""
        if now.limits.max_velocity == 0.0:
            self.progress.reset()
            self.blocked.reset()
            return
        if not decision.blocked:
            self.blocked.reset()
        elif self.blocked.is_over(time):
            what = "leave no room to turn to the path's last heading" if self._arrived else "block the path"
            self.end(Ended(FollowError.PATIENCE_EXCEEDED, f"obstacles {what}, for {self.blocked.longest:g} s"))
        if self.progress.stuck(time, now.pose, now.limits.max_velocity):
            self.end(Ended(FollowError.FAILED_TO_MAKE_PROGRESS, f"no progress at ({now.pose.x:.2f}, {now.pose.y:.2f})"))

    def tracking(self, pose: Pose2D, speed: float) -> TrackingFeedback:
        """Return how well a robot at ``pose``, at ``speed`` (m/s), follows."""
        index = nearest_index(self._points, pose.position)
        near = Pose2D(*self.path[index].tolist())
        if len(self.path) > 1:
            here = min(index, len(self.path) - 2)
            way = self._points[here + 1] - self._points[here]
            near = Pose2D(near.x, near.y, math.atan2(way[1], way[0]))
        offset = near.to(pose)
        return TrackingFeedback(
            offset.y,
            -offset.yaw,
            index,
            FramedPose(MAP_FRAME, Pose.planar(pose.x, pose.y, pose.yaw)),
            pose.distance(self.goal),
            speed,
            float(self._along[-1] - self._along[index]),
        )
