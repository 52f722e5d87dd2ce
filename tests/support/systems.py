"""A system started with the project's own command, as a user starts it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import pytest

from regraft import CallFailed, run_directory
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.client import Client
from tests.support.commands import Command
from tests.support.waiting import PATIENCE, wait_for, wait_until

ATTEMPTS = 5
ENDED = ("component.ended", "component.hung", "component.restarted", "component.quarantined")
"""The events of a component's end."""
MOST_LINES = 1000


class System(Command):
    """``regraft up`` in a process of its own, and a client of what it runs."""

    def __init__(self, stack: Path, *options: str, log: Path | None = None, **how: Any) -> None:
        """Start it, ``how`` is as for a Command."""
        super().__init__("up", str(stack), "--headless", *options, log=log or stack.parent / "up.log", **how)
        self.events: list[Event] = []
        self.info: run_directory.RunInfo
        try:
            wait_until(self._is_up, "the system to be up")
        except AssertionError:
            self.kill()
            raise
        self.info = run_directory.find("tests")
        self.client = Client.connect(self.info)
        self.client.events(self.events.append)

    def _is_up(self) -> bool:
        self.must_run()
        return bool(run_directory.running())

    def processes(self) -> dict[str, ProcessStatus]:
        """Return the host's view of its processes."""
        hosts = self.client.hosts()
        status = hosts["local"].status if "local" in hosts else None
        return {process.component: process for process in status.processes} if status else {}

    def must_have_kept_all(self) -> None:
        """Fail the test if a component has ended, also where the status does not have it yet."""
        assert not [event for event in self.events if event.kind in ENDED]
        assert {process.incarnation for process in self.processes().values()} == {1}

    def wait_for(self, name: str, right: Callable[[ProcessStatus], Any], what: str) -> ProcessStatus:
        """Wait until a component's process is as wanted, and return it as it was then."""

        def found() -> ProcessStatus | None:
            process = self.processes().get(name)
            return process if process is not None and right(process) else None

        return wait_for(found, f"{name}: {what}")

    def wait_running(self, name: str, incarnation: int = 1) -> ProcessStatus:
        """Wait until a run of a component is up."""
        return self.wait_for(
            name, lambda p: p.state is ProcessState.RUNNING and p.incarnation >= incarnation and p.pid, "running"
        )

    def ask_until_it_ends(self, name: str, ask: Callable[[], object]) -> None:
        """Ask what ends a component's run and is never answered; again if the question did not come through."""
        run = self.processes()[name]

        def over() -> bool:
            now = self.processes()[name]
            return now.incarnation != run.incarnation or now.state is not ProcessState.RUNNING

        for _ in range(ATTEMPTS):
            with contextlib.suppress(CallFailed):
                ask()
                raise AssertionError(f"{name} has answered")
            with contextlib.suppress(AssertionError):
                wait_until(over, f"the end of {name}", PATIENCE / ATTEMPTS)
                return
        raise AssertionError(f"{name} has not ended")

    def said(self, kind: str, subject: str) -> list[Event]:
        """Return the events of a kind about somebody."""
        return [event for event in self.events if event.kind == kind and event.subject == subject]

    def logged(self, kind: str, component: str) -> list[str]:
        """Return the texts of a component's events of a kind from its log: they may come before anybody listens."""
        parts = [line.partition(f" {kind}: ") for line in self.client.logs(component, MOST_LINES, PATIENCE)]
        return [text for _, found, text in parts if found]

    def end(self) -> int:
        """End it as Ctrl-C does; returns the exit code."""
        self.client.close()
        return super().end()


S = TypeVar("S", bound=System)


@contextmanager
def all_ended(end: Callable[[S], object] = System.end) -> Iterator[list[S]]:
    """Give a list of systems, each of which is ended when the block is."""
    started: list[S] = []
    try:
        yield started
    finally:
        for system in started:
            end(system)


@contextmanager
def home(folder: Path) -> Iterator[None]:
    """Have systems be found below ``folder`` in the block, and no other systems."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("REGRAFT_HOME", str(folder))
        yield
