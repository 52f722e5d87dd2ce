"""The deeds of a planner that decides by faults, with their times."""

from __future__ import annotations

from regraft import Component, Input, Parameter, every
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import AdaptationReport, ChangeState, SetParameters
from tests.faults.parts import Summary


class Ledger(Summary):
    """Sums up also which adaptations began at which time."""

    adaptations = Input(AdaptationReport, keep=1000, required=False)

    @adaptations.handler
    def see(self, report: AdaptationReport) -> None:
        for change in report.request.changes:
            if isinstance(change, ChangeState):
                self._note(b"", f"{change.component}.{change.transition.value} at {report.started:.2f}")
            elif isinstance(change, SetParameters):
                self._note(b"", f"{change.component} {dict(change.parameters)} at {report.started:.2f}")


class Judge(Component):
    """Reports that a requirement is not met for some time."""

    until = Parameter(4.0, "when it is met again", unit="s")

    @every(seconds=0.5)
    def judge(self) -> None:
        now = self.kit.now()
        self.kit.report_quality(Quality(now, "Steady", "Comfort", satisfied=not 2.99 < now < self.until - 0.01))
