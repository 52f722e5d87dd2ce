"""Writes down twice a second what is active, where the robot is, and the reasons that are given for its standing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from regraft import CallFailed, Component, Input, Parameter, every
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.management.objectives import COMPONENT_STATUS, LIST, ObjectivesQuery, ObjectivesStatus
from regraft.bus_schema.messages.management.system import SystemDiagnostics, SystemStates
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.power import ChargerState
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.planners import planner_service


@dataclass(frozen=True, slots=True)
class Seen:
    """A time (s), the components that are active then, the place (m), and why the robot might stand."""

    time: float
    active: frozenset[str]
    place: tuple[float, float]
    reasons: tuple[str, ...]


class Witness(Component):
    """A line for each half second.

    Reasons are those of the objectives, the mission's trouble, the dock, and errors that components report.
    """

    file = Parameter("", "the file that is written", unit="path", read_only=True)

    states = Input(SystemStates, topic="system/states", latest_only=True)
    truth = Input(GroundTruth, topic="ground_truth", latest_only=True)
    mission = Input(MissionStatus, latest_only=True)
    charger = Input(ChargerState, latest_only=True)
    diagnostics = Input(SystemDiagnostics, topic="system/diagnostics", latest_only=True)

    @every(hz=2.0)
    async def write(self) -> None:
        """Write a line."""
        known, truth = self.states.latest, self.truth.latest
        if known is None or truth is None:
            return
        now = self.kit.now()
        active = sorted(each.component for each in known.components if each.state is State.ACTIVE)
        at = truth.pose.position
        line = json.dumps([now, active, [at.x, at.y], await self._reasons()])
        with Path(self.file).open("a", encoding="utf-8") as file:
            file.write(line + "\n")

    async def _reasons(self) -> list[str]:
        mission, charger = self.mission.latest, self.charger.latest
        trouble = mission.blackboard.get("trouble") if mission is not None else None
        found = [*self._errors(), *([str(trouble)] if trouble else [])]
        if charger is not None and charger.connected:
            found.append("it is on the dock")
        try:
            service = planner_service("metacontrol", LIST)
            told = await self.kit.call(service, ObjectivesQuery(), ObjectivesStatus, timeout=0.3)
        except CallFailed as error:
            return [*found, str(error)]
        return [*found, *(reason for each in told.objectives for reason in each.reasons)]

    def _errors(self) -> list[str]:
        """Return what components report of themselves."""
        known = self.diagnostics.latest
        errors = [each for each in known.present if each.level is Level.ERROR] if known is not None else []
        return [f"{each.source}: {each.text}" for each in errors if each.text != COMPONENT_STATUS]


def read(file: Path) -> list[Seen]:
    """Return what a witness has written."""
    lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return [Seen(time, frozenset(active), (x, y), tuple(reasons)) for time, active, (x, y), reasons in lines]
