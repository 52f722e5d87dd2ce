"""The leaf that charges the battery."""

from __future__ import annotations

from typing import Any

from behavior_tree import SUCCESS, Input, Output, Status
from regraft.bus_schema.messages.power import Charge, Charged, ChargeProgress
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked


class ChargeBattery(Asking):
    """Stands on the dock until the battery is full enough; fails if it cannot be charged, and leaves when halted."""

    until = Input(float, default=0.98, description="how full the battery is to be, as a ratio")
    action = Input(str, default="charge", description="the action that charges")
    accept_within = Input(float, default=10.0, description="seconds in which the goal must be accepted")
    charge = Output(float, description="how full the battery is, as a ratio")
    phase = Output(str, description="what is being done: driving, searching or charging")
    time_left = Output(float, description="seconds until it is full enough")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        return self.context.goal(
            self.action, Charge(self.until), Charged, ChargeProgress, accept_within=self.accept_within
        )

    def progress(self, feedback: ChargeProgress) -> None:
        """Report how it goes."""
        write_if_connected(self, "charge", feedback.charge)
        write_if_connected(self, "phase", feedback.phase)
        write_if_connected(self, "time_left", feedback.time_left)

    def answered(self, answer: Charged) -> Status:
        """Succeed if the battery is full enough."""
        write_if_connected(self, "charge", answer.charge)
        if not answer.charged:
            return self.failed(answer.reason or "the battery was not charged")
        write_if_connected(self, "time_left", 0.0)
        return SUCCESS
