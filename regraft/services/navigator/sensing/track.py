"""Where the robot came along, in a frame that never jumps."""

import math
from typing import Any

from regraft.planar import Pose2D, Twist2D, wrap_angle

# A pose that is this far from where the motion leads has jumped: a little at once, more after a longer time.
JUMP_DISTANCE, JUMP_DISTANCE_RATE = 0.01, 0.05  # m, m/s
JUMP_ANGLE, JUMP_ANGLE_RATE = 0.01, 0.10  # rad, rad/s
SILENCE = 0.5  # s: after a longer one the motion in between is unknown


class Track:
    """Distinguishes jumps of a pose from motion.

    A pose in the map jumps when its source corrects itself, but the robot's surroundings did not move with it. So they
    are remembered in the frame of the track, in which the robot's pose never jumps. `correction`, the track's frame as
    seen from the map, takes the jumps.
    """

    def __init__(self) -> None:
        self.correction = Pose2D(0.0, 0.0, 0.0)
        self.jumps = 0
        """How often the pose has jumped."""
        self._stamp = -math.inf
        self._last = Pose2D(0.0, 0.0, 0.0)

    def follow(self, stamp: float, pose: Pose2D, twist: Twist2D) -> Pose2D:
        """Take in a pose in the map and the motion, both at `stamp` (s); return the pose in the track's frame."""
        since = stamp - self._stamp
        if 0.0 < since <= SILENCE:
            expected = _moved(self._last, twist, since)
            miss = math.hypot(pose.x - expected.x, pose.y - expected.y)
            turn = abs(wrap_angle(pose.yaw - expected.yaw))
            if miss > JUMP_DISTANCE + JUMP_DISTANCE_RATE * since or turn > JUMP_ANGLE + JUMP_ANGLE_RATE * since:
                jump = pose.compose(expected.inverse())
                self.correction = jump.compose(self.correction)
                self.jumps += 1
        if since != 0.0:
            self._stamp, self._last = stamp, pose
        return self.correction.inverse().compose(pose)

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        poses = [[pose.x, pose.y, pose.yaw] for pose in (self.correction, self._last)]
        return {"correction": poses[0], "last": poses[1], "stamp": self._stamp, "jumps": self.jumps}

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.correction, self._last = Pose2D(*state["correction"]), Pose2D(*state["last"])
        self._stamp, self.jumps = state["stamp"], state["jumps"]


def _moved(pose: Pose2D, twist: Twist2D, seconds: float) -> Pose2D:
    heading = pose.yaw + twist.w * seconds / 2
    way = twist.v * seconds
    return Pose2D(pose.x + way * math.cos(heading), pose.y + way * math.sin(heading), pose.yaw + twist.w * seconds)
