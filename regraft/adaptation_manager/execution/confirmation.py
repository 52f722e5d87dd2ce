"""Watches an adaptation that is to be confirmed: the components that it touches, and named quality requirements.

All of it is asked for at moments that the manager chooses: under simulated time it is the same in every run.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from regraft import Future
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
from regraft.patience import stretched

REQUIREMENT_NAME = re.compile(r"[A-Za-z0-9_.-]{1,200}")


@dataclass(slots=True)
class Watch:
    """Reports whether all is still well.

    ``named`` are the components that the request names, whether there is anything to do to them or not. ``runs`` are
    the incarnations of those that are watched, ``faults`` how many errors each had reported before. ``owed`` are the
    requirements that were broken before and have not been met since: they have until the end. ``failed`` are the
    components that had failed before.
    """

    context: ExecutionContext
    plan: Plan
    requirements: tuple[str, ...]
    named: frozenset[str] = frozenset()
    runs: dict[str, int] = field(default_factory=dict)
    faults: dict[tuple[str, int], int] = field(default_factory=dict)
    owed: set[str] = field(default_factory=set)
    failed: set[str] = field(default_factory=set)

    @property
    def components(self) -> list[str]:
        """The components that are watched: those that are named or touched, and that are there afterwards."""
        before, after = self.plan.before.components, self.plan.after.components
        changed = {name for name, spec in after.items() if before.get(name) != spec}
        touched = {step.component for step in self.plan.steps}
        return sorted(changed | ((self.named | touched) & after.keys()))

    async def begin(self) -> list[Violation]:
        """Note how things are before anything is done; returns the requirements that nobody tells of."""
        if self.requirements:
            await self.context.refresh()
        found = []
        for index, (name, quality) in enumerate(await self._qualities()):
            if quality is None:
                problem = (
                    f"no report of a quality requirement {name!r}: it is known from when its task is first run; "
                    "'regraft mission show' lists those of the mission"
                )
                found.append(Violation(None, "", f"watch.{index}", problem))
            elif _is_broken(quality):
                self.owed.add(name)
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

    def start(self) -> None:
        """Watch the runs that were found when the adaptation was verified."""
        living = {name: self.context.controls.living(name) for name in self.components}
        self.runs = {name: process.incarnation for name, process in living.items() if process is not None}

    async def look(self, last: bool) -> str:
        """Return what is not well any more, empty if all is; ``last`` if it will not be looked at again."""
        try:
            await self.context.refresh()
        except ControlFailed as error:
            return str(error)
        problems = [await self._problem(name) for name in self.components]
        problems += [self._missed(name, quality, last) for name, quality in await self._qualities()]
        return "; ".join(filter(None, problems))

    async def _problem(self, name: str) -> str:
        spec = self.plan.after.components[name]
        if spec.state is not State.ACTIVE and self._is_left_alone(name):
            return ""
        process = self.context.controls.processes.get(name)
        if self.context.controls.living(name) is None or process is None:
            return f"{name} has ended: {process.exit_reason if process else 'it has no process'}"
        run = process.incarnation
        if self.runs.get(name) != run:
            return f"{name} was restarted: {process.exit_reason or 'nobody knows why'}"
        if not spec.managed:
            return ""
        try:
            view = await self.context.controls.read(name).view()
        except NoAnswer as error:
            return f"{name} is gone" if error.gone else str(error)
        except ControlFailed as error:
            return str(error)
        if view.state is not spec.state:
            return f"{name} is {view.state.value}, should be {spec.state.value}"
        if view.faults > self.faults.get((name, run), 0):
            return f"{name} reported an error: {view.error}"
        return ""

    def _is_left_alone(self, name: str) -> bool:
        """Return whether a component had failed before, or failed as it was to do less."""
        return name in self.failed or name in self.context.tolerated or name not in self.runs

    async def _qualities(self) -> list[tuple[str, Quality | None]]:
        """Return the latest of every requirement, None for one that nobody tells of."""
        asked = [(name, self._ask(name)) for name in self.requirements]
        return [(name, _quality(await waiting) if waiting is not None else None) for name, waiting in asked]

    def _ask(self, requirement: str) -> Future[list[Answer]] | None:
        if not REQUIREMENT_NAME.fullmatch(requirement):
            return None
        key = Keys(self.context.kit.system).quality(requirement)
        try:
            return self.context.kit.ask(key, b"", stretched(self.context.bounds.answer))
        except BusError:
            return None

    def _missed(self, name: str, quality: Quality | None, last: bool) -> str:
        if quality is None:
            return f"the quality requirement {name} is not reported any more"
        if not _is_broken(quality):
            self.owed.discard(name)
            return ""
        if name in self.owed:
            return f"the quality requirement {name} was broken before, and still is" if last else ""
        metric = "" if quality.metric is None else f": its metric is {quality.metric:g}"
        return f"the quality requirement {name} broke{metric}"


def _is_broken(quality: Quality) -> bool:
    """Return whether a requirement is known not to be met; what was measured when its task last ran is no news."""
    return quality.active and quality.satisfied is False


def _quality(answers: Sequence[Answer]) -> Quality | None:
    for answer in answers:
        if not answer.error:
            try:
                return codec.decode(answer.payload, Quality)
            except BadMessage:
                continue
    return None
