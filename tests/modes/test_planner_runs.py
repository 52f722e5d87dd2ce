"""The mode planner is replaced, stopped, killed: its rules continue, and it sees what is so by then."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.manager import (
    CancelAdaptation,
    JournalPage,
    JournalRequest,
    UndoAdaptation,
)
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    CANCEL,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Add,
    ChangeState,
    EnterMode,
    Outcome,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import Transition
from tests.modes.in_memory import PLANNER, STACK, Director, entered, perform, running
from tests.modes.stacks import MODES, RULES
from tests.support.waiting import PATIENCE

CLASS = "regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner"
FAILS_AT, RECOVERS_AT = 1.0, 2.5
"""The laser's only failure, and its end."""
ONCE = STACK.replace("failures: 0", "failures: 1") + MODES + RULES
SLOWLY = ONCE.replace("mode: degraded\n", "mode: degraded\n    settle: 0.5\n")
"""It takes half a second of failure to degrade."""
AT_ONCE = ONCE.replace("mode: degraded\n", "mode: degraded\n    settle: 0\n")
LASTING = SLOWLY.replace("failures: 1", "failures: 1, recovers_after: 1000.0")
DEGRADED, NORMAL = ("degraded", "applied"), ("normal", "applied")


async def _swap(director: Director) -> None:
    await director.adapt(Swap(PLANNER))


async def _swap_without_state(director: Director) -> None:
    await director.adapt(Swap(PLANNER, with_state=False))


async def _rest(director: Director) -> None:
    await director.adapt(ChangeState(PLANNER, Transition.DEACTIVATE))
    await director.kit.sleep(0.1)
    await director.adapt(ChangeState(PLANNER, Transition.ACTIVATE))


async def _die(director: Director) -> None:
    director.kill(PLANNER)
    await director.kit.sleep(0.1)
    director.start(PLANNER)


CHANGES = [_swap, _swap_without_state, _rest, _die]
Way = Callable[[Director], Awaitable[None]]


@pytest.mark.parametrize("change", CHANGES)
def test_rules_continue_while_one_settles_and_after_it_has_entered_its_mode(tmp_path: Path, change: Way) -> None:
    async def script(director: Director) -> None:
        await director.until(FAILS_AT + 0.3)
        await change(director)  # while it settles
        await director.until(RECOVERS_AT - 0.2)
        assert (await director.modes()).actual == "degraded"
        await change(director)  # while the mode stands
        await director.until(RECOVERS_AT + 2.0)
        assert (await director.modes()).actual == "normal"

    with running(tmp_path, SLOWLY, script) as system:
        perform(system)
        assert entered(system) == [DEGRADED, NORMAL]
        assert not [event for event in system.events if event.kind == "modes.manual"]


@pytest.mark.parametrize("change", CHANGES)
def test_a_manual_change_is_known_by_the_next_run(tmp_path: Path, change: Way) -> None:
    """Without the state nothing is known of it: the mode counts as any that there was at the start."""

    async def script(director: Director) -> None:
        await director.until(FAILS_AT + 1.0)
        await director.adapt(EnterMode("normal"))
        await director.kit.sleep(0.5)
        await change(director)
        await director.kit.sleep(5.0)

    with running(tmp_path, LASTING, script) as system:
        perform(system)
        remembers = change in (_swap, _rest)
        assert entered(system) == [DEGRADED] if remembers else [DEGRADED, DEGRADED]


def test_rules_leave_a_system_alone_whose_first_mode_somebody_has_undone(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.until(FAILS_AT + 1.0)
        page = await director.kit.call(JOURNAL, JournalRequest(limit=1), JournalPage, timeout=PATIENCE)
        undo = UndoAdaptation(page.entries[0].id, actor="director")
        report = await director.kit.call("adaptation_manager/undo", undo, AdaptationReport, timeout=PATIENCE)
        assert report.outcome is Outcome.APPLIED, report
        assert (await director.modes()).target == ""
        await director.kit.sleep(5.0)

    with running(tmp_path, LASTING, script) as system:
        perform(system)
        assert entered(system) == [DEGRADED]
        assert [event.kind for event in system.events if event.kind == "modes.manual"] == ["modes.manual"]


async def _stop(director: Director, how: str, begin: float, end: float) -> None:
    await director.until(begin)
    if how == "dead":
        director.kill(PLANNER)
        await director.until(end)
        director.start(PLANNER)
    else:
        await director.adapt(ChangeState(PLANNER, Transition.DEACTIVATE))
        await director.until(end)
        await director.adapt(ChangeState(PLANNER, Transition.ACTIVATE))


@pytest.mark.parametrize("how", ["dead", "inactive"])
@pytest.mark.parametrize(
    ("begin", "end", "before", "after"),
    [
        (0.5, 2.0, [], [DEGRADED, NORMAL]),
        (0.5, 4.0, [], []),
        (2.0, 4.0, [DEGRADED], [DEGRADED, NORMAL]),
    ],
    ids=["a fault began", "a fault began and ended", "a fault ended"],
)
def test_it_sees_what_is_so_on_its_return(
    tmp_path: Path, how: str, begin: float, end: float, before: list[tuple[str, str]], after: list[tuple[str, str]]
) -> None:
    async def script(director: Director) -> None:
        await _stop(director, how, begin, end)
        assert await director.entered() == before
        await director.until(7.0)

    with running(
        tmp_path, ONCE.replace("rules:\n", "rules:\n").replace("because:", "settle: 0\n    because:"), script
    ) as system:
        perform(system)
        assert entered(system) == after
        assert not [event for event in system.events if event.kind == "modes.manual"]


EAGER = ONCE.replace(":ModePlanner'", ":ModePlanner', parameters: {manual_hold: 0.0}")
"""Modes that others enter are not left alone."""
BRIEF = EAGER.replace("failures: 1", "failures: 1, recovers_after: 0.2")


@pytest.mark.parametrize("how", ["dead", "inactive", "settling"])
def test_a_component_that_failed_and_recovered_unseen_is_brought_back_by_the_rule_that_holds(
    tmp_path: Path, how: str
) -> None:
    states = []

    async def script(director: Director) -> None:
        await director.adapt(EnterMode("normal"))
        if how != "settling":
            await _stop(director, how, 0.5, 4.0)
        else:
            await director.until(FAILS_AT + 0.6)
        states.append((await director.modes("laser")).state)
        await director.kit.sleep(2.5)
        states.append((await director.modes("laser")).state)
        assert (await director.modes()).actual == "normal"

    with running(tmp_path, BRIEF.replace("mode: degraded\n", "mode: degraded\n    settle: 0.5\n"), script) as system:
        perform(system)
        assert states == ["unconfigured", "active"]
        assert entered(system) == [NORMAL]


def test_a_mode_that_is_withdrawn_before_it_is_final_keeps_no_rule_from_entering_it(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        tried = AdaptationRequest((EnterMode("degraded"),), actor="director", confirm=30.0, wait=False)
        pending = await director.kit.call(ADAPT, tried, AdaptationReport, timeout=PATIENCE)
        await director.kit.sleep(0.2)
        await _die(director)
        await director.kit.sleep(0.2)  # the next run reads the mode that is not final
        cancelled = await director.kit.call(CANCEL, CancelAdaptation(pending.id), AdaptationReport, timeout=PATIENCE)
        assert cancelled.outcome is Outcome.CANCELLED, cancelled
        await director.until(FAILS_AT + 1.0)
        assert (await director.modes()).target == "degraded"

    careful = "modes:\n  degraded:\n    - {change: set_parameters, component: driver, parameters: {speed: 0.3}}\n"
    rule = RULES.partition("  recover:\n")[0]
    with running(tmp_path, EAGER.replace(MODES + RULES, careful + rule), script) as system:
        perform(system)
        assert entered(system) == [DEGRADED]


def test_a_mode_that_the_manager_enters_after_it_was_given_up_is_no_manual_one(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        held = AdaptationRequest((SetParameters("driver", {"careful": True}),), confirm=6.0, wait=False)
        await director.kit.call(ADAPT, held, AdaptationReport, timeout=PATIENCE)
        await director.until(5.5)
        assert await director.entered() == [], "the manager is busy"
        await director.until(9.0)
        assert (await director.modes()).target == "normal"

    impatient = ONCE.replace(":ModePlanner'", ":ModePlanner', parameters: {adapt_within: 0.5}")
    with running(tmp_path, impatient, script) as system:
        perform(system)
        assert entered(system) == [DEGRADED, NORMAL]
        assert not [event for event in system.events if event.kind == "modes.manual"]


SECOND = ComponentSpec(cls=CLASS)


@pytest.mark.parametrize("change", [Add("second", SECOND), Swap("lamp", CLASS)], ids=["added", "swapped"])
def test_a_second_decider_is_refused_in_the_check_and_the_first_goes_on(tmp_path: Path, change: Add | Swap) -> None:
    async def script(director: Director) -> None:
        report = await director.ask(change)
        assert report.outcome is Outcome.REJECTED, report
        (violation,) = [each for each in report.violations if each.field == "services.modes/decider"]
        both = " and ".join(map(repr, sorted((change.component, PLANNER))))
        assert f"a system has one component that decides on modes, not {both}: swap it" in violation.problem
        await director.until(RECOVERS_AT + 2.0)

    with running(tmp_path, ONCE, script) as system:
        perform(system)
        assert entered(system) == [DEGRADED, NORMAL]
        assert "second" not in system.host.processes
