"""The adaptation manager: the one who may change a running system, one transaction at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from regraft import Component, Input, Output, Parameter, RefusalCode, RequestRefused, service
from regraft.adaptation_manager.execution.undo_changes import undo_of
from regraft.adaptation_manager.execution.worker import Worker
from regraft.adaptation_manager.journal.architecture_store import ArchitectureStore
from regraft.adaptation_manager.journal.fault_lines import FaultLines
from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.adaptation_manager.journal.publisher import JournalPublisher
from regraft.adaptation_manager.journal.reports import pending
from regraft.adaptation_manager.journal.revisions import architecture_at
from regraft.adaptation_manager.queue.adaptation_queue import AdaptationQueue, Entry, Prepare
from regraft.adaptation_manager.queue.startup_gate import StartupGate
from regraft.adaptation_manager.queue.throttle import TURN, Throttle
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import Bounds
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    ArchitectureTag,
    ArchitectureTagRequest,
    CancelAdaptation,
    ConfirmAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, SystemModes
from regraft.bus_schema.messages.management.system import SystemFaults
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    APPLIED,
    ARCHITECTURE,
    ARCHITECTURE_TAG,
    CANCEL,
    CONFIRM,
    JOURNAL,
    UNDO,
    AdaptationReport,
    AdaptationRequest,
    Outcome,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources

T = TypeVar("T")

OPEN = (Outcome.PENDING, Outcome.CONFIRMING)


class AdaptationManager(Component):
    """Carries out adaptations of the architecture as transactions, and keeps the journal of them."""

    resources = Resources(cpu=0.01, memory=25.0)
    removal_forbidden = "it carries out every change of the system, its own removal included"

    faults = Input(SystemFaults, topic="system/faults", required=False, description="what the journal has lines of")
    adaptations = Output(AdaptationReport, description="every adaptation at its end")
    architecture = Output(Architecture, description="the architecture at every new revision")

    journal = Parameter("", "the journal's file; empty keeps it in memory", unit="path", read_only=True)
    queue_limit = Parameter(32, "adaptations that may wait for their turn", minimum=1, maximum=1000)
    source_limit = Parameter(8, "of these, how many may be of one source", minimum=1, maximum=1000)
    rate_limit = Parameter(
        50.0, "adaptations that one source may ask for, on average", minimum=0.1, maximum=1e6, unit="Hz"
    )
    burst = Parameter(200, "adaptations that one source may ask for at once", minimum=1, maximum=1_000_000)
    answer_within = Parameter(
        2.0, "time that a component or host may take to answer", minimum=0.05, maximum=60.0, unit="s"
    )
    bind_within = Parameter(
        1.0, "time that new connections may take to be seen through", minimum=0.05, maximum=60.0, unit="s"
    )
    undo_within = Parameter(5.0, "time that undoing one step may take", minimum=0.05, maximum=60.0, unit="s")

    start_within = Parameter(
        20.0, "time that a component's process may take to come up", minimum=0.1, maximum=600.0, unit="s"
    )

    handler_timeout = 1.0

    def on_activate(self) -> None:
        """Take over: from the hosts, from the journal, and from any older manager."""
        self._queue = AdaptationQueue()
        self._throttle = Throttle()
        self._gate = StartupGate()
        self._store = ArchitectureStore(self.journal, self.kit.event)
        self._fault_lines = FaultLines()
        self._publisher = JournalPublisher(self.kit, self.adaptations, self.architecture, self._current)
        self._worker = Worker(self.kit, self._queue, self._gate, self._store, self._publisher, self._bounds)
        self.kit.spawn(self._worker.run(), "adaptations")

    def on_deactivate(self) -> None:
        """Close the journal; what was under way is undone at the next activation."""
        self._worker.close()
        self._store.close()
        self.kit.compute(self._store.close)  # behind an opening that is under way

    @faults.handler
    def note_faults(self, faults: SystemFaults) -> None:
        """Write what has failed, ended or recovered into the journal."""
        self._fault_lines.note((*faults.present, *faults.news), self._store.journal)

    # --- services ---

    @service(ADAPT)
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Carry out an adaptation; answers with what became of it, or at once if ``wait`` is False.

        A dry run is always waited for.
        """
        await self._gate.passed(self.queue_limit)
        return await self._carried_out(request, None)

    @service(UNDO)
    async def undo(self, wanted: UndoAdaptation) -> AdaptationReport:
        """Undo an applied adaptation by a new one, or report what that would do; answers as ``adapt`` does."""
        await self._gate.passed(self.queue_limit)
        undone = self._line_of(wanted.id)
        if undone is None or undone.outcome in OPEN:
            more = " yet: it is being confirmed; cancel it" if undone and undone.outcome is not Outcome.PENDING else ""
            code = RefusalCode.NOT_FOUND if undone is None else RefusalCode.CONFLICT
            raise RequestRefused(f"there is no ended adaptation {wanted.id!r}{more}", code)
        if not undone.request.changes:
            raise RequestRefused(f"adaptation {wanted.id!r} changed nothing that could be undone", RefusalCode.CONFLICT)
        reason = wanted.reason or f"undo {undone.id}"
        request = AdaptationRequest(
            (),
            reason,
            wanted.actor,
            wanted.revision,
            wanted.key,
            dry_run=wanted.dry_run,
            wait=wanted.wait,
            undoes=undone.id,
            confirm=wanted.confirm,
            watch=wanted.watch,
        )
        return await self._carried_out(request, lambda r: undo_of(undone, r, self._store.ready(), self._current()))

    @service(CANCEL)
    async def cancel(self, wanted: CancelAdaptation) -> AdaptationReport:
        """Cancel an adaptation that waits or is under way; answers with how it ended."""
        await self._gate.passed(self.queue_limit)
        entry = self._entry_or_end(wanted.id)
        if isinstance(entry, AdaptationReport):
            return entry
        entry.cancelled = True
        if entry is not self._queue.serving:
            self._queue.waiting.remove(entry)
            report = replace(self._pending(entry), outcome=Outcome.CANCELLED, error="cancelled while it waited")
            self._store.never_began(report)
            self._worker.finish(entry, report)
        return await entry.ended()

    @service(CONFIRM)
    async def confirm(self, wanted: ConfirmAdaptation) -> AdaptationReport:
        """Make an adaptation that is being confirmed final at once; answers with how it ended."""
        await self._gate.passed(self.queue_limit)
        entry = self._entry_or_end(wanted.id)
        if isinstance(entry, AdaptationReport):
            if entry.outcome not in APPLIED:
                why = f"adaptation {wanted.id!r} has ended as {entry.outcome.value}"
                raise RequestRefused(why, RefusalCode.CONFLICT)
            return entry
        if self._pending(entry).outcome is not Outcome.CONFIRMING:
            why = f"adaptation {wanted.id!r} is not being confirmed: it waits or is under way"
            raise RequestRefused(why, RefusalCode.CONFLICT)
        entry.confirmed = True
        return await entry.ended()

    @service(JOURNAL)
    async def lines(self, wanted: JournalRequest) -> JournalPage:
        """Return lines of this run's journal, newest first, and what waits for its turn."""
        await self._gate.passed(self.queue_limit)
        if wanted.id:
            line = self._line_of(wanted.id)
            return JournalPage((line,) if line else ())
        before = _number(wanted.before)
        if wanted.before and before is None:
            raise RequestRefused(f"there is no adaptation {wanted.before!r}", RefusalCode.NOT_FOUND, field="before")
        found = self._read(lambda j: j.page(before, wanted.limit + 1))
        entries = tuple(self._store.line(report) for report in found[: wanted.limit])
        more = len(found) > wanted.limit
        since = entries[-1].started if more else -math.inf
        newer = self._read(lambda j: j.report(before)) if before is not None else None
        until = newer.started if newer is not None else math.inf
        faults = self._read(lambda j: self._fault_lines.read(j, since, until))
        return JournalPage(entries, more, faults, () if wanted.before else self._without_line())

    @service(ARCHITECTURE)
    async def architecture_at(self, wanted: ArchitectureRequest) -> Architecture:
        """Return the architecture, now or at an earlier revision of this run."""
        await self._gate.passed(self.queue_limit)
        current = self._current()
        if wanted.revision in (None, current.revision):
            return current
        found = self._read(lambda j: architecture_at(j, wanted.revision))
        if found is None:
            why = f"there is no revision {wanted.revision}; the architecture is at {current.revision}"
            raise RequestRefused(why, RefusalCode.NOT_FOUND, field="revision")
        return found

    @service(ARCHITECTURE_TAG)
    async def architecture_tag(self, wanted: ArchitectureTagRequest) -> ArchitectureTag:
        """Return the tag of the architecture as it is now, by which who knows it need not read it again."""
        await self._gate.passed(self.queue_limit)
        return ArchitectureTag(self._store.tag())

    @service(MODES)
    async def modes(self, wanted: ModesRequest) -> SystemModes:
        """Return the modes of all parts: those that were asked for, those that are, and those that could be."""
        await self._gate.passed(self.queue_limit)
        try:
            return await self._worker.modes(reachable=wanted.reachable)
        except ControlFailed as error:
            raise RequestRefused(str(error), RefusalCode.UNAVAILABLE) from None

    # --- asking for a turn ---

    def _bounds(self) -> Bounds:
        return Bounds(self.answer_within, self.bind_within, self.undo_within, self.start_within)

    def _current(self) -> Architecture:
        return self._store.current()

    def _read(self, read: Callable[[Journal], T]) -> T:
        try:
            return read(self._store.readable())
        except JournalError as error:
            raise RequestRefused(str(error), RefusalCode.UNAVAILABLE) from None

    def _without_line(self) -> tuple[AdaptationReport, ...]:
        """Return the adaptations that have an id and no line yet, newest first."""
        entries = [entry for entry in reversed(self._queue.entries()) if entry.number and entry.report is None]
        return tuple(self._pending(entry) for entry in entries if not self._has_line(entry.number))

    def _has_line(self, number: int) -> bool:
        return self._read(lambda j: j.report(number)) is not None

    def _entry(self, given: str) -> Entry | None:
        return next((e for e in self._queue.entries() if e.number and str(e.number) == given), None)

    def _entry_or_end(self, given: str) -> Entry | AdaptationReport:
        """Return an adaptation that waits or is under way, or how it has ended; raises RequestRefused."""
        found = self._entry(given) or self._line_of(given)
        if found is None:
            raise RequestRefused(f"there is no adaptation {given!r}", RefusalCode.NOT_FOUND)
        return found

    def _line_of(self, given: str) -> AdaptationReport | None:
        entry = self._entry(given)
        if entry is not None:
            return self._pending(entry)
        number = _number(given)
        found = self._read(lambda j: j.report(number)) if number is not None else None
        return self._store.line(found) if found is not None else None

    async def _same_key(self, request: AdaptationRequest) -> Entry | AdaptationReport | None:
        """Return the adaptation of a request's key, if it has been asked for. Raises RequestRefused.

        Without the journal nobody knows: it is opened again for this, and the request is refused where it cannot be.
        """
        try:
            await self._worker.reopen()
        except ControlFailed as error:
            raise RequestRefused(str(error), RefusalCode.UNAVAILABLE) from None
        known: Entry | AdaptationReport | None
        known = next((entry for entry in self._queue.entries() if entry.request.key == request.key), None)
        if known is None:
            written = self._read(lambda j: j.by_key(request.key))
            known = self._store.line(written) if written is not None else None
        if known is not None and not _is_same(known.request, request):
            why = f"idempotency key {request.key!r} was used for another request"
            raise RequestRefused(why, RefusalCode.KEY_REUSED)
        return known

    async def _carried_out(self, request: AdaptationRequest, prepare: Prepare | None) -> AdaptationReport:
        known = await self._same_key(request) if request.key and not request.dry_run else None
        if isinstance(known, AdaptationReport):
            return known
        return await self._answer(known or self._enqueue(request, prepare), request)

    def _enqueue(self, request: AdaptationRequest, prepare: Prepare | None) -> Entry:
        waiting = self._queue.waiting
        if len(waiting) >= self.queue_limit:
            why = f"the queue is full: {len(waiting)} adaptations wait already"
            raise RequestRefused(why, RefusalCode.QUEUE_FULL, retry_after=TURN * self.source_limit)
        source = self.kit.asked_by
        self._throttle.admit(
            source,
            (entry.source for entry in waiting),
            self.kit.now(),
            rate=self.rate_limit,
            burst=self.burst,
            most_waiting=self.source_limit,
        )
        numbered = not request.dry_run and self._store.journal is not None
        entry = Entry(self._store.next_number() if numbered else 0, request, prepare, source)
        self._queue.enqueue(entry)
        return entry

    async def _answer(self, entry: Entry, request: AdaptationRequest) -> AdaptationReport:
        if request.wait or request.dry_run:  # a dry run has no line of the journal: its report could not be read later
            return await entry.ended()
        self._worker.keep_end()  # the answer has the number before there is a line of it: nobody else may get it
        return self._pending(entry)

    def _pending(self, entry: Entry) -> AdaptationReport:
        return pending(entry, self._current().revision, self.kit.now(), self.kit.tick)


def _is_same(known: AdaptationRequest, request: AdaptationRequest) -> bool:
    """Return whether a request is that of a known adaptation; the changes of an undo are found as it is carried out."""
    is_undo = request.undoes and not request.changes
    return replace(known, wait=True, changes=() if is_undo else known.changes) == replace(request, wait=True)


def _number(given: str) -> int | None:
    """Return the number that an adaptation's id represents, None if it is no id."""
    return int(given) if given.isascii() and given.isdecimal() and len(given) < 19 else None
