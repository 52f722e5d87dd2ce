"""Watches an adaptation that is to be confirmed: the components that it touches, and the conditions that it names.

All of it is asked for at moments that the manager chooses: under simulated time it is the same in every run.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from regraft import Future
from regraft.adaptation_manager.execution.conditions import Readings, Verdict
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus.interface import Answer, BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.lifecycle import State, is_lower
from regraft.bus_schema.model.watched import Breach, BreachCode, Condition
from regraft.patience import stretched

NEARLY = 1e-6
"""Seconds by which times may differ that are meant to be equal."""
REQUIREMENT_NAME = re.compile(r"[A-Za-z0-9_.-]{1,200}")


@dataclass(slots=True)
class Watch:
    """Reports whether all is still well.

    ``named`` are the components that the request names, whether there is anything to do to them or not. ``runs`` are
    the incarnations of those that are watched, ``faults`` how many errors each had reported before. ``failed`` are the
    components that had failed before. Of the ``conditions``, ``owed`` are those that were broken before and have not
    been met since: they have until the end. ``unknown`` has since when others are unknown, ``known`` are those that
    have been known since the beginning.
    """

    context: ExecutionContext
    plan: Plan
    conditions: tuple[Condition, ...]
    named: frozenset[str] = frozenset()
    runs: dict[str, int] = field(default_factory=dict)
    faults: dict[tuple[str, int], int] = field(default_factory=dict)
    failed: set[str] = field(default_factory=set)
    owed: set[int] = field(default_factory=set)
    unknown: dict[int, float] = field(default_factory=dict)
    known: set[int] = field(default_factory=set)
    readings: Readings = field(init=False)

    def __post_init__(self) -> None:
        self.readings = Readings(self.context)

    @property
    def components(self) -> list[str]:
        """The components that are watched: those that are named or touched, and that are there afterwards."""
        before, after = self.plan.before.components, self.plan.after.components
        changed = {name for name, spec in after.items() if before.get(name) != spec}
        touched = {step.component for step in self.plan.steps}
        return sorted(changed | ((self.named | touched) & after.keys()))

    async def begin(self) -> list[Violation]:
        """Note how things are before anything is done; returns the requirements that nobody reports."""
        if self.conditions:
            await self.context.refresh()
            await self.readings.read(self.conditions)
        found = []
        for index, verdict in enumerate(await self._verdicts()):
            if verdict.code is BreachCode.REQUIREMENT_NOT_REPORTED:
                name = self.conditions[index].requirement
                problem = (
                    f"no report of a quality requirement {name!r}: it is known from when its task is first run; "
                    "'regraft mission show' lists those of the mission"
                )
                found.append(Violation(None, "", f"watch.{index}", problem))
            elif verdict.holds is False:
                self.owed.add(index)
        for name in self.components:
            spec = self.plan.before.components.get(name)
            if spec is None or not spec.managed or self.context.controls.living(name) is None:
                continue
            try:
                view = await self.context.controls.read(name).view()
            except ControlFailed:
                continue
            self.faults[name, view.incarnation] = view.faults
            if is_lower(view.state, spec.state):
                self.failed.add(name)
        return found

    async def start(self) -> None:
        """Watch the runs that were found when the adaptation was verified; only what they measure later counts."""
        living = {name: self.context.controls.living(name) for name in self.components}
        self.runs = {name: process.incarnation for name, process in living.items() if process is not None}
        await self.readings.read(self.conditions, old=True)

    async def look(self, last: bool) -> list[Breach]:
        """Return what is not well any more; ``last`` if it will not be looked at again. Raises ControlFailed."""
        await self.context.refresh()
        broken = [found for name in self.components if (found := await self._problem(name))]
        await self.readings.read(self.conditions)
        for index, verdict in enumerate(await self._verdicts()):
            text = self._broken(index, verdict, last)
            if text:
                broken.append(self._breach(verdict, text, index))
        return [replace(each, at=self.context.kit.now()) for each in broken]

    def _broken(self, index: int, verdict: Verdict, last: bool) -> str:
        """Return why a condition counts as broken now, empty if it does not."""
        condition, now = self.conditions[index], self.context.kit.now()
        if verdict.holds is None:
            if condition.requirement:
                return ""
            since = self.unknown.setdefault(index, now)
            never = last and (index not in self.known or index in self.owed)
            over = now - since >= condition.patience - NEARLY
            after = f", after {now - since:g} s" if now > since else ""
            return f"{verdict.text}{after}" if over or never else ""
        self.unknown.pop(index, None)
        self.known.add(index)
        if verdict.holds:
            self.owed.discard(index)
            return ""
        if index not in self.owed:
            return verdict.text
        what = f"the quality requirement {condition.requirement}" if condition.requirement else verdict.text
        return f"{what}{'' if condition.requirement else ';'} was broken before, and still is" if last else ""

    def _breach(self, verdict: Verdict, text: str, index: int) -> Breach:
        condition = self.conditions[index]
        subject = condition.requirement or condition.quality or condition.require
        return Breach(verdict.code, text, verdict.component, index, subject, verdict.value, condition.wanted)

    async def _problem(self, name: str) -> Breach | None:
        spec = self.plan.after.components[name]
        if spec.state is not State.ACTIVE and self._is_left_alone(name):
            return None
        process = self.context.controls.processes.get(name)
        if self.context.controls.living(name) is None or process is None:
            why = process.exit_reason if process else "it has no process"
            return Breach(BreachCode.ENDED, f"{name} has ended: {why}", name)
        run = process.incarnation
        if self.runs.get(name) != run:
            why = process.exit_reason or "nobody knows why"
            return Breach(BreachCode.RESTARTED, f"{name} was restarted: {why}", name)
        if not spec.managed:
            return None
        try:
            view = await self.context.controls.read(name).view()
        except ControlFailed as error:
            gone = isinstance(error, NoAnswer) and error.gone
            return Breach(BreachCode.NO_ANSWER, f"{name} is gone" if gone else str(error), name)
        if view.state is not spec.state:
            text = f"{name} is {view.state.value}, should be {spec.state.value}"
            return Breach(BreachCode.WRONG_STATE, text, name, wanted=spec.state.value)
        if view.faults > self.faults.get((name, run), 0):
            return Breach(BreachCode.ERROR_REPORTED, f"{name} reported an error: {view.error}", name)
        return None

    def _is_left_alone(self, name: str) -> bool:
        """Return whether a component had failed before, or failed as it was to do less."""
        return name in self.failed or name in self.context.tolerated or name not in self.runs

    async def _verdicts(self) -> list[Verdict]:
        """Return how each condition is met."""
        asked = {each.requirement: self._ask(each.requirement) for each in self.conditions if each.requirement}
        told = {name: None if waiting is None else _quality(await waiting) for name, waiting in asked.items()}
        return [
            _of_requirement(each.requirement, told[each.requirement]) if each.requirement else self.readings.judge(each)
            for each in self.conditions
        ]

    def _ask(self, requirement: str) -> Future[list[Answer]] | None:
        if not REQUIREMENT_NAME.fullmatch(requirement):
            return None
        key = Keys(self.context.kit.system).quality(requirement)
        try:
            return self.context.kit.ask(key, b"", stretched(self.context.bounds.answer))
        except BusError:
            return None


def _of_requirement(name: str, quality: Quality | None) -> Verdict:
    """Return whether a requirement is met, None without news: its task does not run, or it is not known."""
    if quality is None:
        text = f"the quality requirement {name} is not reported any more"
        return Verdict(False, BreachCode.REQUIREMENT_NOT_REPORTED, text)
    metric = "" if quality.metric is None else f": its metric is {quality.metric:g}"
    text = f"the quality requirement {name} broke{metric}"
    holds = quality.satisfied if quality.active else None
    return Verdict(holds, BreachCode.REQUIREMENT_BROKEN, text, value=quality.metric)


def _quality(answers: Sequence[Answer]) -> Quality | None:
    for answer in answers:
        if not answer.error:
            try:
                return codec.decode(answer.payload, Quality)
            except BadMessage:
                continue
    return None
