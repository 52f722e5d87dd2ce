"""Components are swapped while the system runs: another run goes on where the one before stopped, or nothing is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.journal.journal import Journal
from regraft.adaptation_manager.manager import AdaptationManager
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    StepState,
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Fragile
from tests.adaptation.system import SYSTEM, System, spec_of, started
from tests.adaptation.test_recovery import dying
from tests.handover.parts import Ask, Item, Report, Sink, Source, Totaller
from tests.support.threads import ComponentThread
from tests.support.waiting import PATIENCE, wait_until

ITEM = "handover_tests/Item"
NOTHING = (0, 0, 0, 0)


def _cls(name: str, module: str = "tests.adaptation.swappable") -> str:
    return f"{module}:{name}"


DOUBLER = Swap("totaller", _cls("Doubler", "tests.handover.parts"))
SERVICES = ("count", "ponder", "configured", "walk", "nap", "hurry")
ANOTHER = ComponentSpec(
    cls=_cls("Totaller", "tests.handover.parts"),
    connections={"totals": "more"},
    services={name: f"another/{name}" for name in SERVICES},
)


def _architecture() -> Architecture:
    totaller = spec_of("totaller", Totaller, parameters={"offset": 3})
    wired = {port: topic for port, topic in totaller.connections.items() if port != "config"}
    specs = [
        spec_of("source", Source, parameters={"rate": 500.0}),
        replace(totaller, connections=wired),
        spec_of("sink", Sink),
        spec_of("fragile", Fragile, connections={"heard": "numbers"}),
    ]
    topics = {name: TopicSpec(name, ITEM) for name in ("items", "totals", "others", "more")}
    topics["numbers"] = TopicSpec("numbers", "regraft/Twist")
    return Architecture(SYSTEM, 1, False, {spec.name: spec for spec in specs}, topics)


@pytest.fixture
def site(tmp_path: Path) -> Iterator[System]:
    """A source, a totaller that adds up what it says, a sink that checks, and a manager."""
    with started(_architecture(), tmp_path) as system:
        system.start_manager()
        _hears_on(system)
        yield system


def _report(system: System) -> Report:
    return system.client.call("report", Ask(), Report, PATIENCE)


def _hears_on(system: System, count: int = 20) -> None:
    goal = _report(system).heard + count
    wait_until(lambda: _report(system).heard >= goal)


def _faults(system: System) -> tuple[int, int, int, int]:
    """Return how many items were lost, doubled, disordered and wrong until now."""
    last = system.client.call("say", Ask(), Item, PATIENCE).number
    wait_until(lambda: _report(system).last >= last)
    report = _report(system)
    return report.lost, report.doubled, report.disordered, report.wrong


def _all_is_well(system: System) -> None:
    _hears_on(system)
    assert _faults(system) == NOTHING


def _runs(system: System) -> list[int]:
    """Return the runs of the totaller that have not ended."""
    return [
        started_as for (name, started_as), run in system.runs.items() if name == "totaller" and run.thread.is_alive()
    ]


def _as_before(system: System, run: ComponentThread, views: dict[str, tuple[Any, ...]]) -> None:
    """Check that the same process speaks, with the same values and connections, and that nobody missed anything."""
    assert system.running["totaller"] is run
    after = system.views()
    assert {name: view[1:] for name, view in after.items()} == {name: view[1:] for name, view in views.items()}
    assert {n: v[0] for n, v in after.items() if n != "totaller"} == {
        n: v[0] for n, v in views.items() if n != "totaller"
    }
    assert (len(_runs(system)), system.host.beside) == (1, {})
    assert system.host.specs == system.architecture.components
    _all_is_well(system)


# --- what goes on ---


def test_another_class_goes_on_from_the_state_and_nothing_is_missed(site: System) -> None:
    report = site.adapt(DOUBLER)
    assert report.outcome is Outcome.APPLIED, report
    assert [step.action for step in report.steps] == [
        "start tests.handover.parts:Doubler beside it",
        "hand over to tests.handover.parts:Doubler",
    ]
    view = site.view("totaller")
    assert (view.state, view.revision, view.parameters["offset"]) == (State.ACTIVE, 2, 3)
    assert site.client.call("double", Ask(21), Item, PATIENCE) == Item(42)
    assert site.host.specs["totaller"].cls == DOUBLER.cls
    assert site.host.specs["totaller"].restart == site.architecture.components["totaller"].restart
    assert (_runs(site), site.host.beside) == ([2], {})
    _all_is_well(site)


def test_values_and_connections_that_both_have_are_kept_and_others_are_as_the_class_has_them(site: System) -> None:
    site.adapt(SetParameters("totaller", {"offset": 4}))
    report = site.adapt(Swap("totaller", _cls("Counting"), {"label": "fancy"}, {"spare": "others"}))
    assert report.outcome is Outcome.APPLIED, report
    view = site.view("totaller")
    assert (view.parameters["offset"], view.parameters["label"]) == (4, "fancy")
    assert view.connections == {"items": "items", "spare": "others", "totals": "totals", "config": "config"}
    assert site.host.specs["totaller"].connections == {"items": "items", "spare": "others", "totals": "totals"}
    assert site.client.call("configured", Ask(), Item, PATIENCE) == Item(1, 4)
    _all_is_well(site)


def test_the_same_class_is_swapped_for_what_is_fixed_when_it_starts(site: System) -> None:
    assert site.adapt(Swap("totaller", _cls("Counting"))).outcome is Outcome.APPLIED
    report = site.adapt(Swap("totaller", parameters={"label": "fancy"}))
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("totaller").parameters["label"] == "fancy"
    _all_is_well(site)


def test_a_state_is_converted_by_a_class_that_can_or_left_behind_if_so_wanted(site: System) -> None:
    rejected = site.adapt(Swap("totaller", _cls("Newer", "tests.handover.parts")))
    assert rejected.outcome is Outcome.REJECTED
    assert [v.field for v in rejected.violations] == ["with_state"]
    assert "version 1" in rejected.violations[0].problem
    assert site.adapt(Swap("totaller", _cls("Second"))).outcome is Outcome.APPLIED
    _all_is_well(site)
    rejected = site.adapt(DOUBLER)
    assert rejected.outcome is Outcome.REJECTED
    report = site.adapt(Swap("totaller", DOUBLER.cls, with_state=False))
    assert report.outcome is Outcome.APPLIED, report
    _hears_on(site)
    assert _faults(site) == (0, 0, 0, 1)  # the total began anew, once


def test_whoever_cannot_say_its_state_is_swapped_without_it(site: System) -> None:
    assert site.adapt(Swap("totaller", _cls("Mute"))).outcome is Outcome.APPLIED
    with_state = site.adapt(DOUBLER)
    assert (with_state.outcome, "cannot say how I am" in with_state.error) == (Outcome.ROLLED_BACK, True), with_state
    without = site.adapt(replace(DOUBLER, with_state=False))
    assert without.outcome is Outcome.APPLIED, without
    assert site.client.call("double", Ask(21), Item, PATIENCE) == Item(42)


@pytest.mark.parametrize("many", [True, False])
def test_a_state_that_is_too_large_to_hand_over_rolls_back_and_nothing_is_lost(site: System, many: bool) -> None:
    assert site.adapt(Swap("totaller", _cls("Hoarder"), {"many": many})).outcome is Outcome.APPLIED
    report = site.adapt(Swap("totaller", _cls("Counting")))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "64 MB" in report.error
    _all_is_well(site)


@pytest.mark.parametrize(
    "changes",
    [
        (SetParameters("totaller", {"offset": 4}), DOUBLER),
        (DOUBLER, SetParameters("totaller", {"offset": 4})),
        (Connect("totaller", "config", "others"), DOUBLER),
        (DOUBLER, Connect("totaller", "config", "others")),
        (DOUBLER, Add("second", ANOTHER)),
        (Remove("fragile"), DOUBLER),
        (DOUBLER, Swap("fragile", parameters={"level": 3})),
    ],
)  # fmt: skip
def test_with_other_changes_in_one_adaptation(site: System, changes: tuple[Change, ...]) -> None:
    report = site.adapt(*changes)
    assert report.outcome is Outcome.APPLIED, report
    assert site.host.specs["totaller"].cls == DOUBLER.cls
    _all_is_well(site)
    undone = site.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert site.host.specs["totaller"].cls == site.architecture.components["totaller"].cls
    assert site.view("totaller").parameters["offset"] == 3
    _all_is_well(site)


def test_what_is_inactive_stays_so(site: System) -> None:
    report = site.adapt(ChangeState("fragile", Transition.DEACTIVATE), Swap("fragile", parameters={"level": 2}))
    assert report.outcome is Outcome.APPLIED, report
    view = site.view("fragile")
    assert (view.state, view.parameters["level"]) == (State.INACTIVE, 2)
    assert site.host.specs["fragile"].state is State.INACTIVE
    assert site.adapt(ChangeState("fragile", Transition.ACTIVATE)).outcome is Outcome.APPLIED


def test_what_is_unconfigured_is_swapped_for_one_that_is(site: System) -> None:
    site.adapt(ChangeState("fragile", Transition.DEACTIVATE), ChangeState("fragile", Transition.CLEANUP))
    report = site.adapt(Swap("fragile", parameters={"level": 2}))
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("fragile").state is State.UNCONFIGURED
    assert site.view("fragile").parameters["level"] == 2


def test_what_is_configured_in_the_same_adaptation_is_swapped_then(site: System) -> None:
    site.adapt(ChangeState("fragile", Transition.DEACTIVATE), ChangeState("fragile", Transition.CLEANUP))
    swap = Swap("fragile", parameters={"level": 2})
    report = site.adapt(ChangeState("fragile", Transition.CONFIGURE), swap)
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("fragile").state is State.INACTIVE


# --- what cannot be ---


def test_all_that_is_wrong_is_said_at_once_and_nothing_is_touched(site: System) -> None:
    before = site.views()
    site.adapt(SetParameters("totaller", {"offset": 900}))
    report = site.adapt(
        Swap("totaller", _cls("Counting"), {"colour": 1}, {"items": "numbers", "nothing": "items"}, {"gone": "x"}),
        Swap("sink", "no.such.module:Nobody"),
        Swap("fragile", _cls("Needy")),
        Swap("nobody", DOUBLER.cls),
        SetParameters("source", {"rate": -1.0}),
    )
    assert report.outcome is Outcome.REJECTED
    assert {(v.change, v.component, v.field) for v in report.violations} >= {
        (0, "totaller", "parameters.colour"),
        (0, "totaller", "parameters.offset"),
        (0, "totaller", "connect.items"),
        (0, "totaller", "connect.nothing"),
        (0, "totaller", "services.gone"),
        (1, "sink", "class"),
        (2, "fragile", "connect.more"),
        (3, "nobody", "component"),
        (4, "source", "parameters.rate"),
    }, report.violations
    after = site.views()
    assert after.pop("totaller")[2]["offset"] == 900
    assert after == {name: view for name, view in before.items() if name != "totaller"}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ((DOUBLER, Swap("totaller")), "swapped twice"),
        ((DOUBLER, Remove("totaller")), "leave that out"),
        ((Remove("fragile"), Swap("fragile")), "removed earlier"),
        ((DOUBLER, SetParameters("totaller", {"offset": 4}), Swap("totaller", parameters={"offset": 5})), "twice"),
        ((Swap("totaller", DOUBLER.cls, {"offset": 4}), SetParameters("totaller", {"offset": 5})), "earlier in the"),
        ((Add("new", ComponentSpec(cls=_cls("Second"))), Swap("new", DOUBLER.cls)), "is added in the same request"),
        ((SetParameters("totaller", {"volume": 4}), DOUBLER), "no such parameter"),
        ((Connect("totaller", "elsewhere", "items"), DOUBLER), "no port 'elsewhere'"),
    ],
)
def test_contradictions_are_rejected(site: System, changes: tuple[Change, ...], text: str) -> None:
    report = site.adapt(*changes)
    assert report.outcome is Outcome.REJECTED, report
    assert any(text in violation.problem for violation in report.violations), report.violations


def test_the_manager_is_not_swapped_and_why(site: System) -> None:
    site.running.pop("manager").kill()
    site.host.specs["manager"] = spec_of("manager", AdaptationManager)
    site.journal.unlink()
    site.start_manager()
    site.host.started("manager", 1)
    report = site.adapt(Swap("manager"))
    assert "it carries out the swap" in report.violations[0].problem


# --- what fails on the way ---


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        (_cls("Broken"), "not like this"),
        (_cls("Lame"), "cannot get up"),
        (_cls("Unable", "tests.handover.parts"), "not this one"),
    ],
)
def test_a_successor_that_cannot_go_on_leaves_everything_as_it_was(site: System, cls: str, text: str) -> None:
    run, before = site.running["totaller"], site.views()
    report = site.adapt(Swap("totaller", cls))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert text in report.error
    _as_before(site, run, before)
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    _all_is_well(site)


def test_a_later_failure_hands_the_living_state_back_to_the_process_of_before(site: System) -> None:
    site.adapt(SetParameters("fragile", {"mood": "refuses"}))
    run, before = site.running["totaller"], site.views()
    report = site.adapt(DOUBLER, SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert [step.state for step in report.steps] == [StepState.UNDONE] * 3
    site.architecture = site.host.architecture
    assert site.running["totaller"] is run
    after = site.views()
    assert {name: view[1:] for name, view in after.items()} == {name: view[1:] for name, view in before.items()}
    _all_is_well(site)
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    _all_is_well(site)


def test_undoing_a_swap_is_refused_where_a_later_adaptation_has_decided_otherwise(site: System) -> None:
    swapped = site.adapt(DOUBLER)
    later = site.adapt(SetParameters("totaller", {"offset": 4}))
    refused = site.undo(swapped.id)
    assert refused.outcome is Outcome.REJECTED
    assert [v.field for v in refused.violations] == ["parameters.offset"]
    assert site.undo(later.id).outcome is Outcome.APPLIED
    assert site.undo(swapped.id).outcome is Outcome.APPLIED
    _all_is_well(site)


def test_a_dry_run_says_what_would_be(site: System) -> None:
    report = site.adapt(DOUBLER, dry_run=True)
    assert report.outcome is Outcome.PENDING
    assert report.architecture is not None
    assert report.architecture.components["totaller"].cls == DOUBLER.cls
    assert (_runs(site), site.host.beside) == ([1], {})


# --- the manager is gone ---

CHANGES: tuple[Change, ...] = (SetParameters("fragile", {"level": 3}), DOUBLER)
POINTS = [
    *[("begin", 1, when) for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2, 3) for when in ("before", "after")],
    *[(name, 1, when) for name in ("succeed", "let_speak") for when in ("before", "after")],
    *[("progress", call, when) for call in (1, 2) for when in ("before", "after")],
    ("begin_giving", 1, "before"),
    ("begin_giving", 1, "after"),
    ("end", 1, "before"),
]


@pytest.mark.parametrize(("name", "call", "when"), POINTS)
def test_an_interrupted_swap_is_undone_on_return(
    site: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    run, before = site.running["totaller"], site.views()
    owner: Any = {"perform": transaction, "begin_giving": Hosts, "succeed": Hosts, "let_speak": Hosts}.get(
        name, Journal
    )
    with monkeypatch.context() as patch:
        dying(patch, owner, name, call, when)
        pending = site.adapt(*CHANGES, wait=False)
        wait_until(lambda: not site.running["manager"].thread.is_alive())
    _hears_on(site)
    site.start_manager()
    if (name, when) != ("begin", "before"):
        (line,) = site.lines(id=pending.id).entries
        assert (line.outcome, line.error) == (Outcome.ROLLED_BACK, "interrupted: the manager was restarted")
    _as_before(site, run, before)
    assert site.adapt(*CHANGES).outcome is Outcome.APPLIED
    _all_is_well(site)


@pytest.mark.parametrize(("owner", "name", "when"), [(Journal, "end", "after"), (Hosts, "stop", "before")])
def test_the_run_of_before_ends_even_if_the_manager_dies_right_after(
    site: System, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, when: str
) -> None:
    with monkeypatch.context() as patch:
        dying(patch, owner, name, 1, when)
        pending = site.adapt(DOUBLER, wait=False)
        wait_until(lambda: not site.running["manager"].thread.is_alive())
    _hears_on(site)
    site.start_manager()
    (line,) = site.lines(id=pending.id).entries
    assert line.outcome is Outcome.APPLIED
    wait_until(lambda: _runs(site) == [2])
    assert site.host.beside == {}
    _all_is_well(site)
