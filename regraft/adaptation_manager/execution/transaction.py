"""Carries out a plan step by step, and undoes it in reverse if anything fails: all of it or nothing."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

from regraft.adaptation_manager.execution.perform import perform
from regraft.adaptation_manager.execution.restoration import begin_again, not_restored, wanted_again
from regraft.adaptation_manager.execution.tolerance import has_failed_down
from regraft.adaptation_manager.execution.verify import verify
from regraft.adaptation_manager.journal.journal import JournalError
from regraft.adaptation_manager.phases import Phases
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.steps.actions import (
    ApplyParameters,
    EndProcess,
    EndSuccessor,
    LeaveStopped,
    PlannedStep,
    Restore,
    RunProcess,
    StartAgain,
    StayDown,
)
from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.host_client import Update
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.model.adaptation import Outcome, Phase, StepReport, StepState
from regraft.patience import Patience

UNDO_INTERVAL = 0.05
"""Seconds between two attempts at undoing a step whose component does not answer."""

MAY_PASS = (None, ControlCode.TIMED_OUT)
"""Codes of failures that trying again may overcome: no answer, or a process that is just ending."""


OF_PROCESSES = (EndProcess, EndSuccessor, Restore, LeaveStopped, StartAgain)
"""Actions for which a component need not run."""


class CancelWanted(Exception):
    """Somebody cancelled the adaptation between two steps."""


@dataclass(slots=True)
class Transaction:
    """One adaptation under way.

    ``note`` makes the states of steps (by number) durable; ``commit`` makes the end durable, or, unless it is
    ``final``, that it only has to be confirmed. Either raises if it cannot, which undoes everything.
    """

    plan: Plan
    context: ExecutionContext
    note: Callable[[dict[int, StepState]], None]
    commit: Callable[[list[StepReport]], None]
    cancelled: Callable[[], bool]
    phases: Phases
    final: bool = True
    steps: list[StepReport] = field(default_factory=list)
    error: str = ""
    update: Update | None = None

    async def run(self) -> Outcome:
        """Do it; never raises. The first step is noted as started already."""
        self.steps = self.plan.reports()
        try:
            for index in range(len(self.steps)):
                self._check_cancelled()
                self.phases.enter(Phase.PREPARE if index < self.plan.preparing else Phase.COMMIT)
                await self._do(index)
            self._check_cancelled()
            self.phases.enter(Phase.VERIFY)
            await verify(self.plan, self.context, self.update or self._give_specs())
            self.phases.leave()
            self.commit(self.steps)
            return self.context.outcome if self.final else Outcome.CONFIRMING
        except CancelWanted:
            self.error = "cancelled"
            return await self._undo(Outcome.CANCELLED)
        except Exception as error:
            self.error = (
                str(error) if isinstance(error, ControlFailed | JournalError) else f"{type(error).__name__}: {error}"
            )
            if await self._was_never_ours(error):
                return Outcome.REJECTED
            return await self._undo(Outcome.ROLLED_BACK)

    async def settle(self) -> Outcome:
        """Make what only had to be confirmed final; undoes it if that cannot be written."""
        try:
            self.commit(self.steps)
            return self.context.outcome
        except JournalError as error:
            self.error = str(error)
            return await self._undo(Outcome.ROLLED_BACK)

    async def withdraw(self, outcome: Outcome, why: str) -> Outcome:
        """Undo what only had to be confirmed; ``outcome`` is what it ends as if that succeeds."""
        self.error = why
        return await self._undo(outcome)

    async def _was_never_ours(self, error: Exception) -> bool:
        """Return whether a later term held from the start: everybody refused, and would refuse undoing too."""
        if not _is_fenced(error) or any(step.state is StepState.DONE for step in self.steps):
            return False
        if self.update is None:
            return True
        processes, failures = await self.update.answers()
        return not processes and all(map(_is_fenced, failures.values()))

    def _check_cancelled(self) -> None:
        if self.cancelled():
            raise CancelWanted

    async def _do(self, index: int) -> None:
        number = index + 1
        if index > 0:
            self.note({number - 1: StepState.DONE, number: StepState.STARTED})
        began = time.monotonic()
        self._mark(index, StepState.STARTED)
        # Setting values is all or nothing, so the hosts have nothing to wait for after the last of them.
        overlapping = self.plan.only_gives_values and number == len(self.steps)
        try:
            await perform(self.context, self.plan.steps[index].do, self._give_specs if overlapping else None)
        except Exception as error:
            self._mark(index, StepState.FAILED, str(error), time.monotonic() - began)
            raise
        self._mark(index, StepState.DONE, "", time.monotonic() - began)

    def _give_specs(self) -> Update:
        self.update = self.context.hosts.begin_giving(self.plan.changes)
        return self.update

    def _mark(self, index: int, state: StepState, error: str = "", duration: float | None = None) -> None:
        step = self.steps[index]
        taken = step.duration if duration is None else duration
        self.steps[index] = replace(step, state=state, error=error or step.error, duration=taken)

    async def _undo(self, outcome: Outcome) -> Outcome:
        self.phases.leave()
        unreached = [each.component for each in self.plan.unreached]
        problems = await undo(self.context, self.plan.way_back(), self.plan.steps, self.steps, unreached)
        if problems:
            self.error = f"{self.error}; could not be undone: {'; '.join(problems)}"
            return Outcome.STUCK
        return outcome


def _is_fenced(error: Exception) -> bool:
    return isinstance(error, ControlFailed) and error.code is ControlCode.FENCED


async def undo(
    context: ExecutionContext,
    former: UpdateSpecs,
    planned: tuple[PlannedStep, ...],
    steps: list[StepReport],
    unreached: Collection[str] = (),
) -> list[str]:
    """Undo the begun ones of ``steps`` in reverse; returns what could not be undone, in words. Updates ``steps``.

    Hosts get the former specs first: a component that restarts from here on is as before, and an added one does not
    restart. Those on a host that is not there are noted as out of reach. Those that were ``unreached`` have no step
    that brings them back; if they are back, they begin again. In the end the components are read back: this, not their
    answers, shows what was undone.
    """
    problems = []
    context.revision = context.before.revision
    if any(isinstance(step.do, RunProcess) for step in planned):
        former = replace(former, undoes=context.after.revision)
    with contextlib.suppress(ControlFailed):  # giving them the specs reports that they do not answer
        await context.refresh()
    unknown = _unknown_at_home(context)
    try:
        await _give(context, former)
        await context.refresh()
    except ControlFailed as error:
        names = sorted({*(spec.name for spec in former.specs), *former.removed})
        problems.append(f"the former specs of {', '.join(names)}: {error}")
    for index in range(len(planned) - 1, -1, -1):
        step = steps[index]
        if step.state not in (StepState.STARTED, StepState.DONE, StepState.FAILED):
            continue
        problem = await _undo_step(context, planned[index], step.state)
        context.note_reach(step.component)
        state = StepState.UNDO_FAILED if problem else StepState.UNDONE
        steps[index] = replace(step, state=state, error="; ".join(filter(None, (step.error, problem))))
        if problem:
            problems.append(f"{step.component}: {step.action}: {problem}")
    back = {s.component for s in planned if isinstance(s.undo, EndProcess)} & context.before.components.keys()
    if back or unknown:
        problems += await _give_home(context, former, sorted(back | unknown))
    changed = {spec.name for spec in former.specs} & context.after.components.keys()
    later = changed.intersection(unreached) - _brought_back(planned, steps)
    if context.out_of_reach:
        problems += await _give_missed(context, former)
        later |= changed & _passed_over(context, planned)
    problems += await begin_again(context, later)
    return problems + await _read_back(context, planned, steps)


def _brought_back(planned: tuple[PlannedStep, ...], steps: list[StepReport]) -> set[str]:
    """Return the components whose steps bring back what was before, or had not begun.

    To leave a silent component down has no inverse: its host may have started it by the later spec since.
    """
    return {
        step.component
        for step, report in zip(planned, steps, strict=True)
        if report.state is StepState.PLANNED or not isinstance(step.do, StayDown)
    }


async def _read_back(context: ExecutionContext, planned: tuple[PlannedStep, ...], steps: list[StepReport]) -> list[str]:
    """Return where components are not as they were before; a step that was undone for nothing is marked as such."""
    undone = [step for step, report in zip(planned, steps, strict=True) if report.state is StepState.UNDONE]
    wanted = wanted_again(context, undone)
    for name in context.left_down & wanted.keys():
        wanted[name].pop("state", None)
    wrong = await not_restored(context, wanted)
    for index, step in enumerate(steps):
        if step.state is StepState.UNDONE and step.component in wrong:
            error = "; ".join(filter(None, (step.error, f"read back: {wrong[step.component]}")))
            steps[index] = replace(step, state=StepState.UNDO_FAILED, error=error)
    return [f"read back: {difference}" for difference in wrong.values()]


async def _give(context: ExecutionContext, former: UpdateSpecs) -> None:
    """Give hosts the former specs; one that is found to be gone learns of them when it joins. Raises ControlFailed.

    The last attempt begins after the bound: a single wait for an answer may be longer, and a host be gone since.
    """
    patience = Patience(context.bounds.undo)
    while True:
        is_last = patience.is_over()
        try:
            await context.hosts.give(former)
            return
        except ControlFailed as error:
            if error.code is not None or is_last:
                raise
        await context.pause(UNDO_INTERVAL)
        await context.refresh()


def _unknown_at_home(context: ExecutionContext) -> set[str]:
    """Return removed components that their hosts do not know: those hosts have joined again since, without them."""
    before = context.before.components
    return {
        name
        for name in before.keys() - context.after.components.keys()
        if context.hosts.is_there(home := before[name].host)
        and home not in context.hosts.silent
        and home not in context.hosts.which_know(name)
    }


async def _give_home(context: ExecutionContext, former: UpdateSpecs, names: list[str]) -> list[str]:
    """Give components to their hosts again, which were to forget them or have never heard of them.

    Those that are there start them; returns why that failed.
    """
    try:
        await _give(context, former)
        for name in names:
            home = context.before.components[name].host
            if context.hosts.is_there(home):
                await context.hosts.start(name, home, resume=True)
    except ControlFailed as error:
        return [f"the former specs of {', '.join(names)}: {error}"]
    return []


async def _give_missed(context: ExecutionContext, former: UpdateSpecs) -> list[str]:
    """Give the former specs again, since a host may have fallen silent after it took them; returns why that failed.

    Such a host has to join again, as it missed specs. A component there has kept the change, and begins again then.
    """
    try:
        await _give(context, former)
        await context.refresh()
    except ControlFailed as error:
        return [f"the former specs of {', '.join(sorted(context.out_of_reach))}: {error}"]
    return []


def _passed_over(context: ExecutionContext, planned: tuple[PlannedStep, ...]) -> set[str]:
    """Return the components whose steps were undone without being performed: their hosts may be back by now."""
    return {
        step.component
        for step in planned
        if step.component in context.out_of_reach and not isinstance(step.undo, OF_PROCESSES)
    }


async def _undo_step(context: ExecutionContext, step: PlannedStep, state: StepState) -> str:
    """Undo one step, trying again until the bound, as ``_give`` does; returns why that failed, empty if it did not."""
    patience = Patience(context.bounds.undo)
    while True:
        is_last = patience.is_over()
        if context.controls.living(step.component) is None and not isinstance(step.undo, OF_PROCESSES):
            # Nothing of the step is left: if the process starts again, it does so from the former specs. On
            # a host that is not there it may still run: it begins again as that host joins again.
            return ""
        try:
            await perform(context, step.undo)
            return ""
        except ControlFailed as error:
            if isinstance(error, NoAnswer) and not error.gone and _is_queued(step, state):
                return ""
            if await has_failed_down(context, step, error):
                return ""
            if error.code not in MAY_PASS or is_last:
                return str(error)
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        await context.pause(UNDO_INTERVAL)
        try:
            await context.refresh()
        except ControlFailed as error:
            if patience.is_over():
                return str(error)


def _is_queued(step: PlannedStep, state: StepState) -> bool:
    """Return whether a hung component has both the step and its inverse before it, and needs no more."""
    return isinstance(step.do, ApplyParameters) and state is not StepState.DONE
