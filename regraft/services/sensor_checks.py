"""Checks of a sensor by its messages alone."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.sensors import LaserScan

SILENT, FROZEN, BLACK, BLANK, BLIND, DROPOUTS, JUMPY = (
    "silent",
    "frozen",
    "black",
    "blank",
    "blind",
    "dropouts",
    "jumpy",
)
PIXELS_LOOKED_AT = 400
MIN_MOTION = 0.02
"""m/s and rad/s: slower is standing."""
_WHATEVER_COMES = object()


@dataclass(frozen=True, slots=True)
class Finding:
    """A sensor's fault: in a word, in a sentence, and how bad it is."""

    fault: str
    text: str
    level: Level = Level.ERROR


def picture_fingerprint(pixels: npt.NDArray[np.uint8]) -> bytes:
    """Return a few hundred values of a picture (height, width, 3), spread over it."""
    height, width, _ = pixels.shape
    step = max(1, math.isqrt(height * width // PIXELS_LOOKED_AT))
    top, left = min(step, height) // 2, min(step, width) // 2
    return pixels[top::step, left::step].tobytes()


def judge_picture(fingerprint: bytes) -> Finding | None:
    """Report whether a picture shows nothing at all: even in the dark a working camera has noise."""
    if not fingerprint:
        return Finding(BLANK, "the pictures have no pixels")
    if fingerprint.count(fingerprint[:1]) < len(fingerprint):
        return None
    if fingerprint[0] == 0:
        return Finding(BLACK, "the pictures are black, without even noise")
    return Finding(BLANK, f"the pictures are one even {fingerprint[0]}, without even noise")


def judge_depths(depths: npt.NDArray[np.float32], least_valid: float) -> Finding | None:
    """Report whether too few of the depths are there: what is too near to be measured (-inf) counts as found."""
    found = float(np.mean(~np.isposinf(depths))) if depths.size else 0.0
    return Finding(BLIND, f"only {found:.0%} of the depths show anything") if found < least_valid else None


def scan_fingerprint(ranges: npt.NDArray[np.float32]) -> bytes:
    """Return a digest of a scan's ranges, or of depths."""
    return hashlib.blake2b(ranges.tobytes(), digest_size=16).digest()


def looks_all_around(scan: LaserScan) -> bool:
    """Return whether the beams of a scan look into every direction, so that the last is next to the first."""
    increment = abs(scan.angle_increment)
    return len(scan.ranges) * increment >= math.tau - increment / 2


def judge_scan(
    ranges: npt.NDArray[np.float32], least_valid: float, most_gaps: float, *, all_around: bool = True
) -> Finding | None:
    """Report whether too few rays hit anything, or too many single ones are missing.

    ``least_valid`` is a share of the rays; ``most_gaps`` the share of neighbours of which one hit something
    and the other nothing: the edges of what is far away are few. The last ray of a scan ``all_around`` is next to the
    first.
    """
    hit = np.isfinite(ranges)
    valid = float(hit.mean()) if len(hit) else 0.0
    if valid < least_valid:
        return Finding(BLIND, f"only {valid:.0%} of the rays hit anything")
    changes = hit != np.roll(hit, 1)
    gaps = float(np.mean(changes if all_around else changes[1:])) if len(hit) > 1 else 0.0
    if gaps > most_gaps:
        return Finding(DROPOUTS, f"rays are missing among those that hit: gaps at {gaps:.0%} of them", Level.WARNING)
    return None


class Sameness:
    """For how long the same has come again and again."""

    def __init__(self) -> None:
        self._last: object = None
        self._since = 0.0

    def reset(self) -> None:
        """Forget all messages: the next one is the first."""
        self._last = None

    def presume(self) -> None:
        """Take the next message for what has come for long: an earlier run has found that, and kept no message."""
        self._last, self._since = _WHATEVER_COMES, -math.inf

    def seconds(self, content: object, stamp: float) -> float:
        """Take in what came at a time (s), and return for how long it has been the same."""
        if self._last is _WHATEVER_COMES:
            self._last = content
        elif content != self._last:
            self._last, self._since = content, stamp
        return stamp - self._since


class Jumps:
    """Notices a pose that moves farther than the robot can."""

    def __init__(self) -> None:
        self._last: tuple[float, Pose] | None = None

    def jump(self, stamp: float, pose: Pose, limits: tuple[float, float], tolerance: float) -> float:
        """Return how far (m) a pose at a time (s) has jumped; 0 within the tolerance (m, rad of yaw).

        ``limits`` are how fast the robot can be (m/s, rad/s).
        """
        last, self._last = self._last, (stamp, pose)
        if last is None or stamp <= last[0]:
            return 0.0
        seconds = stamp - last[0]
        moved = math.hypot(pose.x - last[1].x, pose.y - last[1].y)
        turned = abs(math.remainder(pose.yaw - last[1].yaw, math.tau))
        jumped = moved > limits[0] * seconds + tolerance or turned > limits[1] * seconds + tolerance
        return max(moved, turned) if jumped else 0.0


def is_moving(twist: Twist) -> bool:
    """Return whether a twist is more than standing."""
    return abs(twist.forward) > MIN_MOTION or abs(twist.turn) > MIN_MOTION
