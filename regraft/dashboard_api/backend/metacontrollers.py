"""The metacontrollers as the gateway asks them, each by the name of its planner."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Final, TypeVar

from regraft.bus_schema.messages.management.objectives import ADD
from regraft.bus_schema.model.robots.metacontrollers import (
    NoMetacontroller,
    NoSuchMetacontroller,
    WhichMetacontroller,
    metacontroller,
)
from regraft.bus_schema.model.robots.planners import planner_service
from regraft.dashboard_api.backend.manager import Manager, Services
from regraft.dashboard_api.backend.planners import planners
from regraft.dashboard_api.http.problems import (
    NO_ANSWER,
    NOT_FOUND,
    QUEUE_FULL,
    UNAVAILABLE,
    Problem,
    malformed,
    not_found,
    unavailable,
    violation,
)

A = TypeVar("A")

MAX_WAITING: Final = 16
"""Changes of objectives that are being waited for at the same time; every one of them holds a thread."""


class Metacontrollers:
    """The requests to metacontrollers."""

    def __init__(self, services: Services, manager: Manager) -> None:
        """Ask through ``services``; ``manager`` knows which metacontrollers there are."""
        self._services = services
        self._manager = manager
        self._waiting = threading.BoundedSemaphore(MAX_WAITING)

    def known(self, robot: str = "", *, current: bool = False) -> Mapping[str, str]:
        """Return the components that are metacontrollers, all or a robot's, by planner; raises Problem.

        They may be a second old, unless they have to be ``current``.
        """
        return planners(self._manager, ADD, robot, current=current)

    def ask(self, planner: str, robot: str, verb: str, request: object, reply: type[A]) -> A:
        """Ask the metacontroller that is meant, or the only one; raises Problem."""
        return self.ask_one(self.meant(planner, robot), verb, request, reply)

    def ask_one(self, planner: str, verb: str, request: object, reply: type[A], timeout: float | None = None) -> A:
        """Ask a metacontroller by its full name; raises Problem."""
        return self._services.ask(planner_service(planner, verb), request, reply, timeout)

    def change(self, planner: str, robot: str, verb: str, request: object, reply: type[A]) -> A:
        """Have the metacontroller that is meant, or the only one, change something; raises Problem."""
        meant = self._meant_now(planner, robot)
        if not self._waiting.acquire(blocking=False):
            raise unavailable(f"{MAX_WAITING} requests are waiting for their objectives already", QUEUE_FULL)
        try:
            return self.ask_one(meant, verb, request, reply, self._services.adaptation_within)
        except Problem as problem:
            if problem.kind is NO_ANSWER:
                more = "; what was asked for may still happen: see GET /objectives"
                raise unavailable(problem.detail + more, NO_ANSWER) from None
            raise
        finally:
            self._waiting.release()

    def _meant_now(self, planner: str, robot: str) -> str:
        """Return what ``meant`` does, also of one that was just added; raises Problem."""
        try:
            return self.meant(planner, robot)
        except Problem as problem:
            if problem.kind not in (NOT_FOUND, UNAVAILABLE):
                raise
        return self.meant(planner, robot, current=True)

    def meant(self, planner: str, robot: str, *, current: bool = False) -> str:
        """Return the full name of the metacontroller that is meant, or of the only one; raises Problem."""
        try:
            return metacontroller(self.known(robot, current=current), planner)
        except NoMetacontroller as error:
            raise unavailable(str(error)) from None
        except NoSuchMetacontroller as error:
            raise not_found(str(error)) from None
        except WhichMetacontroller as error:
            raise malformed(violation("planner", str(error))) from None
