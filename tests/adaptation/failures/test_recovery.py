"""A manager killed half-way leaves nothing half-done behind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.journal.journal import Journal
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.system import System
from tests.support.waiting import wait_until

VALUES: tuple[Change, ...] = (SetParameters("listener", {"gain": 0.9}), SetParameters("fragile", {"level": 3}))
CHANGES: tuple[Change, ...] = (
    SetParameters("listener", {"gain": 0.9}),
    Connect("listener", "heard", "others"),
    ChangeState("fragile", Transition.DEACTIVATE),
)
POINTS_OF_VALUES = [
    *[(name, 1, when) for name in ("begin", "progress", "begin_giving") for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2) for when in ("before", "after")],
    ("end", 1, "before"),
]
POINTS = [
    *[("begin", call, when) for call in (1,) for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2, 3) for when in ("before", "after")],
    *[("progress", call, when) for call in (1, 2) for when in ("before", "after")],
    *[("begin_giving", call, when) for call in (1,) for when in ("before", "after")],
    ("end", 1, "before"),
]

PROCESSES: tuple[Change, ...] = (
    SetParameters("listener", {"gain": 0.9}),
    Add("newcomer", ComponentSpec(cls="tests.adaptation.parts:Newcomer"), (TopicSpec("fresh", "regraft/Twist"),)),
    Remove("second"),
)
POINTS_OF_PROCESSES = [
    *[("begin", 1, when) for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2, 3, 4) for when in ("before", "after")],
    *[("start", 1, when) for when in ("before", "after")],
    *[("progress", call, when) for call in (1, 2, 3) for when in ("before", "after")],
    *[("begin_giving", call, when) for call in (1, 2) for when in ("before", "after")],
    ("end", 1, "before"),
]


def dying(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, call: int, when: str) -> None:
    """Make the manager's process die before or after a call of a method, the ``call``-th time."""
    real: Callable[..., Any] = getattr(owner, name)
    count = 0

    def is_time() -> bool:
        nonlocal count
        count += 1
        return count == call

    async def die_async(*arguments: Any, **named: Any) -> Any:
        time_has_come = is_time()
        if time_has_come and when == "before":
            raise SystemExit
        result = await real(*arguments, **named)
        if time_has_come:
            raise SystemExit
        return result

    def die(*arguments: Any) -> Any:
        time_has_come = is_time()
        if time_has_come and when == "before":
            raise SystemExit
        result = real(*arguments)
        if time_has_come:
            raise SystemExit
        return result

    monkeypatch.setattr(owner, name, die_async if name in ("perform", "start", "stop", "succeed", "let_speak") else die)


def dying_at(
    system: System, monkeypatch: pytest.MonkeyPatch, changes: tuple[Change, ...], name: str, call: int, when: str
) -> AdaptationReport:
    """Adapt with a manager that dies half-way, and start the next one; returns the first answer."""
    owner = {"perform": transaction, "begin_giving": Hosts, "start": Hosts}.get(name, Journal)
    with monkeypatch.context() as patch:
        dying(patch, owner, name, call, when)
        pending = system.adapt(*changes, wait=False)
        wait_until(lambda: not system.running["manager"].thread.is_alive())
    system.start_manager()
    return pending


def _interrupted(
    system: System, monkeypatch: pytest.MonkeyPatch, changes: tuple[Change, ...], name: str, call: int, when: str
) -> None:
    """Adapt with a manager that dies half-way, and check what the next one makes of it."""
    before = system.views()
    pending = dying_at(system, monkeypatch, changes, name, call, when)
    lines = system.lines().entries
    assert system.views() == before
    assert system.host.specs.keys() == system.architecture.components.keys()
    assert system.host.processes.keys() == system.architecture.components.keys()
    assert system.host.architecture.topics == system.architecture.topics
    for component in ("listener", "fragile"):
        assert system.host.specs[component] == system.architecture.components[component]
    if (name, when) == ("begin", "before"):
        assert len(lines) == 1
    else:
        assert (lines[0].id, lines[0].outcome) == (pending.id, Outcome.ROLLED_BACK)
        assert lines[0].error == "interrupted: the manager was restarted"
    assert system.adapt(*changes).outcome is Outcome.APPLIED


@pytest.mark.parametrize(("name", "call", "when"), POINTS)
def test_an_interrupted_adaptation_is_undone_on_return(
    system: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    _interrupted(system, monkeypatch, CHANGES, name, call, when)


@pytest.mark.parametrize(("name", "call", "when"), POINTS_OF_VALUES)
def test_an_interrupted_setting_of_parameters_is_undone_on_return(
    system: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    _interrupted(system, monkeypatch, VALUES, name, call, when)


@pytest.mark.parametrize(("name", "call", "when"), POINTS_OF_PROCESSES)
def test_an_interrupted_addition_and_removal_are_undone_on_return(
    system: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    second = system.running["second"]
    _interrupted(system, monkeypatch, PROCESSES, name, call, when)
    assert second.runtime.assignment.incarnation == 1
    assert system.view("newcomer").state is State.ACTIVE
    assert "second" not in system.host.processes


@pytest.mark.parametrize(("owner", "name", "when"), [(Journal, "end", "after"), (Hosts, "stop", "before")])
def test_what_was_removed_ends_even_if_the_manager_dies_right_after(
    system: System, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, when: str
) -> None:
    with monkeypatch.context() as patch:
        dying(patch, owner, name, 1, when)
        pending = system.adapt(*PROCESSES, wait=False)
        wait_until(lambda: not system.running["manager"].thread.is_alive())
    assert "second" in system.running
    system.start_manager()
    (line,) = system.lines(id=pending.id).entries
    assert line.outcome is Outcome.APPLIED
    wait_until(lambda: "second" not in system.host.processes)
    assert "second" not in system.running
    assert system.view("newcomer").state is State.ACTIVE


def test_an_adaptation_whose_end_was_written_stands(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        dying(patch, Journal, "end", 1, "after")
        pending = system.adapt(*CHANGES, wait=False)
        wait_until(lambda: not system.running["manager"].thread.is_alive())
    system.start_manager()
    (line,) = system.lines(id=pending.id).entries
    assert line.outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == 0.9
    report: AdaptationReport = system.adapt(SetParameters("listener", {"gain": 0.8}))
    assert report.revision_before == 2


@pytest.mark.parametrize("own_journals", [False, True], ids=["one-journal", "own-journals"])
def test_an_old_manager_is_fenced(system: System, own_journals: bool) -> None:
    journal = "" if own_journals else str(system.journal)
    services = {
        name: name.replace("adaptation_manager", "old_manager")
        for name in (
            "adaptation_manager/adapt",
            "adaptation_manager/undo",
            "adaptation_manager/cancel",
        )
    }
    system.running["manager"].kill()
    services |= {f"adaptation_manager/{name}": f"old_manager/{name}" for name in ("journal", "architecture")}
    system.start_manager("old", services, journal=journal)
    assert (
        system.adapt(SetParameters("listener", {"gain": 0.1}), service="old_manager/adapt").outcome is Outcome.APPLIED
    )
    system.start_manager("new", journal=journal)
    assert system.adapt(SetParameters("listener", {"gain": 0.2})).outcome is Outcome.APPLIED
    report = system.adapt(SetParameters("listener", {"gain": 0.3}), service="old_manager/adapt")
    assert report.outcome is Outcome.REJECTED
    assert "term" in report.violations[0].problem
    assert system.view("listener").parameters["gain"] == 0.2
