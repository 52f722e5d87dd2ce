"""Test equipment: a system with modes in this process, in step, and a director who acts in it at given times."""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

from regraft import Component
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.management.modes import (
    DECIDER,
    MODES,
    DeciderRequest,
    DeciderStatus,
    ModesRequest,
    PartModes,
    RuleStatus,
    SystemModes,
)
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Change,
    EnterMode,
    Outcome,
)
from regraft.stack import load
from tests.adaptation.host_stub import HostStub
from tests.adaptation.system import System
from tests.modes.stacks import write
from tests.support.waiting import PATIENCE, wait_until

STACK = """\
system: t
clock: simulated
imports: [tests.modes.parts]
topics:
  ticks: {type: modes/Sample}
  scans: {type: modes/Sample}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  world: {class: 'tests.modes.parts:World', parameters: {speed: max}}
  laser: {class: 'tests.modes.parts:Laser', parameters: {failures: 0}}
  driver: {class: 'tests.modes.parts:Driver'}
  lamp: {class: 'tests.modes.parts:Lamp', state: inactive}
  director: {class: 'tests.modes.in_memory:Director'}
  mode_planner: {class: 'regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: journal.sqlite}
"""
MANAGER = "adaptation_manager"
PLANNER = "mode_planner"
ORDER = (MANAGER, "laser", "driver", "lamp", PLANNER, "director", "world")


class Director(Component):
    """Acts by a script, which a test gives to the class; afterwards it is ``done``."""

    script: ClassVar[Callable[[Director], Awaitable[None]]]
    system: ClassVar[System]

    def on_activate(self) -> None:
        """Begin to act."""
        self.done = False
        self.restarted = ""
        self.failure: BaseException | None = None
        self.kit.spawn(self.act(), "acting")

    async def act(self) -> None:
        """Act by the script."""
        try:
            await type(self).script(self)
        except BaseException as error:
            self.failure = error
            raise
        finally:
            self.done = True

    async def until(self, seconds: float) -> None:
        """Wait until a time."""
        await self.kit.sleep(seconds - self.kit.now())

    async def ask(self, *changes: Change) -> AdaptationReport:
        """Ask for changes."""
        request = AdaptationRequest(changes, actor="director")
        return await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE)

    async def adapt(self, *changes: Change) -> AdaptationReport:
        """Have changes carried out."""
        report = await self.ask(*changes)
        assert report.outcome is Outcome.APPLIED, report
        return report

    def kill(self, name: str) -> None:
        """Kill a component."""
        self.system.running[name].kill()
        self.system.host.ended(name)

    def strike(self, name: str) -> None:
        """Have a component die as soon as its present handler returns; then its next run starts, as by a host.

        Time stands until it has: the director, who is waited for in each step, does nothing meanwhile.
        """
        struck = self.system.running[name]
        has_started = threading.Event()
        struck.runtime.post(_die)
        self.system.running["director"].runtime.post(lambda: has_started.wait(PATIENCE))

        def restart() -> None:
            struck.join()
            self.system.host.ended(name, ProcessState.WAITING)
            self.start(name)
            self.restarted = name
            has_started.set()

        threading.Thread(target=restart, daemon=True).start()

    def start(self, name: str) -> None:
        """Start the next run of a component, without a checkpoint."""
        self.system.start(name, self.system.running[name].runtime.assignment.incarnation + 1)

    async def modes(self, part: str = "") -> PartModes:
        """Return the modes of a part."""
        found = (await self.kit.call(MODES, ModesRequest(), SystemModes, timeout=PATIENCE)).part(part)
        assert found is not None
        return found

    async def entered(self) -> list[tuple[str, str]]:
        """Return the modes that the planner has entered by now, with the outcomes."""
        return _entered(await self.kit.call(JOURNAL, JournalRequest(limit=200), JournalPage, timeout=PATIENCE))

    async def rule(self, name: str) -> RuleStatus:
        """Return how a rule is."""
        status = await self.kit.call(DECIDER, DeciderRequest(), DeciderStatus, timeout=PATIENCE)
        return next(rule for rule in status.rules if rule.rule == name)

    def tell(self, requirement: str, satisfied: bool | None, **more: Any) -> None:
        """Report how a requirement is met."""
        self.kit.report_quality(Quality(self.kit.now(), requirement, "drive", satisfied=satisfied, **more))


def _die() -> None:
    raise SystemExit


@contextmanager
def running(folder: Path, text: str, script: Callable[[Director], Awaitable[None]]) -> Iterator[System]:
    """Run a stack whose director acts by a script."""
    Director.script = staticmethod(script)
    architecture = load(write(folder, text)).architecture
    hub = MemoryHub()
    system = Director.system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    try:
        for name in ORDER:
            system.start(name)
        yield system
    finally:
        system.end()


def perform(system: System) -> None:
    """Wait until the director has acted by the script; raises what went wrong in it."""
    director = system.running["director"].component
    wait_until(lambda: getattr(director, "done", False), "the end of the script")
    if director.failure is not None:
        raise director.failure


def entered(system: System) -> list[tuple[str, str]]:
    """Return the modes that the planner entered, oldest first, with the outcomes."""
    return _entered(system.lines(limit=200))


def _entered(page: JournalPage) -> list[tuple[str, str]]:
    return [
        (change.mode, line.outcome.value)
        for line in reversed(page.entries)
        if line.request.actor == PLANNER
        for change in line.request.changes
        if isinstance(change, EnterMode)
    ]
