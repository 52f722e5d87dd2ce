"""Parts of a robot that fail and recover when they are asked to, and a director who acts in the system."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from regraft import Component, Goal, Output, Parameter, service
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.messages.management.manager import CancelAdaptation, JournalPage, JournalRequest
from regraft.bus_schema.messages.management.objectives import (
    COMPONENT_STATUS,
    CONTEXT_STATUS,
    QUALITY_STATUS,
    ContextRequest,
    ContextStatus,
    Explanation,
    ExplanationQuery,
    Objective,
    ObjectivesCancellation,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveStatus,
    ProgressReport,
)
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    CANCEL,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Change,
    EnterMode,
)
from regraft.bus_schema.model.lifecycle import State
from regraft.patience import Patience
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE

PLANNER = "metacontrol"


@message("metacontrol/Break")
@dataclass(frozen=True, slots=True)
class Break:
    """Ask a part to fail, or to report that it is well again."""

    fails: bool = True


class Part(Component):
    """A part of a robot that fails when it is asked to; ``stubborn`` keeps it from being activated."""

    speed = Parameter(0.4, "how fast it drives", minimum=0.0, maximum=1.0, unit="m/s")
    careful = Parameter(False, "whether it recovers from being stuck")
    stubborn = Parameter(False, "whether it refuses to be active")
    well: ClassVar[set[str]] = set()
    """The parts that are to report that they are well again."""

    def on_activate(self) -> None:
        if self.stubborn:
            raise RuntimeError("the motor is blocked")

    @service("parts/{name}/break")
    def break_it(self, request: Break) -> Break:
        type(self).well.discard(self.kit.name)
        self.kit.fail("broken by the director")
        return request

    def on_error(self) -> None:
        self.kit.spawn(self._look(), "looking whether all is well")

    async def _look(self) -> None:
        while self.kit.name not in type(self).well:
            await self.kit.sleep(0.05)
        self.kit.recovered()


class Director(Component):
    """Acts by a script, which a test gives to the class; afterwards it is ``done``."""

    script: ClassVar[Callable[[Director], Awaitable[None]]]
    system: ClassVar[System]
    diagnostics = Output(Diagnostic)

    def on_activate(self) -> None:
        self.done = False
        self.failure: BaseException | None = None
        self.kit.spawn(self.act(), "acting")

    async def act(self) -> None:
        try:
            await type(self).script(self)
        except BaseException as error:
            self.failure = error
            raise
        finally:
            self.done = True

    # --- what it does ---

    async def until(self, seconds: float) -> None:
        """Wait until a time."""
        await self.kit.sleep(seconds - self.kit.now())

    async def wait(self, seconds: float) -> None:
        """Let some time pass."""
        await self.kit.sleep(seconds)

    async def told(self, kind: str, *parts: str) -> list[str]:
        """Return the texts of a kind of events as soon as the test, which listens beside the system, has the parts."""
        patience = Patience(PATIENCE)
        while True:
            texts = [each.text for each in self.system.events if each.kind == kind]
            if texts and all(any(part in text for text in texts) for part in parts):
                return texts
            assert not patience.is_over(), (kind, parts, texts)
            await self.kit.sleep(0.05)

    async def adapt(self, *changes: Change, **more: Any) -> AdaptationReport:
        """Have changes carried out."""
        request = AdaptationRequest(changes, actor="director", **more)
        return await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE)

    async def withdraw(self, adaptation: str) -> AdaptationReport:
        """Cancel an adaptation."""
        return await self.kit.call(CANCEL, CancelAdaptation(adaptation), AdaptationReport, timeout=PATIENCE)

    async def add(self, *objectives: Objective, wait: bool = True) -> ObjectivesStatus:
        """Add objectives."""
        request = ObjectivesRequest(objectives, "director", wait)
        return await self.kit.call(f"planners/{PLANNER}/objectives/add", request, ObjectivesStatus, timeout=PATIENCE)

    async def cancel(self, name: str = "", task: str = "", *, wait: bool = True) -> ObjectivesStatus:
        """End objectives."""
        request = ObjectivesCancellation(name, task, "director", wait)
        place = f"planners/{PLANNER}/objectives/cancel"
        return await self.kit.call(place, request, ObjectivesStatus, timeout=PATIENCE)

    async def all(self) -> ObjectivesStatus:
        """Return the status of all objectives."""
        place = f"planners/{PLANNER}/objectives/list"
        return await self.kit.call(place, ObjectivesQuery(), ObjectivesStatus, timeout=PATIENCE)

    async def status(self, name: str) -> ObjectiveStatus:
        """Return the status of an objective."""
        place = f"planners/{PLANNER}/objectives/list"
        found = await self.kit.call(place, ObjectivesQuery(name), ObjectivesStatus, timeout=PATIENCE)
        return found.objectives[0]

    async def explain(self, name: str) -> Explanation:
        """Return the explanation of the latest decision."""
        place = f"planners/{PLANNER}/objectives/explain"
        return await self.kit.call(place, ExplanationQuery(name), Explanation, timeout=PATIENCE)

    async def set_context(self, context: str) -> ContextStatus:
        """Set the context."""
        place = f"planners/{PLANNER}/objectives/context"
        return await self.kit.call(place, ContextRequest(context), ContextStatus, timeout=PATIENCE)

    async def report_progress(self, name: str, text: str) -> ObjectiveStatus:
        """Report a skill's result."""
        place = f"planners/{PLANNER}/objectives/report"
        return await self.kit.call(place, ProgressReport(name, text), ObjectiveStatus, timeout=PATIENCE)

    def pursue(self, objective: Objective) -> Goal[ObjectiveStatus, ObjectiveStatus]:
        """Have an objective pursued as a goal."""
        return self.kit.goal(f"planners/{PLANNER}/objective", objective, ObjectiveStatus, ObjectiveStatus)

    async def break_part(self, name: str) -> None:
        """Have a part fail by itself."""
        await self.kit.call(f"parts/{name}/break", Break(), Break, timeout=PATIENCE)

    def mend(self, name: str) -> None:
        """Have a part report that it is well again."""
        Part.well.add(name)

    def report(self, quality: str, value: object, objective: str = "", at: float | None = None) -> None:
        """Report a measured quality."""
        self._diagnose(QUALITY_STATUS, {quality: value}, objective, Level.OK, at)

    def report_context(self, context: str) -> None:
        """Report the present context, as an observer does."""
        self._diagnose(CONTEXT_STATUS, {"context": context}, "", Level.OK, None)

    def report_component(self, name: str, value: object) -> None:
        """Report a component's status."""
        self._diagnose(COMPONENT_STATUS, {name: value}, "", Level.ERROR, None)

    def _diagnose(self, text: str, values: dict[str, object], subject: str, level: Level, at: float | None) -> None:
        stamp = self.kit.now() if at is None else at
        self.diagnostics.publish(Diagnostic(stamp, self.kit.name, subject, level, text, values))

    async def entered(self) -> list[list[str]]:
        """Return what the metacontroller has had done, oldest first: modes, and components of other changes."""
        page = await self.kit.call(JOURNAL, JournalRequest(limit=200), JournalPage, timeout=PATIENCE)
        return [
            [each.mode if isinstance(each, EnterMode) else each.component for each in line.request.changes]
            for line in reversed(page.entries)
            if line.request.actor == PLANNER
        ]

    def states(self) -> dict[str, State]:
        """Return the states that the components really are in."""
        return {name: each.runtime.state for name, each in self.system.running.items()}
