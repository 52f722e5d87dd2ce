"""Disturbances and reactions as SUAVE's metrics count them (docs/source/metrics.md and mission_metrics.py of 1.5.0).

A disturbance begins with the diagnostic that reports it. It is answered when the change is in effect:

- a thruster is reported as failed, until ``f_maintain_motion_node`` is active;
- the altitude of the search is not that of the measured visibility, until it is;
- the battery is reported below its limit, until ``generate_recharge_path_node`` is active.

One disturbance of a kind is open at a time. The altitude is left alone while the battery is low.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

THRUSTER, VISIBILITY, BATTERY = "thruster", "visibility", "battery"
KINDS: Final = (THRUSTER, VISIBILITY, BATTERY)
ALTITUDES: Final = ((3.25, 3.0), (2.25, 2.0), (1.25, 1.0))
"""Visibilities (m) from which on an altitude (m) is expected: ``mission_metrics`` of mission_config.yaml."""
BATTERY_LIMIT: Final = 0.25


def expected_altitude(visibility: float) -> float | None:
    """Return the altitude (m) that is expected at a visibility (m), None where one sees too little for any.

    >>> [expected_altitude(each) for each in (3.75, 3.25, 3.2499, 2.25, 1.25, 1.2499)]
    [3.0, 3.0, 2.0, 2.0, 1.0, None]
    """
    return next((altitude for threshold, altitude in ALTITUDES if visibility >= threshold), None)


@dataclass(slots=True)
class Tally:
    """The disturbances of one kind: when the open one began, and how long the answered ones took (s)."""

    since: float | None = None
    count: int = 0
    answered: list[float] = field(default_factory=list)

    def begin(self, now: float) -> None:
        """Note a disturbance, unless one is open."""
        if self.since is None:
            self.since = now
            self.count += 1

    def answer(self, now: float) -> None:
        """Note that the open one is answered, if there is one."""
        if self.since is not None:
            self.answered.append(now - self.since)
            self.since = None

    def drop(self) -> None:
        """Give the open one up."""
        self.since = None


class Reactions:
    """Counts disturbances and reactions of one run from what is reported. Times are simulated seconds."""

    def __init__(self) -> None:
        self.tallies = {kind: Tally() for kind in KINDS}
        self.altitude: float | None = None
        self.visibility: float | None = None
        self._battery_is_low = False
        self._active: frozenset[str] = frozenset()

    def see_thruster(self, now: float, failed: bool) -> None:
        """Take the status of a thruster."""
        if failed:
            self.tallies[THRUSTER].begin(now)

    def see_visibility(self, now: float, visibility: float) -> None:
        """Take a measured visibility (m)."""
        self.visibility = visibility
        is_right = self.altitude is None or self.altitude == expected_altitude(visibility)
        if not is_right and not self._battery_is_low:
            self.tallies[VISIBILITY].begin(now)

    def see_altitude(self, now: float, altitude: float) -> None:
        """Take the altitude (m) at which the search is set."""
        changed, self.altitude = altitude != self.altitude, altitude
        if changed and self.visibility is not None and altitude == expected_altitude(self.visibility):
            self.tallies[VISIBILITY].answer(now)

    def see_battery(self, now: float, level: float) -> None:
        """Take the level of the battery: a low one ends what was open of the altitude."""
        if level < BATTERY_LIMIT and not self._battery_is_low:
            self._battery_is_low = True
            self.tallies[BATTERY].begin(now)
            self.tallies[VISIBILITY].drop()
        elif level > BATTERY_LIMIT and self._battery_is_low:
            self._battery_is_low = False
            self.tallies[BATTERY].drop()

    def see_active(self, now: float, active: Sequence[str]) -> None:
        """Take the components that are active."""
        new, self._active = frozenset(active) - self._active, frozenset(active)
        if "f_maintain_motion_node" in new:
            self.tallies[THRUSTER].answer(now)
        if "generate_recharge_path_node" in new:
            self.tallies[BATTERY].answer(now)
