"""The adaptation manager: the one who may change a running system, one transaction at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from adaptation_manager.books import Books
from adaptation_manager.checks import check
from adaptation_manager.concluding import clear_up, conclude
from adaptation_manager.controls import BESIDE, ControlFailed, Controls
from adaptation_manager.hosts import Hosts
from adaptation_manager.journal import Journal, JournalCorrupt, JournalError
from adaptation_manager.line import Entry, Line, Prepare
from adaptation_manager.modes import unfolded
from adaptation_manager.plan import Plan
from adaptation_manager.recovery import recover
from adaptation_manager.reports import EVENTS, pending, summary
from adaptation_manager.site import Bounds, Site
from adaptation_manager.transaction import Transaction
from adaptation_manager.undoing import conflicts, inverse
from bus_schema.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Outcome,
    StepReport,
    StepState,
    Violation,
)
from bus_schema.architecture import Architecture
from bus_schema.description import Resources
from bus_schema.messages.control import ControlCode
from bus_schema.messages.manager import (
    ArchitectureRequest,
    CancelAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft import Component, Output, Parameter, RequestRefused, service
from regraft.runtime.exclusive import Exclusive
from regraft.runtime.tasks import Waiting

T = TypeVar("T")

ASK_HOSTS_AGAIN_AFTER = 0.5
"""Seconds between two attempts at finding the hosts."""


class AdaptationManager(Component):
    """Carries out adaptations of the architecture as transactions, and keeps the journal of them."""

    resources = Resources(cpu=0.01, memory=25.0)
    indispensable = "it carries out every change of the system, its own removal included"

    adaptations = Output(AdaptationReport, text="every adaptation at its end")
    architecture = Output(Architecture, text="the architecture at every new revision")

    journal = Parameter("", "the journal's file; empty keeps it in memory", unit="path", read_only=True)
    queue_limit = Parameter(32, "adaptations that may wait for their turn", minimum=1, maximum=1000)
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

    longest_handler = 1.0

    def on_activate(self) -> None:
        """Take over: from the hosts, from the journal, and from any older manager."""
        self._line = Line()
        self._gate: list[Waiting[None]] | None = []
        self._books = Books(self.journal, self.kit.event)
        self._hosts = Hosts(self.kit, self.answer_within)
        self._controls = Controls(self.kit, self.answer_within)
        self._all_ended = True
        self.kit.spawn(self._work(), "adaptations")

    def on_deactivate(self) -> None:
        """Close the journal; what was under way is undone at the next activation."""
        self._controls.remembered.close()
        self._books.close()

    # --- services ---

    @service("adaptation_manager/adapt")
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Carry out an adaptation; answers with what became of it, or at once if ``wait`` is False."""
        await self._opened()
        if request.key and not request.dry_run:
            known = self._same_key(request)
            if isinstance(known, AdaptationReport):
                return known
            if known is not None:
                return await self._answer(known, request)
        return await self._answer(self._stand_in_line(request, None), request)

    @service("adaptation_manager/undo")
    async def undo(self, wanted: UndoAdaptation) -> AdaptationReport:
        """Undo an applied adaptation by a new one."""
        await self._opened()
        undone = self._line_of(wanted.id)
        if undone is None or undone.outcome is Outcome.PENDING:
            raise RequestRefused(f"there is no ended adaptation {wanted.id!r}")
        if not undone.request.changes:
            raise RequestRefused(f"adaptation {wanted.id!r} changed nothing that could be undone")
        request = AdaptationRequest((), wanted.reason or f"undo {undone.id}", wanted.who, undoes=undone.id)
        return await self._stand_in_line(request, lambda r: self._undo_of(undone, r)).ended()

    @service("adaptation_manager/cancel")
    async def cancel(self, wanted: CancelAdaptation) -> AdaptationReport:
        """Cancel an adaptation that waits or is under way; answers with how it ended."""
        await self._opened()
        entry = next((e for e in self._line.entries() if e.number and str(e.number) == wanted.id), None)
        if entry is None:
            ended = self._line_of(wanted.id)
            if ended is None:
                raise RequestRefused(f"there is no adaptation {wanted.id!r}")
            return ended
        entry.cancelled = True
        if entry is not self._line.serving:
            self._line.waiting.remove(entry)
            report = replace(self._pending(entry), outcome=Outcome.CANCELLED, error="cancelled while it waited")
            self._books.never_began(report)
            self._finish(entry, report)
        return await entry.ended()

    @service("adaptation_manager/journal")
    async def lines(self, wanted: JournalRequest) -> JournalPage:
        """Return lines of this run's journal, newest first."""
        await self._opened()
        if wanted.id:
            line = self._line_of(wanted.id)
            return JournalPage((line,) if line else ())
        if wanted.before and not wanted.before.isdecimal():
            raise RequestRefused(f"before: there is no adaptation {wanted.before!r}")
        entries = self._read(lambda j: j.page(int(wanted.before) if wanted.before else None, wanted.limit + 1))
        return JournalPage(tuple(entries[: wanted.limit]), len(entries) > wanted.limit)

    @service("adaptation_manager/architecture")
    async def architecture_at(self, wanted: ArchitectureRequest) -> Architecture:
        """Return the architecture, now or at an earlier revision of this run."""
        await self._opened()
        current = self._current()
        if wanted.revision in (None, current.revision):
            return current
        found = self._read(lambda j: j.architecture(wanted.revision))
        if found is None:
            raise RequestRefused(f"there is no revision {wanted.revision}; the architecture is at {current.revision}")
        return found

    # --- asking for a turn ---

    async def _opened(self) -> None:
        """Wait until the manager has taken over."""
        if self._gate is not None:
            if len(self._gate) >= self.queue_limit:
                raise RequestRefused("the adaptation manager has not taken over yet, and many wait for it already")
            waiting: Waiting[None] = Waiting()
            self._gate.append(waiting)
            await waiting

    def _current(self) -> Architecture:
        assert self._books.architecture is not None
        return self._books.architecture

    def _read(self, read: Callable[[Journal], T]) -> T:
        try:
            return read(self._books.ready())
        except JournalError as error:
            raise RequestRefused(str(error)) from None

    def _line_of(self, given: str) -> AdaptationReport | None:
        entry = next((e for e in self._line.entries() if e.number and str(e.number) == given), None)
        if entry is not None:
            return self._pending(entry)
        return self._read(lambda j: j.report(int(given))) if given.isdecimal() and len(given) < 19 else None

    def _same_key(self, request: AdaptationRequest) -> Entry | AdaptationReport | None:
        known: Entry | AdaptationReport | None
        known = next((entry for entry in self._line.entries() if entry.request.key == request.key), None)
        if known is None and self._books.journal is not None:
            known = self._read(lambda j: j.by_key(request.key))
        if known is not None and replace(known.request, wait=True) != replace(request, wait=True):
            raise RequestRefused(f"idempotency key {request.key!r} was used for another request")
        return known

    def _stand_in_line(self, request: AdaptationRequest, prepare: Prepare | None) -> Entry:
        if len(self._line.waiting) >= self.queue_limit:
            raise RequestRefused(f"the queue is full: {len(self._line.waiting)} adaptations wait already")
        numbered = not request.dry_run and self._books.journal is not None
        entry = Entry(self._books.next_number() if numbered else 0, request, prepare)
        self._line.join(entry)
        return entry

    async def _answer(self, entry: Entry, request: AdaptationRequest) -> AdaptationReport:
        return await entry.ended() if request.wait else self._pending(entry)

    def _pending(self, entry: Entry) -> AdaptationReport:
        return pending(entry, self._current().revision, self.kit.now(), self.kit.tick)

    # --- working ---

    async def _work(self) -> None:
        while self._gate is not None:
            try:
                async with self.kit.exclusive() as slot:
                    await self._take_over(slot)
                self._open_gate()
            except ControlFailed as error:
                self.kit.say(f"waiting for the hosts: {error}")
                await self.kit.sleep(ASK_HOSTS_AGAIN_AFTER)
            except Exception as error:
                self.kit.log.exception("taking over failed")
                self.kit.event("adaptation_manager.fault", f"taking over failed: {type(error).__name__}: {error}")
                await self.kit.sleep(ASK_HOSTS_AGAIN_AFTER)
        while True:
            entry = await self._line.next()
            async with self.kit.exclusive() as slot:
                self._finish(entry, await self._turn(entry, slot))

    def _open_gate(self) -> None:
        waiters, self._gate = self._gate or [], None
        for waiting in waiters:
            waiting.resolve(None)

    async def _take_over(self, slot: Exclusive) -> None:
        """Learn the architecture, begin a reign, undo what was left half-way. Raises ControlFailed.

        With a journal that cannot be written, the architecture is only known, and adaptations are rejected.
        """
        views = await self._hosts.views()
        try:
            term = self._books.open(views, self.kit.now())
            self._hosts.term = self._controls.term = term
            await self._claim()
            for report in await recover(self._journal(), self._current(), lambda b, a: self._site(slot, b, a)):
                self._tell(report)
            await self._end_strangers(slot)
        except JournalError as error:
            self._books.close()
            self.kit.event("journal.unusable", str(error))
            self.kit.say(str(error))
        else:
            self.kit.say(f"revision {self._current().revision}, term {term}")
        if self._gate is not None:
            self.architecture.publish(self._current())

    async def _claim(self) -> None:
        """Tell all hosts and running components of the term, so that they refuse an older manager."""
        self._controls.processes = await self._hosts.processes(self._current().revision)
        managed = [n for n, spec in sorted(self._current().components.items()) if spec.managed]
        runs = [run for name in managed for run in (name, f"{name}{BESIDE}") if self._controls.living(run)]
        for asked in map(self._controls.claim, runs):
            try:
                await asked.view()
            except ControlFailed as error:
                if error.code is ControlCode.FENCED:
                    raise

    async def _end_strangers(self, slot: Exclusive) -> None:
        current = self._current()
        self._all_ended = await clear_up(self._site(slot, current, current), self.kit.event)

    def _journal(self) -> Journal:
        return self._books.ready()

    def _site(self, slot: Exclusive, before: Architecture, after: Architecture) -> Site:
        bounds = Bounds(self.answer_within, self.bind_within, self.undo_within, self.start_within)
        return Site(self.kit, self._controls, self._hosts, bounds, slot.touch, before, after, after.revision)

    async def _turn(self, entry: Entry, slot: Exclusive) -> AdaptationReport:
        entry.began = time.monotonic()
        try:
            return await self._adapt(entry, slot)
        except (ControlFailed, JournalError) as error:
            if isinstance(error, JournalCorrupt):
                self._books.close()
            return self._rejected(entry, (Violation(None, "", "", str(error)),))
        except Exception as error:
            self.kit.log.exception("an adaptation could not be checked")
            problem = f"the adaptation manager failed to check it: {type(error).__name__}: {error}"
            return self._rejected(entry, (Violation(None, "", "", problem),))

    async def _adapt(self, entry: Entry, slot: Exclusive) -> AdaptationReport:
        """Check, then carry out. Whatever it raises was raised before anything was touched."""
        if self._books.journal is None:
            await self._take_over(slot)
        self._journal()
        if not self._all_ended:
            await self._end_strangers(slot)
        if not entry.number and not entry.request.dry_run:
            entry.number = self._books.next_number()
        current = self._current()
        found: tuple[Violation, ...] = ()
        if entry.prepare is not None:
            entry.request, found = entry.prepare(entry.request)
        plan = Plan(current, current)
        if not found:
            found, plan = await check(entry.request, current, self._controls, self._hosts, self.kit.name)
        if found:
            return self._rejected(entry, found)
        report = replace(self._pending(entry), steps=tuple(plan.reports()))
        if entry.request.dry_run:
            return replace(report, revision_after=plan.after.revision, architecture=plan.after)
        return await self._carry_out(entry, report, plan, slot)

    def _rejected(self, entry: Entry, found: tuple[Violation, ...]) -> AdaptationReport:
        report = replace(self._pending(entry), outcome=Outcome.REJECTED, violations=found, duration=entry.lasted())
        if entry.number:
            self._books.never_began(report)
        return report

    async def _carry_out(self, entry: Entry, report: AdaptationReport, plan: Plan, slot: Exclusive) -> AdaptationReport:
        journal = self._journal()
        journal.begin(replace(report, revision_after=plan.after.revision), plan)

        def commit(steps: list[StepReport]) -> None:
            nonlocal report
            applied = replace(
                report,
                outcome=site.outcome,
                revision_after=plan.after.revision,
                steps=tuple(steps),
                error=site.loss,
                duration=entry.lasted(),
            )
            self._books.applied(applied, plan.after)
            report = applied

        def note(states: dict[int, StepState]) -> None:
            journal.progress(entry.number, states)

        site = self._site(slot, plan.before, plan.after)
        transaction = Transaction(plan, site, note, commit, lambda: entry.cancelled)
        outcome = await transaction.run()
        if outcome is site.outcome:
            self._all_ended = await conclude(site, plan, self.kit.event)
        if outcome is Outcome.REJECTED:
            report = replace(report, violations=(Violation(None, "", "", transaction.error),))
        if outcome is not site.outcome:
            report = replace(
                report,
                outcome=outcome,
                steps=tuple(transaction.steps),
                error=transaction.error,
                duration=entry.lasted(),
            )
            self._books.ended(report)
        return report

    def _undo_of(
        self, undone: AdaptationReport, request: AdaptationRequest
    ) -> tuple[AdaptationRequest, tuple[Violation, ...]]:
        journal = self._journal()
        if undone.outcome not in (Outcome.APPLIED, Outcome.APPLIED_STATE_LOST):
            problem = f"adaptation {undone.id} is {undone.outcome.value}: only an applied one can be undone"
            return request, (Violation(None, "", "undoes", problem),)
        before, behind = (
            journal.architecture(undone.revision_before),
            journal.architecture(undone.revision_after),
        )
        assert before is not None
        assert behind is not None
        undone = unfolded(undone, before)
        complete = replace(request, changes=inverse(undone.request.changes, before))
        later = [unfolded(line, before) for line in journal.applied_after(int(undone.id))]
        return complete, tuple(conflicts(undone, behind, self._current(), later))

    # --- telling ---

    def _finish(self, entry: Entry, report: AdaptationReport) -> None:
        """Answer whoever waits first, then tell everybody else."""
        entry.end(report)
        if not entry.request.dry_run:
            self.kit.spawn(self._tell_all(report), "telling")

    async def _tell_all(self, report: AdaptationReport) -> None:
        self._tell(report)
        if report.revision_after != report.revision_before and self.architecture.wanted:
            self.architecture.publish(self._current())

    def _tell(self, report: AdaptationReport) -> None:
        if self.adaptations.wanted:
            self.adaptations.publish(report)
        self.kit.event(EVENTS[report.outcome], summary(report), id=report.id, revision=report.revision_after)
        self.kit.say(f"revision {self._current().revision}; last: {summary(report)}")
