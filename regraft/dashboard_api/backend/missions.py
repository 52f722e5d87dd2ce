"""The executors of missions as the gateway asks them, each by the name of its robot."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import TypeVar

from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.robots.executors import (
    MissionExecutor,
    NoSuchExecutor,
    WhichExecutor,
    executor_of,
    executors,
)
from regraft.client import ClientError
from regraft.dashboard_api.backend.manager import BACK_OFF, FRESH_FOR, HOST_TIMEOUT, Services
from regraft.dashboard_api.http.problems import NO_ANSWER, malformed, not_found, unavailable, violation

A = TypeVar("A")


class Missions:
    """The executors of the system; which there are is asked of the first host, which answers also under way."""

    def __init__(self, services: Services) -> None:
        """Ask through ``services``."""
        self._services = services
        self.client = services.client
        self._reading = threading.Lock()
        self._known: tuple[MissionExecutor, ...] = ()
        self._is_silent = False
        self._read_again_at = 0.0

    def ask(self, robot: str, service: str, request: object, expected: type[A]) -> A:
        """Ask the executor of a robot, or the only one; raises Problem."""
        return self._services.ask(self.executor(robot).service(service), request, expected)

    def executor(self, robot: str) -> MissionExecutor:
        """Return the executor of a robot, or the only one; raises Problem.

        While the first host is silent, nobody knows which robots there are.
        """
        try:
            return self._found(robot) or MissionExecutor()
        except NoSuchExecutor as error:
            if self._is_silent:
                raise unavailable("the first host, which knows the robots, does not answer", NO_ANSWER) from None
            raise not_found(str(error)) from None
        except WhichExecutor as error:
            raise malformed(violation("robot", str(error))) from None

    def _found(self, robot: str) -> MissionExecutor | None:
        """Return the executor of a robot, or the only one, None without any; raises NoSuchExecutor, WhichExecutor.

        The known ones may be a second old: one that was just added is looked for before there is none.
        """
        with contextlib.suppress(NoSuchExecutor):
            if (found := executor_of(self._executors(), robot)) is not None:
                return found
        return executor_of(self._executors(current=True), robot)

    def _executors(self, *, current: bool = False) -> tuple[MissionExecutor, ...]:
        with self._reading:
            if current or time.monotonic() >= self._read_again_at:
                try:
                    known = self.client.host_view(LOCAL, HOST_TIMEOUT).architecture
                    self._known, self._is_silent = executors(known.components, known.scopes), False
                except ClientError:
                    self._is_silent = True
                self._read_again_at = time.monotonic() + (BACK_OFF if self._is_silent else FRESH_FOR)
            return self._known
