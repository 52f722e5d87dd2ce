"""The record of FROG's rounds, every simulated second."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter

import numpy as np

from regraft import Input
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.power import EnergyUse, PowerDraw
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import LaserScan, LightLevel
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.evaluation.rows import Cell, RowRecorder

OWN, CORNER = "camera", "corner_camera"
DRIVER, LOOKER = "navigator", "detector"
REQUIREMENTS = ("MoveSafely", "MoveQuickly", "MovePowerEfficiently", "DetectPowerEfficiently", "DetectEffectively")
LIDAR_LEAST = 0.12
"""m: what is nearer is no echo."""


class RoundsRecorder(RowRecorder):
    """Writes down how FROG makes its rounds: what it does, what it sees, what it takes, what it is set to.

    ``speed`` is the mean of the true speed over the second, ``speed_now`` the speed at its end. ``nearest`` is
    the last scan's nearest echo (m). ``motion_power`` is the mean over the second (W), ``picture_energy`` what on-board
    pictures have taken so far (J). ``looks`` counts calls of the detector, and ``squares`` adds up the squares of
    their pictures, as the published account does. ``leg`` counts the drives to a goal, ``driving`` is whether one is
    under way. Each requirement has a column: 1 satisfied, 0 not, empty while its task does not run or it is unknown.
    """

    ground_truth = Input(GroundTruth, keep=256, description="how fast the robot really is")
    scan = Input(LaserScan, latest_only=True, description="what is near")
    power = Input(PowerDraw, keep=64, description="what driving takes")
    energy = Input(EnergyUse, keep=256, description="what pictures take")
    detections = Input(Detections, keep=256, description="what is seen")
    light = Input(LightLevel, latest_only=True, description="how dark it is")
    architecture = Input(Architecture, latest_only=True, description="what is set, and connected")
    adaptations = Input(AdaptationReport, keep=256, description="what is changed when")
    mission = Input(MissionStatus, latest_only=True, description="how the requirements are met")

    def on_configure(self) -> None:
        """Begin to count."""
        super().on_configure()
        self._pictures: Counter[str] = Counter()
        self._hits: Counter[str] = Counter()
        self._asked: tuple[list[float], list[int]] = ([], [])
        self._looks = self._squares = self._energy = 0.0
        self._leg = self._changes = 0
        self._leg_energy: float | None = None

    def row(self, now: float) -> dict[str, Cell]:
        """Return what is so now."""
        self._take_adaptations()
        self._take_detections()
        self._energy += sum(use.energy for use in self.energy.take() if use.consumer == LOOKER)
        light = self.light.latest
        return {
            **self._drive(),
            **self._settings(),
            "darkness": light.darkness if light else None,
            **self._counts(),
            **self._requirements(),
        }

    def _drive(self) -> dict[str, Cell]:
        truths = self.ground_truth.take()
        draws = [draw.consumers["motion"] for draw in self.power.take() if "motion" in draw.consumers]
        scan = self.scan.latest
        last = truths[-1] if truths else None
        driving = self._follow_leg()
        return {
            "leg": self._leg,
            "driving": driving,
            "x": last.pose.x if last else None,
            "y": last.pose.y if last else None,
            "speed": float(np.mean([abs(truth.twist.forward) for truth in truths])) if truths else None,
            "speed_now": abs(last.twist.forward) if last else None,
            "nearest": None if scan is None else _nearest(scan),
            "motion_power": float(np.mean(draws)) if draws else None,
            "contacts": last.contacts if last else None,
        }

    def _follow_leg(self) -> bool:
        """Count a leg when a drive begins; returns whether one is under way."""
        told = self._told("MovePowerEfficiently")
        driving = told is not None and told.active
        energy = told.metric if told is not None and driving else None
        if driving and (self._leg_energy is None or (energy is not None and energy < self._leg_energy)):
            self._leg += 1
        self._leg_energy = (energy or 0.0) if driving else None
        return driving

    def _settings(self) -> dict[str, Cell]:
        architecture = self.architecture.latest
        if architecture is None:
            return {"max_velocity": None, "pictures_asked": None, "image_topic": None}
        return {
            "max_velocity": _number(_parameter(architecture, DRIVER, "max_velocity")),
            "pictures_asked": _number(_parameter(architecture, LOOKER, "pictures")),
            "image_topic": architecture.components[LOOKER].connections.get("image"),
        }

    def _take_adaptations(self) -> None:
        for report in self.adaptations.take():
            if report.outcome is not Outcome.APPLIED or not report.request.changes:
                continue
            self._changes += 1
            for change in report.request.changes:
                if isinstance(change, SetParameters) and change.component == LOOKER and "pictures" in change.parameters:
                    self._asked[0].append(report.started)
                    self._asked[1].append(int(change.parameters["pictures"]))

    def _take_detections(self) -> None:
        for seen in self.detections.take():
            self._pictures[seen.camera] += 1
            self._hits[seen.camera] += bool(seen.objects)
            asked = self._asked_at(seen.stamp)
            self._looks += 1.0 / asked
            self._squares += asked

    def _asked_at(self, stamp: float) -> int:
        """Return how many pictures were asked for of the call that a picture belongs to."""
        times, numbers = self._asked
        index = bisect_right(times, stamp)
        if index:
            return numbers[index - 1]
        architecture = self.architecture.latest
        first = None if architecture is None or times else _parameter(architecture, LOOKER, "pictures")
        return int(first or 1)

    def _counts(self) -> dict[str, Cell]:
        return {
            "looks": round(self._looks, 3),
            "squares": self._squares,
            "own_pictures": self._pictures[OWN],
            "own_hits": self._hits[OWN],
            "corner_pictures": self._pictures[CORNER],
            "corner_hits": self._hits[CORNER],
            "picture_energy": self._energy,
            "changes": self._changes,
        }

    def _requirements(self) -> dict[str, Cell]:
        found: dict[str, Cell] = {}
        for name in REQUIREMENTS:
            told = self._told(name)
            found[name] = told.satisfied if told is not None and told.active else None
        return found

    def _told(self, name: str) -> Quality | None:
        status = self.mission.latest
        qualities = status.qualities if status else ()
        return next((quality for quality in qualities if quality.requirement.split("#")[0] == name), None)


def _nearest(scan: LaserScan) -> float:
    """Return the nearest echo (m), the farthest range if there is none."""
    heard = scan.ranges[np.isfinite(scan.ranges) & (scan.ranges >= LIDAR_LEAST)]
    return float(heard.min()) if heard.size else float(scan.range_max)


def _parameter(architecture: Architecture, component: str, name: str) -> PlainValue:
    """Return what a parameter should be: what is set, or else the class's default."""
    spec = architecture.components[component]
    if name in spec.parameters:
        return spec.parameters[name]
    known = spec.description.parameters if spec.description else ()
    return next((parameter.default for parameter in known if parameter.name == name), None)


def _number(value: object) -> Cell:
    return float(value) if isinstance(value, int | float) else None
