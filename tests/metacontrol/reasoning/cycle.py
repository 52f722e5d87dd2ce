"""A cycle of the metacontroller without a robot: situations change, designs are entered at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Grounding, Objective, Requirement
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser, Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision, Plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import Clash, no_clash, plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.failures import rest_failed
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation
from tests.metacontrol.owl import NAVIGATE, iri

FAILED, RECOVERED = ComponentStatus.FAILED, ComponentStatus.RECOVERED


def objective(
    name: str = "drive",
    function: str = NAVIGATE,
    bounds: Mapping[str, float] | None = None,
    priority: float = 0.0,
    always_improve: bool = False,
    weights: Mapping[str, float] | None = None,
    begin: str | None = None,
) -> Objective:
    """Return an objective, its names given with prefixes."""
    return Objective(
        iri(name),
        iri(function),
        tuple(Requirement(iri(quality), bound) for quality, bound in (bounds or {}).items()),
        priority,
        always_improve,
        None if weights is None else {iri(quality): weight for quality, weight in weights.items()},
        None if begin is None else iri(begin),
    )


class Cycle:
    """Analyses, plans, and grounds what was decided."""

    def __init__(self, file: Path, *objectives: Objective, clash: Clash = no_clash) -> None:
        self.analyser = Analyser(load([file]))
        self.situation = Situation(tuple(objectives))
        self.resting = Resting()
        self.now = 0.0
        self.clash = clash
        self.analysis: Analysis = self.analyser.analyse(self.situation)
        self.plan = Plan(())

    def analyse(self) -> Analysis:
        """Analyse the situation, and let what fails rest."""
        self.analysis = self.analyser.analyse(self.situation)
        rest_failed(self.analysis, self.resting, self.now)
        return self.analysis

    def run(self, margin: float = 0.05) -> Plan:
        """Run one cycle, a second after the last one."""
        self.now += 1.0
        self.analyse()
        model = self.analyser.model
        self.plan = plan(model, self.situation, self.analysis, self.resting, self.now, clash=self.clash, margin=margin)
        groundings = tuple(
            Grounding(f"{each.objective}/grounding", each.objective, each.design)
            for each in self.plan.decisions
            if each.design is not None
        )
        kept = {each.name for each in groundings if each in self.situation.groundings}
        self.situation = replace(
            self.situation,
            groundings=groundings,
            measurements={name: values for name, values in self.situation.measurements.items() if name in kept},
            errors={name: value for name, value in self.situation.errors.items() if name in kept},
        )
        return self.plan

    def decision(self, name: str = "drive") -> Decision:
        """Return the last decision on an objective."""
        found = self.plan.of(iri(name))
        assert found is not None, self.plan.text()
        return found

    def design(self, name: str = "drive") -> str | None:
        """Run one cycle and return the design that an objective has then, by its short name."""
        self.run()
        found = self.decision(name).design
        return None if found is None else found.rpartition("#")[2]

    def set_components(self, **statuses: ComponentStatus) -> None:
        """Set the status of components of the domain."""
        named = {iri(f"nav:{name}"): status for name, status in statuses.items()}
        self.situation = replace(self.situation, components={**self.situation.components, **named})

    def measure(self, quality: str, value: float, name: str = "drive") -> None:
        """Set the measured value of a quality of what solves an objective."""
        grounding = f"{iri(name)}/grounding"
        measured = {**self.situation.measurements.get(grounding, {}), iri(quality): value}
        self.situation = replace(self.situation, measurements={**self.situation.measurements, grounding: measured})

    def report_error(self, error: Status, name: str = "drive") -> None:
        """Set the error that a grounding reports of itself."""
        self.situation = replace(self.situation, errors={f"{iri(name)}/grounding": error})
