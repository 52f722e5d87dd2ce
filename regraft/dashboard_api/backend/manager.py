"""The adaptation manager as the gateway asks it: its refusals and time-outs become problems."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

from regraft import CallFailed
from regraft.bus.interface import BusError
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    CancelAdaptation,
    ConfirmAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, SystemModes
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.client import Client, ClientError
from regraft.dashboard_api.backend.refusal_statuses import problem_of
from regraft.dashboard_api.http.problems import (
    CONFLICT,
    NO_ANSWER,
    Problem,
    malformed,
    not_found,
    throttled,
    told,
    unavailable,
)

A = TypeVar("A")

MAX_WAITING = 16
"""Adaptations whose outcome is being waited for at the same time; every one of them holds a thread."""
MAX_ENDING = 16
"""Cancellations and confirmations that are waited for at the same time: places of their own, as they end the others."""
COME_INTERVAL = 1.0
"""Seconds after which who finds too many waiting may try again."""
FRESH_FOR = 1.0
"""Seconds for which an architecture that was read serves overviews."""
HOST_TIMEOUT = 1.0
"""Seconds that the first host may take to list the components."""
OVERVIEW_TIMEOUT = 1.0
"""Seconds that an overview waits for the manager; it can do without."""
BACK_OFF = 5.0
"""Seconds before overviews ask again a manager that stayed silent."""


class Services:
    """Services of the system, with bounded waits."""

    def __init__(self, client: Client, answer_within: float, adaptation_within: float) -> None:
        """Wait ``answer_within`` seconds for an answer, ``adaptation_within`` for an adaptation's outcome."""
        self.client = client
        self.answer_within = answer_within
        self.adaptation_within = adaptation_within

    def ask(self, service: str, request: object, expected: type[A], timeout: float | None = None) -> A:
        """Ask a service.

        Raises:
            Problem: no component offers it, it refused, failed or stayed silent, or the request cannot travel.
        """
        if self._is_offered_by_nobody(service):
            raise unavailable(f"no component of the system offers the service {service!r}")
        patience = self.answer_within if timeout is None else timeout
        try:
            return self.client.call(service, request, expected, patience)
        except CallFailed as error:
            raise problem_of(error) from None
        except BadMessage as error:
            raise malformed(told(error)) from None

    def _is_offered_by_nobody(self, service: str) -> bool:
        """Return whether no component offers the service now, and none is there that may offer it again."""
        try:
            return not self.client.reaches(service) and service not in self._offered()
        except (BusError, ClientError):
            return False

    def _offered(self) -> set[str]:
        """Return the services of all components, as the first host knows them; raises ClientError."""
        components = self.client.host_view(LOCAL, HOST_TIMEOUT).architecture.components.values()
        return {name for spec in components for name in offered_services(spec).values()}


class Manager:
    """The requests to the adaptation manager."""

    def __init__(self, services: Services) -> None:
        """Ask through ``services``."""
        self._services = services
        self._waiting = threading.BoundedSemaphore(MAX_WAITING)
        self._ending = threading.BoundedSemaphore(MAX_ENDING)
        self._reading = threading.Lock()
        self._last_read: Architecture | None = None
        self._is_silent = False
        self._read_again_at = 0.0

    def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Have an adaptation carried out; raises Problem."""
        return self._act("adaptation_manager/adapt", request, request.confirm)

    def undo(self, request: UndoAdaptation) -> AdaptationReport:
        """Have an applied adaptation undone; raises Problem."""
        with _showing(self.entry(request.id)):
            return self._act("adaptation_manager/undo", request, request.confirm)

    def cancel(self, adaptation: str) -> AdaptationReport:
        """Have an adaptation cancelled; raises Problem."""
        with _showing(self.entry(adaptation)):
            return self._end("adaptation_manager/cancel", CancelAdaptation(adaptation))

    def confirm(self, adaptation: str) -> AdaptationReport:
        """Have an adaptation that is being confirmed made final; raises Problem."""
        with _showing(self.entry(adaptation)):
            return self._end("adaptation_manager/confirm", ConfirmAdaptation(adaptation))

    def _act(self, service: str, request: object, longer: float) -> AdaptationReport:
        why = f"{MAX_WAITING} requests are waiting for the outcome of their adaptations already"
        with _place(self._waiting, why):
            return self._ask(service, request, longer)

    def _end(self, service: str, request: object) -> AdaptationReport:
        with _place(self._ending, f"{MAX_ENDING} requests are waiting for the end of adaptations already"):
            return self._ask(service, request)

    def _ask(self, service: str, request: object, longer: float = 0.0) -> AdaptationReport:
        try:
            within = self._services.adaptation_within + longer
            return self._services.ask(service, request, AdaptationReport, within)
        except Problem as problem:
            if problem.kind is NO_ANSWER:
                what = f"{problem.detail}; what was asked for may still happen: see GET /adaptations"
                raise unavailable(what, NO_ANSWER) from None
            raise
        finally:
            self._read_again_at = 0.0

    def journal(self, request: JournalRequest) -> JournalPage:
        """Return a page of the journal; raises Problem."""
        return self._services.ask("adaptation_manager/journal", request, JournalPage)

    def entry(self, adaptation: str) -> AdaptationReport:
        """Return one line of the journal; raises Problem."""
        page = self.journal(JournalRequest(id=adaptation))
        if not page.entries:
            raise not_found(f"there is no adaptation {adaptation!r} in the journal")
        return page.entries[0]

    def architecture(self, revision: int | None = None, within: float | None = None) -> Architecture:
        """Return the architecture, now or at a revision; raises Problem."""
        request = ArchitectureRequest(revision)
        read = self._services.ask("adaptation_manager/architecture", request, Architecture, within)
        if revision is None:
            self._last_read, self._read_again_at, self._is_silent = read, time.monotonic() + FRESH_FOR, False
        return read

    def modes(self, *, reachable: bool) -> SystemModes:
        """Return the modes of all parts, and which could be entered now if that is asked; raises Problem."""
        return self._services.ask(MODES, ModesRequest(reachable), SystemModes)

    def last_architecture(self) -> Architecture | None:
        """Return an architecture that may be a second old, older while the manager is silent; None without one.

        Overviews use it: under simulated time every question to the manager costs the system a pause.
        """
        with self._reading:
            if time.monotonic() >= self._read_again_at:
                try:
                    self.architecture(within=OVERVIEW_TIMEOUT)
                except Problem:
                    self._read_again_at, self._is_silent = time.monotonic() + BACK_OFF, True
            return self._last_read

    @property
    def is_silent(self) -> bool:
        """Whether ``last_architecture`` has not been read again, though it was due."""
        return self._is_silent


@contextmanager
def _place(places: threading.BoundedSemaphore, why_full: str) -> Iterator[None]:
    """Hold one of the places meanwhile; raises Problem if none is free."""
    if not places.acquire(blocking=False):
        raise throttled(why_full, COME_INTERVAL)
    try:
        yield
    finally:
        places.release()


@contextmanager
def _showing(entry: AdaptationReport) -> Iterator[None]:
    """Show an adaptation as it is in the problem that it is in the wrong state for something."""
    try:
        yield
    except Problem as problem:
        if problem.kind is CONFLICT:
            raise Problem(CONFLICT, problem.detail, problem.violations, report=entry) from None
        raise
