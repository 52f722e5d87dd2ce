"""A metacontroller without a knowledge base: it offers what metacontrollers offer, and grounds at once or when told."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from regraft import Component, Parameter, RefusalCode, RequestRefused, action, service
from regraft.bus_schema.messages.management.objectives import (
    ContextRequest,
    ContextStatus,
    Explanation,
    ExplanationQuery,
    Objective,
    ObjectivesCancellation,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveState,
    ObjectiveStatus,
    Progress,
    ProgressReport,
)
from regraft.bus_schema.model.qualities.bounds import Comparison
from regraft.bus_schema.suggestions import no_such

EXPECTED: Final = {
    "to_navigate": {"fast": {"safety": 0.6, "energy": 0.7}, "careful": {"safety": 0.9, "energy": 0.4}},
    "to_detect": {"near": {"safety": 0.8}},
}
"""The expected qualities of each realization, by skill."""
DIRECTIONS: Final = {"safety": Comparison.AT_LEAST, "energy": Comparison.AT_MOST}
RESULTS: Final = {"to_navigate": {"SUCCESS": Progress.SUCCESS, "ERROR": Progress.ERROR, "near": Progress.INPROGRESS}}
"""The results of skills; a skill without any has no meaning for a report."""
CONTEXTS: Final = ("Default", "Dark")
STEP: Final = 0.05
"""Seconds between two looks at an objective."""


class SmallMetacontroller(Component):
    """Provides skills by the first realization whose expected qualities meet the bounds."""

    by_hand = Parameter(False, "whether objectives are grounded only when a test does it")

    def __init__(self) -> None:
        self.given: dict[str, Objective] = {}
        self.known: dict[str, ObjectiveStatus] = {}
        self.ended: dict[str, ObjectiveStatus] = {}
        self.context = CONTEXTS[0]
        self.log: list[str] = []
        self.requests: list[ObjectivesRequest] = []

    # --- for tests ---

    def ground(self, name: str, realization: str, **measured: float) -> None:
        """Provide an objective."""
        self._change(
            name,
            state=ObjectiveState.IN_PROGRESS,
            realization=realization,
            mode=f"{self.known[name].skill}.{realization}",
            measured=measured,
            since=self.kit.now(),
            reasons=(),
        )

    def break_down(self, name: str, state: ObjectiveState, reason: str, *, stays: bool = False) -> None:
        """Put an objective in error, with its realization still in force or with none."""
        kept = self.known[name]
        self._change(
            name,
            state=state,
            reasons=(reason,),
            realization=kept.realization if stays else "",
            mode=kept.mode if stays else "",
        )

    def end(self, name: str, progress: Progress = Progress.INPROGRESS) -> ObjectiveStatus:
        """End an objective."""
        self.log.append(f"end {name} {progress.value}")
        self.given.pop(name)
        self.ended[name] = replace(self.known.pop(name), progress=progress, ended=True, realization="", mode="")
        return self.ended[name]

    def _change(self, name: str, **fields: object) -> None:
        self.known[name] = replace(self.known[name], **fields)  # type: ignore[arg-type]

    # --- as a metacontroller ---

    @service("planners/{name}/objectives/add")
    def add(self, request: ObjectivesRequest) -> ObjectivesStatus:
        """Take objectives, all or none."""
        self.requests.append(request)
        for index, objective in enumerate(request.objectives):
            self._check(objective, f"objectives.{index}.")
        names = [self._take(objective) for objective in request.objectives]
        return self._status(names)

    @service("planners/{name}/objectives/list")
    def list_objectives(self, request: ObjectivesQuery) -> ObjectivesStatus:
        """Report objectives."""
        return self._status([self._existing(request.objective)] if request.objective else list(self.known))

    @service("planners/{name}/objectives/explain")
    def explain(self, request: ExplanationQuery) -> Explanation:
        """Explain."""
        known = self.known[self._existing(request.objective)]
        text = f"{known.objective}: {known.realization or 'none'} ({known.state.value})\n  among {len(EXPECTED)} skills"
        return Explanation(known.objective, self.kit.now(), text, {"design": known.realization or None})

    @service("planners/{name}/objectives/cancel")
    def cancel(self, request: ObjectivesCancellation) -> ObjectivesStatus:
        """End objectives; answer with those that are left."""
        if request.objective:
            names = [self._existing(request.objective)]
        else:
            names = [name for name, known in self.known.items() if known.task == request.task]
            if not names:
                tasks = {known.task for known in self.known.values()}
                raise RequestRefused(no_such("task", request.task, tasks), RefusalCode.NOT_FOUND, field="task")
        for name in names:
            self.end(name)
        return self._status(list(self.known))

    @service("planners/{name}/objectives/report")
    def report(self, request: ProgressReport) -> ObjectiveStatus:
        """Classify a result."""
        known = self.known[self._existing(request.objective)]
        results = RESULTS.get(known.skill, {})
        if request.text not in results:
            why = no_such("result", request.text, results)
            raise RequestRefused(f"{known.skill}: {why}", RefusalCode.INVALID, field="text")
        progress = results[request.text]
        if progress is not Progress.INPROGRESS:
            return self.end(request.objective, progress)
        self.log.append(f"report {known.objective} {request.text}")
        return known

    @service("planners/{name}/objectives/context")
    def set_context(self, request: ContextRequest) -> ContextStatus:
        """Set the context."""
        if request.context not in CONTEXTS:
            raise RequestRefused(no_such("context", request.context, CONTEXTS), RefusalCode.NOT_FOUND, field="context")
        before, self.context = self.context, request.context
        return ContextStatus(self.context, before)

    @action("planners/{name}/objective", feedback=ObjectiveStatus, goals=16)
    async def pursue(self, objective: Objective) -> ObjectiveStatus:
        """Provide an objective until it ends, or its client cancels it."""
        self._check(objective, "")
        name = self._take(objective)
        published: ObjectiveStatus | None = None
        try:
            while name in self.known:
                if self.known[name] != published:
                    published = self.known[name]
                    self.kit.feedback(published)
                await self.kit.sleep(STEP)
        finally:
            if name in self.known:
                self.end(name)
        return self.ended[name]

    def _check(self, objective: Objective, place: str) -> None:
        if objective.skill not in EXPECTED:
            why = no_such("skill", objective.skill, EXPECTED)
            raise RequestRefused(why, RefusalCode.NOT_FOUND, field=f"{place}skill")
        for quality in objective.requirements:
            if quality not in DIRECTIONS:
                why = no_such("quality", quality, DIRECTIONS)
                raise RequestRefused(why, RefusalCode.NOT_FOUND, field=f"{place}requirements.{quality}")
        for quality, operator in objective.operators.items():
            if operator is not DIRECTIONS[quality]:
                why = f"{operator.value} contradicts the direction of {quality}: must be {DIRECTIONS[quality].value}"
                raise RequestRefused(why, RefusalCode.INVALID, field=f"{place}operators.{quality}")
        present = self.given.get(objective.name or objective.skill)
        if present is not None and replace(present, operators=objective.operators) != objective:
            why = f"there is another objective {objective.name or objective.skill!r} already"
            raise RequestRefused(why, RefusalCode.CONFLICT, field=f"{place}name")

    def _take(self, objective: Objective) -> str:
        name = objective.name or objective.skill
        if name in self.known:
            self.log.append(f"again {name}")
            return name
        self.log.append(f"add {name}")
        self.given[name] = objective
        self.known[name] = ObjectiveStatus(
            name,
            objective.skill,
            ObjectiveState.UNGROUNDED,
            objective.task,
            priority=objective.priority,
            always_improve=objective.always_improve,
            requirements=objective.requirements,
        )
        if not self.by_hand:
            self._decide(name)
        return name

    def _decide(self, name: str) -> None:
        objective = self.given[name]
        for realization, expected in EXPECTED[objective.skill].items():
            if all(_meets(quality, expected, bound) for quality, bound in objective.requirements.items()):
                self.ground(name, realization, safety=expected["safety"])
                self._change(name, expected=expected, why=f"{realization} is the first that meets the bounds")
                return
        self.break_down(name, ObjectiveState.IN_ERROR_NFR, "no realization meets the bounds")

    def _existing(self, name: str) -> str:
        if name not in self.known:
            raise RequestRefused(no_such("objective", name, self.known), RefusalCode.NOT_FOUND, field="objective")
        return name

    def _status(self, names: list[str]) -> ObjectivesStatus:
        return ObjectivesStatus(self.kit.now(), self.context, tuple(self.known[name] for name in names), CONTEXTS)


def _meets(quality: str, expected: dict[str, float], bound: float) -> bool:
    if quality not in expected:
        return False
    if DIRECTIONS[quality] is Comparison.AT_LEAST:
        return expected[quality] >= bound
    return expected[quality] <= bound
