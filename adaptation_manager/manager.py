"""The adaptation manager: the one who may change a running system, one transaction at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from adaptation_manager.books import Books
from adaptation_manager.carrying import Carrying, confirm
from adaptation_manager.checks import check
from adaptation_manager.concluding import clear_up
from adaptation_manager.controls import BESIDE, ControlFailed, Controls
from adaptation_manager.estimating import estimated
from adaptation_manager.gate import Gate
from adaptation_manager.hosts import Hosts
from adaptation_manager.journal import Journal, JournalCorrupt, JournalError
from adaptation_manager.line import Entry, Line, Prepare
from adaptation_manager.modes import expanded
from adaptation_manager.plan import Plan
from adaptation_manager.recovery import recover
from adaptation_manager.reports import pending
from adaptation_manager.site import Bounds, Site
from adaptation_manager.telling import Telling
from adaptation_manager.throttle import TURN, Throttle
from adaptation_manager.undoing import undo_of
from adaptation_manager.watching import Watch
from bus_schema.adaptation import (
    APPLIED,
    AdaptationReport,
    AdaptationRequest,
    Outcome,
    Phase,
    Violation,
)
from bus_schema.architecture import Architecture
from bus_schema.description import Resources
from bus_schema.messages.control import ControlCode
from bus_schema.messages.manager import (
    ArchitectureRequest,
    CancelAdaptation,
    ConfirmAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft import Component, Output, Parameter, RequestRefused, service
from regraft.runtime.exclusive import Exclusive

T = TypeVar("T")

OPEN = (Outcome.PENDING, Outcome.CONFIRMING)
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

    longest_handler = 1.0

    def on_activate(self) -> None:
        """Take over: from the hosts, from the journal, and from any older manager."""
        self._line = Line()
        self._throttle = Throttle()
        self._gate = Gate()
        self._books = Books(self.journal, self.kit.event)
        self._hosts = Hosts(self.kit, self.answer_within)
        self._controls = Controls(self.kit, self.answer_within)
        self._telling = Telling(self.kit, self.adaptations, self.architecture, self._current)
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
        await self._gate.passed(self.queue_limit)
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
        await self._gate.passed(self.queue_limit)
        undone = self._line_of(wanted.id)
        if undone is None or undone.outcome in OPEN:
            more = " yet: it is being confirmed; cancel it" if undone and undone.outcome is not Outcome.PENDING else ""
            raise RequestRefused(f"there is no ended adaptation {wanted.id!r}{more}")
        if not undone.request.changes:
            raise RequestRefused(f"adaptation {wanted.id!r} changed nothing that could be undone")
        request = AdaptationRequest((), wanted.reason or f"undo {undone.id}", wanted.who, undoes=undone.id)
        return await self._stand_in_line(
            request, lambda r: undo_of(undone, r, self._journal(), self._current())
        ).ended()

    @service("adaptation_manager/cancel")
    async def cancel(self, wanted: CancelAdaptation) -> AdaptationReport:
        """Cancel an adaptation that waits or is under way; answers with how it ended."""
        await self._gate.passed(self.queue_limit)
        entry = self._entry_or_end(wanted.id)
        if isinstance(entry, AdaptationReport):
            return entry
        entry.cancelled = True
        if entry is not self._line.serving:
            self._line.waiting.remove(entry)
            report = replace(self._pending(entry), outcome=Outcome.CANCELLED, error="cancelled while it waited")
            self._books.never_began(report)
            self._finish(entry, report)
        return await entry.ended()

    @service("adaptation_manager/confirm")
    async def confirm(self, wanted: ConfirmAdaptation) -> AdaptationReport:
        """Make an adaptation that is being confirmed final at once; answers with how it ended."""
        await self._gate.passed(self.queue_limit)
        entry = self._entry_or_end(wanted.id)
        if isinstance(entry, AdaptationReport):
            if entry.outcome not in APPLIED:
                raise RequestRefused(f"adaptation {wanted.id!r} has ended as {entry.outcome.value}")
            return entry
        if self._pending(entry).outcome is not Outcome.CONFIRMING:
            raise RequestRefused(f"adaptation {wanted.id!r} is not being confirmed: it waits or is under way")
        entry.confirmed = True
        return await entry.ended()

    @service("adaptation_manager/journal")
    async def lines(self, wanted: JournalRequest) -> JournalPage:
        """Return lines of this run's journal, newest first."""
        await self._gate.passed(self.queue_limit)
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
        await self._gate.passed(self.queue_limit)
        current = self._current()
        if wanted.revision in (None, current.revision):
            return current
        found = self._read(lambda j: j.architecture(wanted.revision))
        if found is None:
            raise RequestRefused(f"there is no revision {wanted.revision}; the architecture is at {current.revision}")
        return found

    # --- asking for a turn ---

    def _current(self) -> Architecture:
        return self._books.current()

    def _read(self, read: Callable[[Journal], T]) -> T:
        try:
            return read(self._books.ready())
        except JournalError as error:
            raise RequestRefused(str(error)) from None

    def _entry(self, given: str) -> Entry | None:
        return next((e for e in self._line.entries() if e.number and str(e.number) == given), None)

    def _entry_or_end(self, given: str) -> Entry | AdaptationReport:
        """Return an adaptation that waits or is under way, or how it has ended; raises RequestRefused."""
        found = self._entry(given) or self._line_of(given)
        if found is None:
            raise RequestRefused(f"there is no adaptation {given!r}")
        return found

    def _line_of(self, given: str) -> AdaptationReport | None:
        entry = self._entry(given)
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
        waiting = self._line.waiting
        if len(waiting) >= self.queue_limit:
            why = f"the queue is full: {len(waiting)} adaptations wait already"
            raise RequestRefused(why, retry_after=TURN * self.source_limit)
        source = self.kit.asked_by
        self._throttle.admit(
            source,
            (entry.source for entry in waiting),
            self.kit.now(),
            rate=self.rate_limit,
            burst=self.burst,
            most_waiting=self.source_limit,
        )
        numbered = not request.dry_run and self._books.journal is not None
        entry = Entry(self._books.next_number() if numbered else 0, request, prepare, source)
        self._line.join(entry)
        return entry

    async def _answer(self, entry: Entry, request: AdaptationRequest) -> AdaptationReport:
        return await entry.ended() if request.wait else self._pending(entry)

    def _pending(self, entry: Entry) -> AdaptationReport:
        return pending(entry, self._current().revision, self.kit.now(), self.kit.tick)

    # --- working ---

    async def _work(self) -> None:
        while not self._gate.is_open:
            try:
                async with self.kit.exclusive() as slot:
                    await self._take_over(slot)
                self._gate.open()
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
                carrying = await self._turn(entry, slot)
            if carrying is not None:
                await self._confirm(carrying)

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
                self._telling.ended(report)
            await self._end_strangers(slot)
        except JournalError as error:
            self._books.close()
            self.kit.event("journal.unusable", str(error))
            self.kit.say(str(error))
        else:
            self.kit.say(f"revision {self._current().revision}, term {term}")
        if not self._gate.is_open:
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

    async def _turn(self, entry: Entry, slot: Exclusive) -> Carrying | None:
        """Carry an entry out; returns it if it has not ended, because it has to be confirmed."""
        entry.began = time.monotonic()
        entry.phases.enter(Phase.CHECK)
        done = await self._checked_and_done(entry, slot)
        if isinstance(done, Carrying):
            if done.report.outcome is Outcome.CONFIRMING:
                return done
            self._all_ended = done.all_ended
            done = done.report
        self._finish(entry, done)
        return None

    async def _checked_and_done(self, entry: Entry, slot: Exclusive) -> AdaptationReport | Carrying:
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

    async def _adapt(self, entry: Entry, slot: Exclusive) -> AdaptationReport | Carrying:
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
            plan = plan.as_revision(self._books.next_revision())
        site = self._site(slot, plan.before, plan.after)
        named = frozenset(change.component for _, change in expanded(entry.request.changes, current)[0])
        watch = Watch(site, plan, entry.request.watch, named) if entry.request.confirm else None
        if watch is not None and not found:
            found = tuple(await watch.begin())
        if found:
            return self._rejected(entry, found)
        entry.phases.leave()
        report = replace(self._pending(entry), steps=tuple(plan.reports()), phases=tuple(entry.phases.ended))
        if entry.request.dry_run:
            estimate = await estimated(plan, site, self._books.durations(), entry.request.context)
            return replace(report, revision_after=plan.after.revision, architecture=plan.after, estimate=estimate)
        carrying = Carrying(entry, report, plan, site, self._books, watch)
        await carrying.begin()
        return carrying

    def _rejected(self, entry: Entry, found: tuple[Violation, ...]) -> AdaptationReport:
        entry.phases.leave()
        report = replace(
            self._pending(entry),
            outcome=Outcome.REJECTED,
            violations=found,
            duration=entry.lasted(),
            phases=tuple(entry.phases.ended),
        )
        if entry.number:
            self._books.never_began(report)
        return report

    async def _confirm(self, carrying: Carrying) -> None:
        """Watch an adaptation until it is final or undone; whoever else wants something waits."""

        def finish(report: AdaptationReport) -> None:
            self._all_ended = carrying.all_ended
            self._finish(carrying.entry, report)

        self._telling.architecture()
        await confirm(carrying, finish)

    def _finish(self, entry: Entry, report: AdaptationReport) -> None:
        """Answer whoever waits first, then tell everybody else."""
        entry.end(report)
        if not entry.request.dry_run:
            self._telling.soon(report)
