"""A manager in whose way something is put: at a given step the component that it works on, or itself, fails.

The manager is the real one. Only the function that performs a step is preceded, or followed, by the fault.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from regraft import Parameter
from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.execution.perform import perform
from regraft.adaptation_manager.manager import AdaptationManager
from regraft.adaptation_manager.targets.context import ExecutionContext
from tests.failures.parts import LATE
from tests.support.machine.processes import go_on, kill, stop

SOON = 0.002
PLAN = "fault.json"
HOST_PID = "edge.pid"
"""The file with the process of the second host."""


@dataclass(frozen=True, slots=True)
class Fault:
    """What goes wrong at the ``step``-th step (from 1).

    ``how`` is die, hang, late or refuse; ``who`` the component that the step concerns, the manager itself, or the
    second host (``host``); ``when`` before, during or after the step, or ``inside``: when ``method`` of the
    component's class is called.
    """

    step: int
    when: str
    how: str
    who: str = "component"
    method: str = "any"

    def __str__(self) -> str:
        where = f" {self.method}" if self.when == "inside" else ""
        return f"step {self.step}, {self.when}{where}: {self.who} {self.how}"

    def prepare(self, folder: Path) -> None:
        """Have it happen in the next adaptation."""
        plan = folder / PLAN
        plan.with_suffix(".new").write_text(json.dumps(asdict(self)))
        plan.with_suffix(".new").rename(plan)

    def withdraw(self, folder: Path) -> bool:
        """Have it happen no more; returns whether it has, or is about to."""
        try:
            (folder / PLAN).unlink()
        except FileNotFoundError:
            return True
        return False

    @property
    def kills_host(self) -> bool:
        return (self.who, self.how) == ("host", "die")


class FaultyManager(AdaptationManager):
    """Carries out adaptations as the manager does, but for one fault."""

    fault = Parameter("", "the file that says what shall go wrong", unit="path", read_only=True)

    def on_activate(self) -> None:
        _injector.path = Path(self.fault)
        super().on_activate()


class _Injector:
    def __init__(self, perform: Callable[..., Any]) -> None:
        self.path = Path("/nonexistent")
        self._perform = perform
        self._steps = 0

    async def perform(self, site: ExecutionContext, action: Any, *more: Any) -> None:
        fault = self._due()
        if fault is None:
            await self._perform(site, action, *more)
            return
        if fault.when != "after":
            self._strike(site, action.component, fault)
        await self._perform(site, action, *more)
        if fault.when == "after":
            self._strike(site, action.component, fault)

    def _due(self) -> Fault | None:
        """Return the fault if this is its step; it happens once."""
        try:
            fault = Fault(**json.loads(self.path.read_text()))
        except OSError:
            self._steps = 0
            return None
        self._steps += 1
        if self._steps < fault.step:
            return None
        self._steps = 0
        self.path.unlink()
        return fault

    def _strike(self, site: ExecutionContext, component: str, fault: Fault) -> None:
        if fault.when == "inside":
            flags = self.path.parent / "flags"
            flags.mkdir(exist_ok=True)
            (flags / component).write_text(f"{fault.how} in {fault.method}")
            return
        pid = self._pid_of(site, component, fault.who)
        if fault.when == "during":
            threading.Timer(SOON, _hit, (pid, fault.how)).start()
        else:
            _hit(pid, fault.how)

    def _pid_of(self, site: ExecutionContext, component: str, who: str) -> int:
        if who == "component":
            process = site.controls.living(component)
            return process.pid if process is not None else 0
        return os.getpid() if who == "manager" else int((self.path.parent / HOST_PID).read_text())


def _hit(pid: int, how: str) -> None:
    if pid <= 1:
        return
    try:
        if how == "die":
            kill(pid)
            return
        stop(pid)
        if how == "late":
            threading.Timer(LATE, go_on, (pid,)).start()
    except ProcessLookupError:
        pass


_injector = _Injector(perform)
setattr(transaction, "perform", _injector.perform)  # noqa: B010  (a name that the module has imported itself)
