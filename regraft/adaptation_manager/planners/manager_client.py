"""How a planner has its changes carried out: by the adaptation manager, within bounds, on what it has just seen."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Self

from regraft import CallFailed, Future, Kit, RefusalCode, RequestRefused
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    ArchitectureTag,
    ArchitectureTagRequest,
)
from regraft.bus_schema.messages.planning import ProposalRequest
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    ARCHITECTURE,
    ARCHITECTURE_TAG,
    MAX_CONTEXT_SIZE,
    AdaptationReport,
    AdaptationRequest,
    Change,
    Outcome,
    plain_size,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.robots.scopes import SHARED

ATTEMPTS: Final = 3
"""How often an adaptation is worked out when somebody else was faster each time."""
SHORTEST: Final = 0.001
"""Seconds for the second of two questions where the first took nearly all the time."""
MAX_WAITING: Final = 16
UNCHANGED: Final = "unchanged"
"""The outcome of a plan that asks for nothing."""
NO_ANSWER: Final = "no_answer"
"""The outcome of a plan that was given up: what was asked for may still wait for its turn."""
MAX_ACTOR_LENGTH: Final = 200
MAX_REASON_LENGTH: Final = 1000


@dataclass(frozen=True, slots=True)
class AdaptationOrder:
    """On whose behalf an adaptation is asked for, why, and what was so; texts that are too long are cut."""

    actor: str
    reason: str
    context: dict[str, PlainValue] = field(default_factory=dict)

    @classmethod
    def of(cls, planner: str, request: ProposalRequest, why: str) -> Self:
        """Return the order of a planner's component that was asked for a proposal."""
        actor = f"{request.actor}, by {planner}" if request.actor else planner
        return cls(actor, f"{request.reason}; {why}" if request.reason else why, request.context)

    def request(self, changes: tuple[Change, ...], revision: int) -> AdaptationRequest:
        """Return the request; a context that is too large is left out."""
        context = self.context if plain_size(self.context, MAX_CONTEXT_SIZE) <= MAX_CONTEXT_SIZE else {}
        who, reason = self.actor[:MAX_ACTOR_LENGTH], self.reason[:MAX_REASON_LENGTH]
        return AdaptationRequest(changes, reason, who, revision, context=context)


@dataclass(frozen=True, slots=True)
class CarriedOut:
    """The result of a plan. ``outcome`` is the report's, or ``unchanged``, ``refused`` or ``no_answer``."""

    changes: tuple[Change, ...]
    outcome: str
    report: AdaptationReport | None = None
    error: str = ""

    @property
    def stands(self) -> bool:
        """Whether what was planned is so now."""
        return self.outcome in (UNCHANGED, Outcome.APPLIED.value, Outcome.APPLIED_STATE_LOST.value)

    @property
    def problem(self) -> str:
        """Why it has not come about, for people."""
        if self.report is None:
            return self.error or self.outcome
        found = "; ".join(map(str, self.report.violations))
        return found or self.report.error or self.report.outcome.value

    @property
    def disturbed(self) -> bool:
        """Whether something other than before may be in force, or was for a while."""
        return self.outcome not in (UNCHANGED, "refused", Outcome.REJECTED.value)


class Manager:
    """The adaptation manager, as a planner asks it."""

    def __init__(self, kit: Kit) -> None:
        self._kit = kit
        self._known: Architecture | None = None
        self._known_as = ""

    async def architecture(self, within: float) -> Architecture:
        """Return what should be now; raises RequestRefused if it is not to be had within so many seconds.

        It is read again only when its tag is another. One that changes between both questions is kept under the older
        tag, so that the next question reads it again.
        """
        call, until = self._kit.call, self._kit.now() + within
        try:
            told = await call(SHARED + ARCHITECTURE_TAG, ArchitectureTagRequest(), ArchitectureTag, timeout=within)
            if self._known is not None and told.tag == self._known_as:
                return self._known
            left = max(until - self._kit.now(), SHORTEST)
            found = await call(SHARED + ARCHITECTURE, ArchitectureRequest(), Architecture, timeout=left)
        except CallFailed as error:
            why = f"the adaptation manager cannot be asked: {error}"
            raise RequestRefused(why, RefusalCode.UNAVAILABLE) from None
        self._known, self._known_as = found, told.tag
        return found

    async def carry_out(
        self,
        plan: Callable[[Architecture], tuple[Change, ...]],
        seen: Architecture,
        order: AdaptationOrder,
        within: float,
    ) -> CarriedOut:
        """Have what ``plan`` returns for an architecture carried out, unless there is nothing to do.

        A plan for an architecture that is no longer current is made again.
        """
        for attempt in range(ATTEMPTS):
            changes = plan(seen)
            if not changes:
                break
            try:
                request = order.request(changes, seen.revision)
                report = await self._kit.call(SHARED + ADAPT, request, AdaptationReport, timeout=within)
            except CallFailed as error:
                refused = error.answer is Answer.REFUSED
                return CarriedOut(changes, "refused" if refused else NO_ANSWER, error=str(error))
            if attempt == ATTEMPTS - 1 or not is_stale(report):
                return CarriedOut(changes, report.outcome.value, report)
            try:
                seen = await self.architecture(within)
            except RequestRefused:
                return CarriedOut(changes, report.outcome.value, report)
        return CarriedOut((), UNCHANGED)


def is_stale(report: AdaptationReport) -> bool:
    """Return whether an adaptation was refused because the architecture is not the one that it was worked out for."""
    fields = {(violation.component, violation.field) for violation in report.violations}
    return report.outcome is Outcome.REJECTED and fields == {("", "revision")}


class Turns:
    """One at a time for each name, in the order of asking: ``await take(name)``, and ``give(name)`` at the end."""

    def __init__(self) -> None:
        self._waiting: dict[str, deque[Future[None]]] = {}

    async def take(self, name: str) -> None:
        """Wait for one's turn; raises RequestRefused if too many wait."""
        line = self._waiting.get(name)
        if line is None:
            self._waiting[name] = deque()
            return
        if len(line) >= MAX_WAITING:
            why = f"the queue is full: {MAX_WAITING} proposals for {name!r} wait already"
            raise RequestRefused(why, RefusalCode.QUEUE_FULL)
        waiting: Future[None] = Future()
        line.append(waiting)
        await waiting

    def give(self, name: str) -> None:
        """End one's turn; the next who still waits has it."""
        line = self._waiting[name]
        while line:
            waiting = line.popleft()
            if not waiting.abandoned:
                waiting.resolve(None)
                return
        del self._waiting[name]
