"""How long steps have taken, by what they do and to a component of which class."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Iterable

from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.steps.actions import PlannedStep, RunProcess
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, Phase, StepReport, StepState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.qualities.estimates import Basis, StepEstimate

REMEMBERED = 200
"""Steps of a kind, with a class, that count: the latest."""
ASSUMED = {"run_process": (0.5, 3.0), "take_part": (0.05, 0.5), "connect_port": (0.03, 0.3), "reach_state": (0.05, 1.0)}
ASSUMED_OTHERWISE = (0.01, 0.1)
"""Median and 95th percentile, in seconds, of steps that have never been done."""
AROUND = (Phase.CHECK, Phase.VERIFY)


class Durations:
    """Learns from adaptations that were applied."""

    def __init__(self) -> None:
        self._steps: defaultdict[tuple[str, str], deque[float]] = defaultdict(lambda: deque(maxlen=REMEMBERED))
        self._around: defaultdict[Phase, deque[float]] = defaultdict(lambda: deque(maxlen=REMEMBERED))

    def learn(self, report: AdaptationReport, planned: Iterable[PlannedStep], architecture: Architecture) -> None:
        """Take over how long the steps of an adaptation took, if it was applied."""
        if report.outcome is not Outcome.APPLIED:
            return
        done: dict[int, StepReport] = {step.number: step for step in report.steps if step.state is StepState.DONE}
        for number, step in enumerate(planned, start=1):
            if number in done:
                kind, cls = _kind(step, architecture)
                for key in {(kind, cls), (kind, "")}:
                    self._steps[key].append(done[number].duration)
        for phase in report.phases:
            if phase.phase in AROUND:
                self._around[phase.phase].append(phase.duration)

    def of(self, plan: Plan) -> tuple[StepEstimate, ...]:
        """Return what the steps of a plan are expected to take."""
        return tuple(self._step(number, step, plan.after) for number, step in enumerate(plan.steps, start=1))

    def around(self, share: float) -> float:
        """Return what checking and verifying takes besides the steps, at most, in a ``share`` of all adaptations."""
        return sum(quantile(seen, share) for phase in AROUND if (seen := self._around[phase]))

    def _step(self, number: int, step: PlannedStep, architecture: Architecture) -> StepEstimate:
        kind, cls = _kind(step, architecture)
        for key, basis in (((kind, cls), Basis.CLASS), ((kind, ""), Basis.KIND)):
            seen = self._steps.get(key)
            if seen:
                median, p95 = quantile(seen, 0.5), quantile(seen, 0.95)
                return StepEstimate(number, step.component, step.text, median, p95, len(seen), basis)
        median, p95 = ASSUMED.get(kind, ASSUMED_OTHERWISE)
        return StepEstimate(number, step.component, step.text, median, p95, 0, Basis.ASSUMED)


def _kind(step: PlannedStep, architecture: Architecture) -> tuple[str, str]:
    spec = step.do.spec if isinstance(step.do, RunProcess) else architecture.components.get(step.component)
    return step.do.action, (spec.cls or " ".join(spec.command)) if spec else ""


def quantile(values: Iterable[float], share: float) -> float:
    """Return the least of ``values`` that at least a ``share`` of them does not exceed (nearest rank).

    >>> quantile([4.0, 1.0, 3.0, 2.0], 0.5), quantile([4.0, 1.0, 3.0, 2.0], 0.95)
    (2.0, 4.0)
    """
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]
