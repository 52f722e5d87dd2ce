"""However an adaptation comes to nothing, what runs afterwards is what the architecture says; if not, that is told."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import pytest

from regraft import CallFailed
from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.adaptation_manager.steps.actions import ApplyParameters, Restore
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.messages.management.manager import ArchitectureRequest, JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Change,
    ChangeState,
    Connect,
    Outcome,
    SetParameters,
    StepState,
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.failures.test_recovery import dying
from tests.adaptation.system import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

SWAP = Swap("listener", parameters={"gain": 0.9})
"""The incumbent's assignment leaves the gain open."""
LONG = 60.0
UNDER_WAY = (Outcome.PENDING, Outcome.CONFIRMING)
Patch = pytest.MonkeyPatch


def told(system: System) -> dict[str, tuple[Any, ...]]:
    """Return the state, values and connections of every component as the manager's architecture has them."""
    now = system.client.call("adaptation_manager/architecture", ArchitectureRequest(), Architecture)
    found = {}
    for name, spec in now.components.items():
        described = spec.description
        assert described is not None
        values = {p.name: spec.parameters.get(p.name, p.default) for p in described.parameters}
        found[name] = (spec.state, values, {port.name: spec.connections[port.name] for port in described.ports})
    return found


def runs(system: System) -> dict[str, tuple[Any, ...]]:
    """Return the same as the components tell it, but connections only of those that have any."""
    return {name: view[1:] for name, view in system.views().items()}


def as_told(system: System) -> bool:
    now = runs(system)
    for name, (state, values, connections) in told(system).items():
        wired = {} if state is State.UNCONFIGURED else connections
        found = {port: topic for port, topic in now[name][2].items() if port in wired}
        if (now[name][0], now[name][1], found) != (state, values, wired):
            return False
    return True


def line(system: System, adaptation: str) -> AdaptationReport:
    return system.lines(id=adaptation).entries[0]


def ended(system: System, pending: AdaptationReport) -> AdaptationReport:
    wait_until(lambda: line(system, pending.id).outcome not in UNDER_WAY, "the end of the adaptation")
    return line(system, pending.id)


# --- the ways to come to nothing ---


def cancelled(system: System, patch: Patch, *changes: Change) -> AdaptationReport:
    pending = system.adapt(*changes, wait=False, confirm=LONG)
    wait_until(lambda: line(system, pending.id).outcome is not Outcome.PENDING, "the time to confirm")
    if line(system, pending.id).outcome is Outcome.CONFIRMING:
        system.cancel(pending.id)
    return ended(system, pending)


def without_room(system: System, patch: Patch, *changes: Change) -> AdaptationReport:
    def full(self: Journal, report: object) -> None:
        raise JournalError("database or disk is full")

    with patch.context() as now:
        now.setattr(Journal, "end", full)
        return system.adapt(*changes)


def failing(system: System, patch: Patch, *changes: Change) -> AdaptationReport:
    return system.adapt(*changes, SetParameters("fragile", {"level": 3}))


def interrupted(name: str, call: int, when: str) -> Callable[..., AdaptationReport]:
    """Return a way: the manager dies before or after the ``call``-th call of a method, and comes back."""

    def end(system: System, patch: Patch, *changes: Change) -> AdaptationReport:
        owner: Any = {"perform": transaction, "begin_giving": Hosts}.get(name, Journal)
        with patch.context() as now:
            dying(now, owner, name, call, when)
            pending = system.adapt(*changes, wait=False)
            manager = system.running["manager"].thread
            wait_until(lambda: not manager.is_alive() or has_ended(system, pending), "the manager to die, or the end")
        if not manager.is_alive():
            system.start_manager()
        return ended(system, pending)

    return end


def has_ended(system: System, pending: AdaptationReport) -> bool:
    """Tell whether an adaptation is over; a manager that dies as it is asked does not say."""
    try:
        page = system.client.call("adaptation_manager/journal", JournalRequest(id=pending.id), JournalPage, 1.0)
    except CallFailed:
        return False
    return page.entries[0].outcome not in UNDER_WAY


WAYS: dict[str, Callable[..., AdaptationReport]] = {
    "cancelled": cancelled,
    "without_room": without_room,
    "failing": failing,
    "interrupted": interrupted("perform", 2, "after"),
}


@pytest.mark.parametrize("way", WAYS)
def test_values_of_a_swap_that_comes_to_nothing_are_gone_with_it(system: System, monkeypatch: Patch, way: str) -> None:
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    system.adapt(SetParameters("listener", {"gain": 0.7}))
    before, run = runs(system), system.running["listener"]
    report = WAYS[way](system, monkeypatch, SWAP)
    assert report.outcome in (Outcome.CANCELLED, Outcome.ROLLED_BACK), report
    assert {step.state for step in report.steps} == {StepState.UNDONE}
    assert system.running["listener"] is run
    assert runs(system) == before
    assert as_told(system)


# --- an undo that does nothing is found ---


@pytest.mark.parametrize(
    ("skipped", "changes"),
    [
        (ApplyParameters, (SetParameters("listener", {"gain": 0.9}),)),
        (Restore, (SWAP,)),
    ],
    ids=["values", "swap"],
)
@pytest.mark.parametrize("way", ["failing", "interrupted"])
def test_what_is_not_as_before_is_told_as_a_difference_and_never_as_undone(
    bare_system: System, monkeypatch: Patch, skipped: type, changes: tuple[Change, ...], way: str
) -> None:
    system = bare_system
    system.start_manager(answer_within=0.4, bind_within=1.0, undo_within=0.3)
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    real: Callable[..., Any] = vars(transaction)["perform"]
    undoing: list[bool] = []

    async def read(*given: Any) -> list[str]:
        undoing.append(True)
        return await undo(*given)

    async def perform(site: Any, action: Any, meanwhile: Any = None) -> None:
        if not (undoing and isinstance(action, skipped) and action.component == "listener"):  # type: ignore[attr-defined]
            await real(site, action, meanwhile)

    undo = transaction.undo
    with monkeypatch.context() as patch:
        patch.setattr("regraft.adaptation_manager.execution.transaction.undo", read)
        patch.setattr("regraft.adaptation_manager.execution.recovery.undo", read)
        patch.setattr("regraft.adaptation_manager.execution.transaction.perform", perform)
        report = WAYS[way](system, patch, *changes, SetParameters("talker", {"rate": 150.0}))
    assert report.outcome is Outcome.STUCK, report
    assert "listener: parameters.gain is 0.9, should be 0.5" in report.error
    states = {step.component: step.state for step in report.steps}
    assert states["listener"] is StepState.UNDO_FAILED
    assert states["talker"] is not StepState.UNDO_FAILED
    assert system.view("talker").parameters["rate"] == 200.0


# --- whatever is asked, and however it ends ---


def some_change(chance: random.Random) -> Change:
    name = chance.choice(("listener", "second"))
    return chance.choice(
        (
            SetParameters(name, {"gain": round(chance.random(), 2)}),
            SetParameters("talker", {"rate": float(chance.randint(20, 190))}),
            Connect(name, chance.choice(("heard", "hint")), chance.choice(("numbers", "others", "hints"))),
            ChangeState(name, chance.choice((Transition.ACTIVATE, Transition.DEACTIVATE))),
            Swap(name, parameters=chance.choice(({}, {"gain": round(chance.random(), 2)}, {"label": "fancy"}))),
            Swap("fragile"),
        )
    )


def some_way(chance: random.Random) -> Callable[..., AdaptationReport]:
    when, call = chance.choice(("before", "after")), chance.randint(1, 5)
    dies = interrupted(*chance.choice((("perform", call, when), ("progress", call, when), ("begin_giving", 1, when))))
    return chance.choice((cancelled, without_room, failing, dies, lambda system, _, *changes: system.adapt(*changes)))


@pytest.mark.parametrize("seed", range(8))
def test_what_runs_equals_the_architecture_whatever_was_asked_and_however_it_ended(
    system: System, monkeypatch: Patch, seed: int
) -> None:
    chance = random.Random(seed)
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    for _ in range(6):
        changes = [some_change(chance) for _ in range(chance.randint(1, 3))]
        report = some_way(chance)(system, monkeypatch, *changes)
        assert report.outcome is not Outcome.STUCK, (changes, report)
        assert as_told(system), (changes, report, told(system), runs(system))
