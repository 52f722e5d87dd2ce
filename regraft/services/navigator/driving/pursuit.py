"""Local control: pure pursuit, regulated.

R. C. Coulter: Implementation of the pure pursuit path tracking algorithm, CMU-RI-TR-92-01, 1992. The robot drives
the arc to a point on the path some way ahead. Regulated as by S. Macenski, S. Singh, F. Martin, J. Gines:
Regulated pure pursuit for robot path tracking, Autonomous Robots 47, 2023: slower in tight curves, near obstacles
and towards the path's end, and never into what is in front.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from regraft.planar import FloatArray, Twist2D
from regraft.services.navigator.driving.local_controller import TURN_FROM, TURN_UNTIL, Decision, Manoeuvres, Situation
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.polyline import lengths_along, points_along, stretch_ahead

# Points of the path (m ahead) to steer to: the farthest whose arc is free, as near ones are hunted nervously.
LOOK_AHEAD = np.array([0.40, 0.30, 0.20, 0.12])
SHORTEST_STRETCH = 2 * float(LOOK_AHEAD[0])  # m: as much of the path is looked at, however slow the robot is
# Shares of the regulated speed that are tried, the slower ones reaching less far.
SHARES = np.array([1.0, 0.5, 0.25])
WIDE_CURVE = 0.5  # m: narrower ones are driven slower
ROOMY = 0.25  # m: nearer obstacles slow the robot
SLOWEST = 0.25  # of the speed allowed, however tight it is
BRAKING = 1.0  # 1/s: speed for each metre that is left to the end of the path
SOFT = 0.7  # of the acceleration that the drive has: so much is meant to brake at the end
CREEP = 0.03  # m/s, or the end would never be reached
MISALIGNED = 0.15  # rad: with no arc free, turning to the path by less would change nothing


@dataclass(frozen=True, slots=True)
class PursuitController:
    """Steers to a point ahead on the path. Much cheaper than trying rollouts; leaves the path for nothing."""

    manoeuvres: Manoeuvres = field(default=Manoeuvres())

    def follow(self, now: Situation, path: FloatArray, turning: bool = False) -> Decision:
        """Choose the twist that brings the robot along `path` (N, 2)."""
        stretch = max(SHORTEST_STRETCH, now.limits.max_velocity / BRAKING, _braking_distance(now.limits))
        ahead = now.pose.inward(stretch_ahead(path, now.pose, stretch))
        carrots = points_along(ahead, _look_ahead(stretch))
        bearing = math.atan2(carrots[1, 1], carrots[1, 0])
        if abs(bearing) > (TURN_UNTIL if turning else TURN_FROM):
            turn = self.manoeuvres.turn_by(now, bearing)
            if not turn.blocked:
                return turn
        decision = self._pursue(now, carrots, _slow_end(ahead, stretch, now.limits))
        nearest = math.atan2(carrots[-1, 1], carrots[-1, 0])
        if decision.blocked and abs(nearest) > MISALIGNED:
            return self.manoeuvres.turn_by(now, nearest)
        return decision

    def _pursue(self, now: Situation, carrots: FloatArray, slow_end: float) -> Decision:
        """Choose the fastest free arc to one of the points (N, 2), at `slow_end` (m/s) at most."""
        doing, greatest = self.manoeuvres, now.limits.max_velocity
        if greatest == 0.0:
            return doing.stop(now)
        curvatures = 2.0 * carrots[:, 1] / np.maximum((carrots * carrots).sum(axis=1), 1e-4)
        points = doing.near(now, doing.foresight(now) * greatest)
        tightness = min(max((doing.gap(points) - doing.margin) / ROOMY, SLOWEST), 1.0)
        in_curve = np.minimum(1.0 / np.maximum(np.abs(curvatures) * WIDE_CURVE, 1e-9), 1.0)
        speeds = np.minimum(greatest * tightness * np.maximum(in_curve, SLOWEST), slow_end)
        v = (SHARES[:, None] * speeds).ravel()
        w = v * np.tile(curvatures, len(SHARES))
        # The drive must be able to do it without changing the curvature.
        rims = v + np.abs(w) * now.limits.track / 2
        scale = np.minimum(1.0, now.limits.max_turn_rate / np.maximum(np.abs(w), 1e-9))
        scale = np.minimum(scale, now.limits.wheel_speed / np.maximum(rims, 1e-9))
        tried = doing.forecast(now, (v * scale, w * scale))
        free = tried.clearances(doing.footprint, points).min(axis=1) >= doing.required_gap(points)
        if not free.any():
            return doing.halt(now)
        best = int(free.argmax())
        target = now.limits.saturate(Twist2D(float(tried.v[best]), float(tried.w[best])))
        return Decision(now.reachable(target))


def _look_ahead(stretch: float) -> FloatArray:
    """Return how far along the path (m) the points are, the farthest first. The robot looks at a `stretch` (m).

    A fast robot passes the usual ones before it has turned to them, and swings about the path.
    """
    if stretch > SHORTEST_STRETCH:
        return np.concatenate([stretch / SHORTEST_STRETCH * LOOK_AHEAD, LOOK_AHEAD])
    return LOOK_AHEAD


def _braking_distance(limits: Limits) -> float:
    return limits.max_velocity**2 / (2.0 * SOFT * limits.acceleration)


def _slow_end(ahead: FloatArray, stretch: float, limits: Limits) -> float:
    """Return how fast (m/s) to drive towards the end of a path, whose next `stretch` (m) is `ahead` (N, 2; base frame).

    A longer path counts as one of that length. For slow robots the shortest stretch will do. They take the straight
    distance, since the way along the path would change every recorded run of theirs.
    """
    left = float(np.hypot(ahead[-1, 0], ahead[-1, 1]))
    if stretch > SHORTEST_STRETCH:
        left = max(left, float(lengths_along(ahead)[-1]))  # a robot that has passed the end is as far from it
        return max(min(BRAKING * left, math.sqrt(2.0 * SOFT * limits.acceleration * left)), CREEP)
    return max(BRAKING * left, CREEP)
