"""Carries out adaptations one after the other, once it has taken over: the manager's one task."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from regraft import ExclusiveSlot
from regraft.adaptation_manager.execution.adaptation_run import AdaptationRun, confirm
from regraft.adaptation_manager.execution.comparison import tell_differences
from regraft.adaptation_manager.execution.conclusion import clear_up
from regraft.adaptation_manager.execution.confirmation_watch import Watch
from regraft.adaptation_manager.execution.recovery import recover
from regraft.adaptation_manager.execution.undo_changes import asked_again
from regraft.adaptation_manager.journal.architecture_store import ArchitectureStore
from regraft.adaptation_manager.journal.journal import JournalCorrupt, JournalError
from regraft.adaptation_manager.journal.publisher import JournalPublisher
from regraft.adaptation_manager.journal.reports import pending
from regraft.adaptation_manager.planning.checks import check, stale_revision
from regraft.adaptation_manager.planning.estimate import estimated
from regraft.adaptation_manager.planning.mode_status import read_modes
from regraft.adaptation_manager.planning.modes import meant
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.queue.adaptation_queue import AdaptationQueue, Entry
from regraft.adaptation_manager.queue.startup_gate import StartupGate
from regraft.adaptation_manager.queue.turn import Turn
from regraft.adaptation_manager.targets.component_client import BESIDE, ComponentClient, ControlFailed
from regraft.adaptation_manager.targets.context import Bounds, ExecutionContext
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlCode
from regraft.bus_schema.messages.protocol.host import HostView
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, Phase, Violation
from regraft.bus_schema.model.architecture import Architecture

if TYPE_CHECKING:
    from regraft import Kit

ASK_HOSTS_INTERVAL = 0.5
"""Seconds between two attempts at finding the hosts."""


class Worker:
    """Serves the queue when the manager has taken over: from the hosts, from the journal, from any older manager."""

    def __init__(
        self,
        kit: Kit,
        queue: AdaptationQueue,
        gate: StartupGate,
        store: ArchitectureStore,
        publisher: JournalPublisher,
        bounds: Callable[[], Bounds],
    ) -> None:
        """Open the gate once it has taken over; ``bounds`` holds for each adaptation as it begins."""
        self._kit = kit
        self._queue = queue
        self._gate = gate
        self._store = store
        self._publisher = publisher
        self._bounds = bounds
        self._hosts = Hosts(kit, lambda: bounds().answer)
        self._controls = ComponentClient(kit, lambda: bounds().answer)
        self._all_ended = True
        self._takeovers = 0
        self._turns = Turn(kit)

    def close(self) -> None:
        """Watch components no longer."""
        self._controls.remembered.close()

    async def run(self) -> None:
        """Take over, then carry out what is in the queue, for ever."""
        while not self._gate.is_open:
            try:
                async with self._turns.taken() as slot:
                    await self._take_over(slot)
                self._gate.open()
            except ControlFailed as error:
                self._kit.set_status_text(f"waiting for the hosts: {error}")
                await self._kit.sleep(ASK_HOSTS_INTERVAL)
            except Exception as error:
                self._kit.log.exception("taking over failed")
                self._kit.event("adaptation_manager.fault", f"taking over failed: {type(error).__name__}: {error}")
                await self._kit.sleep(ASK_HOSTS_INTERVAL)
        while True:
            entry = await self._queue.next()
            async with self._turns.taken() as slot:
                carrying = await self._turn(entry, slot)
            if carrying is not None:
                await self._confirm(carrying)

    async def modes(self, *, reachable: bool) -> SystemModes:
        """Return the modes of all parts, and which are ``reachable`` if that is asked; raises ControlFailed."""
        async with self._turns.taken():
            return await read_modes(self._store.current(), self._controls, self._hosts, self._kit, reachable=reachable)

    async def reopen(self) -> None:
        """Open the journal if it is closed; raises ControlFailed. It stays closed if it cannot be opened.

        Those who wait while somebody else tries do not try again: nothing is left to know by then.
        """
        if self._store.journal is not None:
            return
        tried = self._takeovers
        async with self._turns.taken() as slot:
            if self._store.journal is None and self._takeovers == tried:
                await self._take_over(slot)

    async def _take_over(self, slot: ExclusiveSlot) -> None:
        """Learn the architecture, begin a term, undo what was left half-way. Raises ControlFailed.

        With a journal that cannot be written, the architecture is only known, and adaptations are rejected.
        """
        self._takeovers += 1
        views = await self._hosts.views()
        try:
            term = await self._opened(views)
            self._hosts.term = self._controls.term = term
            found = await self._claim()
            for report in await recover(
                self._store.ready(), self._store.current(), lambda b, a: self._context(slot, b, a)
            ):
                self._publisher.ended(report)
                for step in report.steps:  # what an undo is about was read back by it
                    found.pop(step.component, None)
            self.keep_end()
            await self._end_strangers(slot)
            tell_differences(self._store.current(), found, self._kit.event)
        except JournalError as error:
            self._store.close(str(error))
            self._kit.event("journal.unusable", str(error))
            self._kit.set_status_text(str(error))
        else:
            self._kit.set_status_text(f"revision {self._store.current().revision}, term {term}")
        if not self._gate.is_open:
            self._publisher.begin()

    async def _opened(self, views: list[HostView]) -> int:
        """Open the journal; returns its term. Raises JournalError."""
        try:
            return await self._kit.compute(self._store.open, views, self._kit.now())
        finally:
            self._store.tell_all()

    def keep_end(self) -> None:
        """Have others know how far the journal has come, should it be lost: before anybody relies on it."""
        with contextlib.suppress(ControlFailed):
            self._hosts.keep(self._store.end())

    async def _claim(self) -> dict[str, ComponentView]:
        """Notify all hosts and running components of the term, so that they refuse an older manager.

        Returns how the components are.
        """
        found: dict[str, ComponentView] = {}
        self._controls.processes = await self._hosts.processes(self._store.current().revision)
        managed = [n for n, spec in sorted(self._store.current().components.items()) if spec.managed]
        runs = [run for name in managed for run in (name, f"{name}{BESIDE}") if self._controls.living(run)]
        for asked in map(self._controls.claim, runs):
            try:
                found[asked.component] = await asked.view()
            except ControlFailed as error:
                if error.code is ControlCode.FENCED:
                    raise
        return found

    async def _end_strangers(self, slot: ExclusiveSlot) -> None:
        current = self._store.current()
        self._all_ended = await clear_up(self._context(slot, current, current), self._kit.event)

    def _context(self, slot: ExclusiveSlot, before: Architecture, after: Architecture) -> ExecutionContext:
        return ExecutionContext(
            self._kit, self._controls, self._hosts, self._bounds(), slot.touch, before, after, after.revision
        )

    def _pending(self, entry: Entry) -> AdaptationReport:
        return pending(entry, self._store.current().revision, self._kit.now(), self._kit.tick)

    async def _turn(self, entry: Entry, slot: ExclusiveSlot) -> AdaptationRun | None:
        """Carry an entry out; returns it if it has not ended, because it has to be confirmed."""
        entry.began = time.monotonic()
        entry.phases.enter(Phase.CHECK)
        done = await self._checked_and_done(entry, slot)
        if isinstance(done, AdaptationRun):
            if done.report.outcome is Outcome.CONFIRMING:
                self.keep_end()
                return done
            self._all_ended &= done.all_ended
            done = done.report
        self.keep_end()
        self.finish(entry, done)
        return None

    async def _checked_and_done(self, entry: Entry, slot: ExclusiveSlot) -> AdaptationReport | AdaptationRun:
        try:
            return await self._adapt(entry, slot)
        except (ControlFailed, JournalError) as error:
            if isinstance(error, JournalCorrupt):
                self._store.close(str(error))
            return self._rejected(entry, (Violation(None, "", "", str(error)),))
        except Exception as error:
            self._kit.log.exception("an adaptation could not be checked")
            problem = f"the adaptation manager failed to check it: {type(error).__name__}: {error}"
            return self._rejected(entry, (Violation(None, "", "", problem),))

    async def _adapt(self, entry: Entry, slot: ExclusiveSlot) -> AdaptationReport | AdaptationRun:
        """Check, then carry out. It raises only before anything is touched."""
        if self._store.journal is None:
            await self._take_over(slot)
        if not entry.request.dry_run:
            self._store.ready()
        if not self._all_ended and not entry.request.dry_run:
            await self._end_strangers(slot)
        if not entry.number and not entry.request.dry_run:
            entry.number = self._store.next_number()
        current = self._store.current()
        found: tuple[Violation, ...] = ()
        if entry.prepare is not None:
            entry.request, found = entry.prepare(entry.request)
            found = (*stale_revision(entry.request, current), *found)
        plan = Plan(current, current)
        if not found:
            found, plan = await check(entry.request, current, self._controls, self._hosts, self._kit.name)
            plan = plan.as_revision(self._store.next_revision())
            if entry.request.undoes:
                plan = plan.asking(asked_again(entry.request.undoes, self._store.readable(), current))
        context = self._context(slot, plan.before, plan.after)
        watch = self._watch(entry.request, context, plan) if entry.request.confirm else None
        if watch is not None and not found:
            found = tuple(await watch.begin())
        if found:
            return self._rejected(entry, found)
        entry.phases.leave()
        report = replace(
            self._pending(entry),
            revision_after=plan.after.revision,
            steps=tuple(plan.reports()),
            phases=tuple(entry.phases.ended),
            unreached=plan.unreached,
        )
        if entry.request.dry_run:
            estimate = await estimated(plan, context, self._store.durations(), entry.request.context)
            return replace(report, architecture=plan.after, estimate=estimate)
        carrying = AdaptationRun(entry, report, plan, context, self._store, watch)
        await carrying.begin()
        return carrying

    @staticmethod
    def _watch(request: AdaptationRequest, context: ExecutionContext, plan: Plan) -> Watch:
        named = frozenset(change.component for change in meant(request.changes, plan.before))
        return Watch(context, plan, request.watch, named)

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
            self._store.never_began(report)
        return report

    async def _confirm(self, carrying: AdaptationRun) -> None:
        """Watch an adaptation until it is final or undone; other requests wait."""

        def finish(report: AdaptationReport) -> None:
            self._all_ended &= carrying.all_ended
            self.keep_end()
            self.finish(carrying.entry, report)

        self._publisher.architecture()
        await confirm(carrying, self._turns, finish)

    def finish(self, entry: Entry, report: AdaptationReport) -> None:
        """Answer its client first, then publish the report."""
        entry.end(report)
        if not entry.request.dry_run:
            self._publisher.soon(report)
