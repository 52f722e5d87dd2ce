"""SUAVE's component ``mission_metrics``: what is measured of a run, every simulated second."""

from __future__ import annotations

from regraft import Input
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.objectives import COMPONENT_STATUS, QUALITY_STATUS
from regraft.bus_schema.messages.management.system import SystemStates
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.evaluation.rows import Cell, RowRecorder
from regraft.stacks.suave.messages import Detection, Inspection
from regraft.stacks.suave.monitors import FAILED
from regraft.stacks.suave.studies.events import KINDS, Reactions

SEARCH = "f_generate_search_path_node"


class MissionMetrics(RowRecorder):
    """Writes down disturbances and reactions so far, by kind: how many there were, and how long they took in all (s).

    Times are those of the diagnostics and of the changes, to the tick. ``found`` is whether the pipeline has been seen,
    ``distance`` what was inspected (m).
    """

    diagnostics = Input(Diagnostic, description="what the monitors report")
    states = Input(SystemStates, topic="system/states", latest_only=True)
    architecture = Input(Architecture, topic="/architecture", latest_only=True, description="the altitude")
    detection = Input(Detection, latest_only=True)
    inspection = Input(Inspection, latest_only=True, required=False)
    mission = Input(MissionStatus, latest_only=True)

    def on_configure(self) -> None:
        """Begin without an event."""
        super().on_configure()
        self._reactions = Reactions()

    @diagnostics.handler
    def take_diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take what a monitor reports."""
        for name, value in diagnostic.values.items():
            if diagnostic.text == COMPONENT_STATUS:
                self._reactions.see_thruster(diagnostic.stamp, value == FAILED)
            elif diagnostic.text == QUALITY_STATUS and isinstance(value, float):
                if name == "water_visibility":
                    self._reactions.see_visibility(diagnostic.stamp, value)
                elif name == "battery_level":
                    self._reactions.see_battery(diagnostic.stamp, value)

    @states.handler
    def take_states(self, states: SystemStates) -> None:
        """Take which components are active."""
        active = [each.component for each in states.components if each.state is State.ACTIVE]
        self._reactions.see_active(self.kit.now(), active)

    @architecture.handler
    def take_architecture(self, architecture: Architecture) -> None:
        """Take the altitude at which the search is set."""
        altitude = architecture.components[SEARCH].parameters.get("spiral_altitude")
        if isinstance(altitude, float):
            self._reactions.see_altitude(self.kit.now(), altitude)

    def row(self, now: float) -> dict[str, Cell]:
        """Return what is so now."""
        row: dict[str, Cell] = {
            "visibility": self._reactions.visibility,
            "altitude": self._reactions.altitude,
            "found": bool(self.detection.latest and self.detection.latest.detected),
            "distance": self.inspection.latest.distance if self.inspection.latest else 0.0,
            "mission": self.mission.latest.state.value if self.mission.latest else None,
        }
        for kind in KINDS:
            tally = self._reactions.tallies[kind]
            row |= {
                f"{kind}_disturbances": tally.count,
                f"{kind}_reactions": len(tally.answered),
                f"{kind}_seconds": sum(tally.answered),
            }
        return row
