"""The record of a patrol, every simulated second."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from regraft import Input, Records
from regraft.bus_schema.annotations import Seconds, Text
from regraft.bus_schema.messages.maps import Goals
from regraft.bus_schema.messages.power import BatteryState, PowerDraw
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.evaluation.rows import Cell, RowRecorder
from regraft.services import robot_parameters
from regraft.services.navigator.normalized_qualities import RecentWay, energy, safety

SKILL: Final = "to_navigate"
DRIVER: Final = "controller_server"
LARGEST_POWER: Final = 25.0
"""W: the power that the quality energy is a share of, as in patrol.skills."""
AT_PLACE: Final = 0.4
"""m, from the pose in front of a place: the controller's tolerance, the localization's 0.3 m left out."""
EVERY_BEAM: Final = 5
"""Of the true scan, one in so many ranges is written down."""
STANDING: Final = 0.03
"""m/s and rad/s: slower is standing."""


@dataclass(frozen=True, slots=True)
class NamedSpell:
    """A contingency of this run, from ``begin`` to ``end``."""

    name: Annotated[str, Text(64)]
    begin: Seconds
    end: Seconds


class PatrolRecorder(RowRecorder):
    """Writes down how a patrol goes, by what really is.

    ``gap`` is the distance (m) from the robot's rim to the nearest thing, by a lidar that never fails. ``error`` is how
    far (m) the robot is from where it believes to be. ``safety``, ``performance`` and ``energy`` are
    computed from the truth by the formulas that the robot measures itself by. ``places`` counts the places reached.
    ``realization`` is the mode of the skill, ``max_velocity`` (m/s) how fast it may drive.
    ``uses_laser`` and ``uses_camera`` are which sensor it drives by.
    ``true_ranges`` are ranges of that lidar, see `ranges_of`.
    Each of ``spells`` has a column: whether that contingency lasts.
    """

    spells = Records(NamedSpell, "when what goes wrong: a column each")

    radius = robot_parameters.radius()
    velocity_limit = robot_parameters.velocity_limit()
    acceleration = robot_parameters.acceleration()

    ground_truth = Input(GroundTruth, keep=256, description="where the robot really is")
    true_scan = Input(LaserScan, latest_only=True, description="what is really around it")
    localization = Input(Odometry, latest_only=True, required=False, description="where it believes to be")
    goals = Input(Goals, latest_only=True, description="the places")
    power = Input(PowerDraw, keep=64, description="what it draws")
    battery = Input(BatteryState, latest_only=True, description="what is left")
    architecture = Input(Architecture, latest_only=True, description="what is in force")
    adaptations = Input(AdaptationReport, keep=256, description="what is changed when")

    def on_configure(self) -> None:
        """Begin to count."""
        super().on_configure()
        self._places = self._applied = self._undone = 0
        self._last_place = ""
        self._energy = self._power = 0.0
        self._way = RecentWay()

    def row(self, now: float) -> dict[str, Cell]:
        """Return what is so now."""
        self._take_adaptations()
        self._take_power()
        battery = self.battery.latest
        return {
            **self._drive(now),
            "power": self._power,
            "energy_drawn": self._energy,
            "energy": energy(self._power, LARGEST_POWER),
            "charge": battery.charge if battery else None,
            **self._design(),
            "adaptations": self._applied,
            "taken_back": self._undone,
            **{spell.name: spell.begin <= now < spell.end for spell in self.spells},
        }

    def _drive(self, now: float) -> dict[str, Cell]:
        truths = self.ground_truth.take()
        for truth in truths:
            self._way.take(truth.stamp, truth.twist.forward)
            if abs(truth.twist.forward) < STANDING and abs(truth.twist.turn) < STANDING:
                self._note_visit(truth)
        last = truths[-1] if truths else None
        gap = self._gap()
        return {
            "x": last.pose.x if last else None,
            "y": last.pose.y if last else None,
            "yaw": last.pose.yaw if last else None,
            "error": self._error(last) if last else None,
            "speed": float(np.mean([abs(truth.twist.forward) for truth in truths])) if truths else None,
            "gap": gap,
            "safety": safety(gap, last.twist.forward, self.acceleration) if last and gap is not None else None,
            "performance": self._way.performance(self.velocity_limit),
            "contacts": last.contacts if last else None,
            "places": self._places,
            "last_place": self._last_place,
            "true_ranges": self._true_ranges() if last else "",
        }

    def _true_ranges(self) -> str:
        scan = self.true_scan.latest
        if scan is None:
            return ""
        return " ".join(f"{distance:.2f}" for distance in scan.ranges[::EVERY_BEAM])

    def _gap(self) -> float | None:
        scan = self.true_scan.latest
        if scan is None:
            return None
        heard = scan.ranges[np.isfinite(scan.ranges)]
        nearest = float(heard.min()) if heard.size else float(scan.range_max)
        return max(nearest - self.radius, 0.0)

    def _error(self, truth: GroundTruth) -> float | None:
        believed = self.localization.latest
        if believed is None:
            return None
        return math.dist((truth.pose.x, truth.pose.y), (believed.pose.x, believed.pose.y))

    def _note_visit(self, truth: GroundTruth) -> None:
        known = self.goals.latest
        for goal in known.goals if known else ():
            place = goal.pose.pose
            is_there = math.dist((truth.pose.x, truth.pose.y), (place.x, place.y)) <= AT_PLACE
            if is_there and goal.name != self._last_place:
                self._last_place = goal.name
                self._places += 1
                return

    def _take_power(self) -> None:
        for draw in self.power.take():
            self._power = sum(draw.consumers.values())
            self._energy += self._power * 0.5  # a draw is the mean of half a second

    def _take_adaptations(self) -> None:
        for report in self.adaptations.take():
            if not report.request.changes:
                continue
            self._applied += report.outcome is Outcome.APPLIED
            self._undone += report.outcome is Outcome.ROLLED_BACK

    def _design(self) -> dict[str, Cell]:
        architecture = self.architecture.latest
        if architecture is None:
            return {"realization": "", "max_velocity": None, "uses_laser": None, "uses_camera": None}
        mode = architecture.asked_modes.get(SKILL, "")
        parts = architecture.components
        velocity = parts[DRIVER].parameters.get("max_velocity") if DRIVER in parts else None
        return {
            "realization": mode.removeprefix(f"{SKILL}."),
            "max_velocity": float(velocity) if isinstance(velocity, int | float) else None,
            "uses_laser": "laser_resender" in parts and parts["laser_resender"].state is State.ACTIVE,
            "uses_camera": "camera" in parts and parts["camera"].state is State.ACTIVE,
        }


def ranges_of(cell: str) -> list[float]:
    """Return the ranges (m) of a cell of ``true_ranges``, counter-clockwise from straight ahead; inf for no echo.

    >>> ranges_of("1.25 inf")
    [1.25, inf]
    """
    return [float(distance) for distance in cell.split()]
