"""The record of FROG's exploring, every simulated second."""

from __future__ import annotations

from regraft import Input
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.power import BatteryState, ChargerState, PowerDraw
from regraft.bus_schema.messages.world import GroundTruth
from regraft.evaluation.rows import Cell, RowRecorder

REQUIREMENT = "MinBatterySystem"
CHARGE = "Charge::"
"""A part of the path of the leaf that charges."""
EXPLORING, CHARGING = "exploring", "charging"


class ExploringRecorder(RowRecorder):
    """Writes down how FROG explores: what it does, how full the battery is, whether it is to be so full.

    ``task`` is what the tree has the robot do: exploring or charging, and the mission's state when it is over.
    ``satisfied`` is whether the requirement MinBatterySystem is met. ``charger_power`` is what the charger offers (W),
    ``power`` what the robot draws.
    """

    mission = Input(MissionStatus, latest_only=True, description="what the robot does, how the requirement is met")
    battery = Input(BatteryState, latest_only=True)
    charger = Input(ChargerState, latest_only=True, required=False)
    power = Input(PowerDraw, latest_only=True)
    ground_truth = Input(GroundTruth, keep=256)

    def row(self, now: float) -> dict[str, Cell]:
        """Return what is so now."""
        status, battery, charger = self.mission.latest, self.battery.latest, self.charger.latest
        truths = self.ground_truth.take()
        return {
            "task": _task(status) if status else None,
            "satisfied": _satisfied(status) if status else None,
            "charge": battery.charge if battery else None,
            "power": self.power.latest.total if self.power.latest else None,
            "charger_power": (charger.power if charger.connected else 0.0) if charger else None,
            "frontiers_left": _number(status, "frontiers_left"),
            "charges": _number(status, "charges"),
            "x": truths[-1].pose.x if truths else None,
            "y": truths[-1].pose.y if truths else None,
            "contacts": truths[-1].contacts if truths else None,
        }


def _task(status: MissionStatus) -> str:
    if not status.running:
        return status.state.value
    return CHARGING if any(f"/{path}".rpartition("/")[2].startswith(CHARGE) for path in status.running) else EXPLORING


def _satisfied(status: MissionStatus) -> bool | None:
    told = [quality for quality in status.qualities if quality.requirement == REQUIREMENT and quality.active]
    return told[0].satisfied if told else None


def _number(status: MissionStatus | None, entry: str) -> Cell:
    value = status.blackboard.get(entry) if status else None
    return value if isinstance(value, int | float) else None
