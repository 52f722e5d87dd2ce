"""A mapper's qualities, estimated without running it (ReFrESH's ES).

The context may give ``scan_rate`` (Hz), ``travel_noise`` (m: standard deviation of a wheel's measured travel after 1 m)
and ``distance`` (m that is driven). The constants were fitted to simulated drives in FROG's room, see the evidence
tests of the mapper.
"""

from __future__ import annotations

import math

from regraft.bus_schema.annotations import PlainValue

SCAN_RATE, TRAVEL_NOISE, DISTANCE = 5.0, 0.01, 50.0
ODOMETRY_COST = 0.02
"""Share of a core that 20 odometries a second take in a process of their own, in real time."""
INSERTING, MATCHING = 0.0007, 0.002
"""s of a core per scan, its decoding included. A core is one on which a navigator takes what its class states."""
LEVER = 0.75
"""m by which an error of the heading by one radian displaces the robot, in a room of 5 m."""
SMEARED_BY = 0.14
"""m of error that leave a map 1/e of its quality."""
BEST = 0.98
FINE_ENOUGH, COARSENED_BY = 0.05, 4.0
"""m of a cell up to which a map loses nothing, and the share lost beyond for each metre."""


def of_matching(resolution: float, context: dict[str, PlainValue]) -> dict[str, float]:
    """Estimate a mapper that matches: its error does not grow with the way, only with the cells."""
    error = 0.003 + 0.03 * resolution
    return {
        "cpu": _cpu(INSERTING + MATCHING, context),
        "pose_error": error,
        "map_quality": _map_quality(error, resolution),
    }


def of_localizing(resolution: float, context: dict[str, PlainValue]) -> dict[str, float]:
    """Estimate a localizer that matches with a map whose surfaces are known to a cell only."""
    return {"cpu": _cpu(MATCHING, context), "pose_error": 0.003 + 0.3 * resolution}


def of_odometry(resolution: float, wheel_separation: float, context: dict[str, PlainValue]) -> dict[str, float]:
    """Estimate a mapper that trusts the odometry: the error of the heading grows with the root of the way."""
    noise = float(context.get("travel_noise", TRAVEL_NOISE))
    travel = noise * math.sqrt(float(context.get("distance", DISTANCE)))
    error = math.hypot(LEVER * math.sqrt(2.0) * travel / wheel_separation, travel) + 0.01
    return {"cpu": _cpu(INSERTING, context), "pose_error": error, "map_quality": _map_quality(error, resolution)}


def _cpu(per_scan: float, context: dict[str, PlainValue]) -> float:
    return ODOMETRY_COST + per_scan * float(context.get("scan_rate", SCAN_RATE))


def _map_quality(error: float, resolution: float) -> float:
    detail = max(0.0, 1.0 - COARSENED_BY * max(0.0, resolution - FINE_ENOUGH))
    return BEST * detail * math.exp(-max(0.0, error - 0.01) / SMEARED_BY)
