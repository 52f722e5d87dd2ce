"""FROG's utilities, each defined once: of a second of driving, and of looking.

    U_vis of a second = I{MoveSafely} * (v / v_max) / W          U_det of a run = hits / pictures * share within budget

``v`` is the measured speed (m/s) at an instant, and ``v_max`` is 0.26 m/s. MoveSafely is the requirement's: at that
instant nothing is nearer than 0.458 m, or ``v`` is below 0.18 m/s. ``W`` is the power (W) of the drive at ``v``. The
model of that power also drains the battery. A run's U_vis is the mean over its seconds of driving.

The requirements (`regraft.stacks.frog.quality`) and the analysis (``studies/rounds_measures.py``) call these functions.
The formulas of missions and decision files repeat them, and ``tests/missions/test_utility.py`` compares both. The
navigator's estimates are made of the same `is_safe` and `motion_power`.
"""

from __future__ import annotations

from typing import Final

from regraft.services.navigator.qualities import NEAR, SLOW, is_near, is_safe
from regraft.services.power_model import PICTURE_ENERGY, motion_power

__all__ = ["NEAR", "SLOW", "is_near"]

FASTEST: Final = 0.26
"""m/s: v_max."""
TASK_PICTURES: Final = 4 * 5 * 2 * 3
"""Pictures within the published budget: 4 places, 5 calls at each, and 2 x (2 + 1) more a call."""
BUDGET: Final = TASK_PICTURES * PICTURE_ENERGY
"""J that pictures of the robot's own camera may take."""
ROUNDING: Final = 1e-6
"""J by which the sum of 120 pictures' energies may come out above the product."""


def moves_safely(nearest: float, speed: float) -> bool:
    """Return whether MoveSafely is satisfied with the nearest echo at ``nearest`` (m), at a speed (m/s)."""
    return is_safe(nearest, speed)


def driving_utility(nearest: float, speed: float) -> float:
    """Return the utility (1/W) of driving at an instant: the nearest echo in m, the speed in m/s.

    >>> round(driving_utility(2.0, 0.26), 4), driving_utility(0.4, 0.26), round(driving_utility(0.4, 0.17), 4)
    (0.1509, 0.0, 0.1188)
    """
    return moves_safely(nearest, speed) * velocity_share(speed) / motion_power(speed)


def velocity_share(speed: float) -> float:
    """Return the speed (m/s) as a share of v_max, in [0, 1]."""
    return min(abs(speed) / FASTEST, 1.0)


def driving_reward(nearest: float, speed: float) -> float:
    """Return the utility scaled to at most 1, which it is at v_max: the bandits' reward."""
    return driving_utility(nearest, speed) * motion_power(FASTEST)


def within_budget(energy: float, budget: float = BUDGET) -> bool:
    """Return whether pictures that have taken so much (J) are within a budget (J)."""
    return energy <= budget + ROUNDING


def detecting_utility(hits_per_picture: float, share_within_budget: float) -> float:
    """Return the utility of looking: two shares, of pictures with a hit and of the time within the budget."""
    return hits_per_picture * share_within_budget
