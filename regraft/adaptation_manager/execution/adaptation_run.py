"""One adaptation being carried out: from its plan to its end, watched over for a while if it is to be confirmed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from regraft.adaptation_manager.execution.conclusion import conclude
from regraft.adaptation_manager.execution.confirmation_watch import NEARLY, Watch
from regraft.adaptation_manager.execution.measured import LOOK_INTERVAL
from regraft.adaptation_manager.execution.transaction import Transaction
from regraft.adaptation_manager.journal.architecture_store import ArchitectureStore
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.queue.adaptation_queue import Entry
from regraft.adaptation_manager.queue.turn import Turn
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Outcome,
    Phase,
    PhaseReport,
    StepReport,
    StepState,
    Violation,
)
from regraft.bus_schema.model.watched import Breach, BreachCode


@dataclass(slots=True)
class AdaptationRun:
    """``report`` is its state so far; ``all_ended`` whether nothing is left that should have ended with it.

    It is worked on in exclusive slots only.
    """

    entry: Entry
    report: AdaptationReport
    plan: Plan
    context: ExecutionContext
    store: ArchitectureStore
    watch: Watch | None = None
    all_ended: bool = True
    transaction: Transaction = field(init=False)
    _since: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.transaction = Transaction(
            self.plan,
            self.context,
            lambda states: self._note(states),
            self._hold if self.watch is not None else self._commit,
            lambda: self.entry.cancelled,
            self.entry.phases,
            final=self.watch is None,
        )

    async def begin(self) -> AdaptationReport:
        """Carry it out; returns how it ended, or that it is to be confirmed. Raises JournalError before it begins."""
        self.store.ready().begin(self.report, self.plan)
        if not self.plan.only_gives_values or self.watch is not None:
            self.entry.phases.speak(self._tell_phase)
        return await self._after(await self.transaction.run())

    # --- what becomes durable ---

    def _note(self, states: dict[int, StepState]) -> None:
        self.store.ready().progress(self.entry.number, states)

    def _commit(self, steps: list[StepReport]) -> None:
        applied = self._reported(self.context.outcome, steps, self.context.loss)
        self.store.applied(applied, self.plan)
        self.report = applied

    def _hold(self, steps: list[StepReport]) -> None:
        held = self._reported(Outcome.CONFIRMING, steps)
        self.store.confirming(held, self.plan.after)
        self.report = self.entry.shown = held

    def _reported(self, outcome: Outcome, steps: list[StepReport], error: str = "") -> AdaptationReport:
        return replace(
            self.report,
            outcome=outcome,
            revision_after=self.plan.after.revision,
            steps=tuple(steps),
            duration=self.entry.lasted(),
            phases=tuple(self.entry.phases.ended),
            error=error,
        )

    # --- the end, or the time until it is confirmed ---

    async def _after(self, outcome: Outcome) -> AdaptationReport:
        self._since = self.context.kit.now()
        if outcome is Outcome.CONFIRMING:
            self.entry.phases.enter(Phase.CONFIRM)
            if self.watch is not None:
                await self.watch.start()
            self._tell_confirming()
            return self.report
        if outcome is self.context.outcome:
            self.all_ended = await conclude(self.context, self.plan, self.context.kit.event)
            return self.report
        found = (Violation(None, "", "", self.transaction.error),) if outcome is Outcome.REJECTED else ()
        self.report = replace(
            self._reported(outcome, self.transaction.steps, self.transaction.error),
            revision_after=self.plan.before.revision,
            violations=found,
            unreached=self.context.unreached(self.report),
        )
        self.all_ended = not self.context.unfinished
        self.store.ended(self.report)
        return self.report

    async def look(self, last: bool) -> AdaptationReport | None:
        """Look at it once more; returns how it ended, None if it continues. ``last`` if its time is over."""
        assert self.watch is not None
        if self.entry.confirmed and not self.entry.cancelled:
            return await self._settle()
        broken = [] if self.entry.cancelled else await self._broken(self.watch, last)
        if self.entry.cancelled:
            return await self._withdraw(Outcome.CANCELLED, "cancelled before it was confirmed")
        if broken:
            self.report = replace(self.report, broken=tuple(broken))
            wrong = "; ".join(breach.text for breach in broken)
            return await self._withdraw(Outcome.ROLLED_BACK, f"not confirmed: {wrong}")
        return await self._settle() if last else None

    async def _broken(self, watch: Watch, last: bool) -> list[Breach]:
        """Return what is not well; that it cannot be watched is nothing well either."""
        try:
            return await watch.look(last)
        except ControlFailed as error:
            text = str(error)
        except Exception as error:
            self.context.kit.log.exception("an adaptation could not be watched")
            text = f"it could not be watched: {type(error).__name__}: {error}"
        return [Breach(BreachCode.NO_ANSWER, text, at=self.context.kit.now())]

    async def _settle(self) -> AdaptationReport:
        self._leave()
        self.transaction.commit = self._commit
        return await self._after(await self.transaction.settle())

    async def _withdraw(self, outcome: Outcome, why: str) -> AdaptationReport:
        self._leave()
        return await self._after(await self.transaction.withdraw(outcome, why))

    def _leave(self) -> None:
        self.entry.phases.leave(max(0.0, self.context.kit.now() - self._since))

    # --- reporting ---

    def _tell_phase(self, phase: PhaseReport) -> None:
        text = f"adaptation {self.report.id}: {phase.phase.value} took {phase.duration:.3f} s"
        details = {"id": self.report.id, "phase": phase.phase.value, "duration": phase.duration}
        self.context.kit.event("adaptation.phase", text, **details)

    def _tell_confirming(self) -> None:
        window = self.report.request.confirm
        text = f"adaptation {self.report.id} is done, and is watched for {window:g} s before it is final"
        revision = self.report.revision_after
        self.context.kit.event("adaptation.confirming", text, id=self.report.id, revision=revision, confirm=window)
        self.context.kit.set_status_text(f"revision {revision}, not final yet; {text}")


async def confirm(carrying: AdaptationRun, turns: Turn, finish: Callable[[AdaptationReport], object]) -> None:
    """Look at an adaptation repeatedly until it ends, and call ``finish`` with its report in the slot of that."""
    kit = carrying.context.kit
    until = kit.now() + carrying.report.request.confirm
    while True:
        await kit.sleep(min(LOOK_INTERVAL, max(0.0, until - kit.now())))
        async with turns.taken() as slot:
            carrying.context.touch = slot.touch
            report = await carrying.look(last=kit.now() >= until - NEARLY)
            if report is not None:
                finish(report)
                return
