"""A pump that clogs while time passes, and a record of how it is adapted."""

from __future__ import annotations

import hashlib

from regraft import Component, Input, Parameter, Quality, every, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.management.system import SystemMeasurements
from regraft.bus_schema.model.adaptation import AdaptationReport, SetParameters
from tests.stepped.parts import Reading

CLOGGED_AT = 2.0
"""Seconds."""


class Pump(Component):
    """Clogs after a while where it pumps with all it has; its class does not expect that."""

    evaluate_every = 0.2

    position = Input(Reading)
    share = Parameter(1.0, "of the full flow", minimum=0.0, maximum=1.0)

    flow = Quality("what is pumped", unit="m3/s", better="higher", minimum=0.0)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the flow of a pump that is not clogged."""
        return {"flow": float(parameters["share"])}

    def evaluate(self) -> dict[str, float]:
        """Return the flow."""
        clogged = self.share > 0.5 and self.kit.now() >= CLOGGED_AT
        return {"flow": self.share * (0.1 if clogged else 1.0)}


class Record(Component):
    """Sums up which share was chosen, when and by which measurement, and all that was measured."""

    adaptations = Input(AdaptationReport, keep=1000)
    measurements = Input(SystemMeasurements, topic="system/measurements", keep=1000)

    def __init__(self) -> None:
        self.chain = hashlib.sha256()
        self.visits: dict[str, int] = {}

    @every(seconds=0.25)
    def absorb(self) -> None:
        """Take what has come."""
        for message in self.measurements.take():
            self.chain.update(codec.encode(message))
        for report in self.adaptations.take():
            (change,) = report.request.changes
            assert isinstance(change, SetParameters)
            measured = report.request.context["measured"]["flow"]
            what = f"share {change.parameters['share']} by {measured} at {report.started:g} s"
            self.chain.update(what.encode())
            self.visits[what] = 1

    @service("run_summary")
    def run_summary(self, request: RunSummaryRequest) -> RunSummary:
        """Return the digest, and the choices as visits."""
        return RunSummary(self.kit.now(), self.chain.hexdigest(), 0, 0, 0.0, self.visits, {}, {}, {})
