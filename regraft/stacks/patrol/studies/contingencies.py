"""The contingencies of a run, drawn from its seed: laser, camera, battery and crowd. All managers have the same."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Final

from regraft.evaluation.study import Changes

SECONDS: Final = 300.0
CHARGE: Final = 0.75
"""How full the battery is at the start of a run."""
LIDAR: Final = "lidar"
LASER_FAILURES: Final = ("silent", "frozen", "zeros")
CROWD: Final = "crowd"
DRAIN: Final = 250.0
"""W, of the fault that drains the battery."""


@dataclass(frozen=True, slots=True)
class Spell:
    """A contingency from ``begin`` to ``end`` (s)."""

    begin: float
    end: float

    def holds(self, time: float) -> bool:
        """Return whether it lasts at a time (s)."""
        return self.begin <= time < self.end


@dataclass(frozen=True, slots=True)
class Contingencies:
    """When what goes wrong in a run, and how the laser fails."""

    laser: Spell
    laser_failure: str
    camera: Spell
    drain: Spell
    crowd: Spell

    def changes(self) -> Changes:
        """Return them as what is different in the stack file."""
        return {
            "components": {
                "world": {
                    "parameters": {
                        "failures": [
                            {"at": self.laser.begin, "device": LIDAR, "failure": self.laser_failure},
                            {"at": self.laser.end, "device": LIDAR, "failure": "none"},
                        ],
                        "crowds": [
                            {"at": self.crowd.begin, "group": CROWD, "present": True},
                            {"at": self.crowd.end, "group": CROWD, "present": False},
                        ],
                    }
                },
                "camera": {
                    "parameters": {
                        "failures": [
                            {"at": self.camera.begin, "failure": "black"},
                            {"at": self.camera.end, "failure": "none"},
                        ]
                    }
                },
                "battery": {
                    "parameters": {
                        "initial_charge": CHARGE,
                        "drains": [
                            {"at": self.drain.begin, "power": DRAIN},
                            {"at": self.drain.end, "power": 0.0},
                        ],
                    }
                },
            }
        }


def contingencies(seed: int) -> Contingencies:
    """Return the contingencies of a run of `SECONDS`.

    The laser fails for 30 to 70 s, in one of three ways. In half of the runs the camera is black for a part of that
    time, in the others later. A fault drains the battery for 20 to 30 s, from three quarters to below one half.
    People crowd a corridor for 40 to 80 s.
    """
    random = Random(f"patrol contingencies {seed}")
    laser = _spell(random, (30.0, 130.0), (30.0, 70.0))
    failure = random.choice(LASER_FAILURES)
    meets = random.random() < 0.5
    begin = laser.begin + random.uniform(5.0, 15.0) if meets else laser.end + random.uniform(10.0, 40.0)
    camera = Spell(round(begin, 1), round(begin + random.uniform(10.0, 25.0), 1))
    drain = _spell(random, (60.0, 200.0), (20.0, 30.0))
    crowd = _spell(random, (20.0, 200.0), (40.0, 80.0))
    return Contingencies(laser, failure, camera, drain, crowd)


def _spell(random: Random, begins: tuple[float, float], lasts: tuple[float, float]) -> Spell:
    begin = random.uniform(*begins)
    return Spell(round(begin, 1), round(begin + random.uniform(*lasts), 1))
