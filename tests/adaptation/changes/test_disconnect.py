"""Ports that are connected to no topic."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    EnterMode,
    Outcome,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.failures.test_recovery import dying_at
from tests.adaptation.optional_ports import HERE, Ear, Voice
from tests.adaptation.system import SYSTEM, System, small_architecture, spec_of, started
from tests.support.waiting import PATIENCE, wait_until

OFF = Connect("ear", "heard", None)
ON = Connect("ear", "heard", "spoken")
MUTE = Connect("voice", "numbers", None)
CHANGES: tuple[Change, ...] = (OFF, MUTE, SetParameters("listener", {"gain": 0.9}))
LAME = Add("lame", ComponentSpec(cls="tests.adaptation.parts:Newcomer", parameters={"where": "activate"}))
"""A change that fails at its last step."""
QUIET = [{"change": "connect", "component": "ear", "port": "heard", "topic": None}]
POINTS = [
    *[("begin", 1, when) for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2, 3) for when in ("before", "after")],
    *[("progress", call, when) for call in (1, 2) for when in ("before", "after")],
    *[("begin_giving", 1, when) for when in ("before", "after")],
    ("end", 1, "before"),
]


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[System]:
    """The small system, with a voice and an ear."""
    architecture = small_architecture()
    spoken = replace(architecture.topics["spare"], name="spoken")
    for spec in (
        spec_of("voice", Voice, connections={"numbers": "spoken"}),
        spec_of("ear", Ear, connections={"heard": "spoken"}),
    ):
        architecture = architecture.with_component(spec)
    architecture = replace(architecture.with_topics([spoken]), modes={"quiet": QUIET})
    with started(architecture, tmp_path) as system:
        system.ends_are_seen = True
        system.start_manager(answer_within=0.5, bind_within=2.0, undo_within=1.0)
        yield system


def _ear(system: System) -> Ear:
    component = system.running["ear"].component
    assert isinstance(component, Ear)
    return component


def _sent(system: System) -> int:
    component = system.running["voice"].component
    assert isinstance(component, Voice)
    return component.sent


def _is_contiguous(numbers: list[int]) -> bool:
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _specified(system: System) -> str | None:
    return system.host.specs["ear"].connections["heard"]


def _hears(system: System) -> None:
    before = len(_ear(system).log)
    wait_until(lambda: len(_ear(system).log) > before, "numbers to arrive")


def test_an_input_handles_all_that_was_put_before_it_is_disconnected(pair: System) -> None:
    for _ in range(10):
        _hears(pair)
        begin, sent = len(_ear(pair).log), _sent(pair)
        report = pair.adapt(OFF)
        assert report.outcome is Outcome.APPLIED, report
        log = list(_ear(pair).log)
        assert log[-1] >= sent
        assert _is_contiguous(log[max(0, begin - 1) :])
        sent = _sent(pair)
        wait_until(lambda bound=sent: _sent(pair) > bound + 20, "numbers that nobody hears")  # type: ignore[misc]
        assert _ear(pair).log == log
        assert pair.view("ear").connections["heard"] is None
        assert pair.adapt(ON).outcome is Outcome.APPLIED
    assert not [event for event in pair.events if event.kind in ("message.lost", "adaptation.incomplete_switch")]


def test_readers_get_all_that_an_output_put_before_it_is_disconnected(pair: System) -> None:
    _hears(pair)
    report = pair.adapt(MUTE)
    assert report.outcome is Outcome.APPLIED, report
    put = pair.running["voice"].runtime.writers.numbering()[Keys(SYSTEM).topic("spoken")]
    wait_until(lambda: _ear(pair).log[-1] == put, "the last number that was put")
    log = list(_ear(pair).log)
    assert _is_contiguous(log)
    sent = _sent(pair)
    wait_until(lambda: _sent(pair) > sent + 20, "numbers that go nowhere")
    assert _ear(pair).log == log
    assert not pair.running["voice"].runtime.outputs["numbers"].wanted
    assert pair.adapt(Connect("voice", "numbers", "spoken")).outcome is Outcome.APPLIED
    _hears(pair)
    assert _is_contiguous(_ear(pair).log[len(log) :])
    assert not [event for event in pair.events if event.kind in ("message.lost", "component.fault")]


def test_disconnecting_is_journalled_and_undone(pair: System) -> None:
    report = pair.adapt(OFF, reason="to rest")
    entry = pair.lines().entries[0]
    assert (entry.id, entry.request.changes, entry.request.reason) == (report.id, (OFF,), "to rest")
    assert [step.action for step in entry.steps] == ["disconnect heard (from spoken)"]
    assert _specified(pair) is None
    undone = pair.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert undone.request.changes == (ON,)
    assert [step.action for step in undone.steps] == ["connect heard to spoken (from no topic)"]
    assert _specified(pair) == "spoken"
    _hears(pair)


def test_undoing_the_connection_of_a_port_without_a_topic_disconnects_it(pair: System) -> None:
    assert pair.adapt(OFF).outcome is Outcome.APPLIED
    connected = pair.adapt(ON)
    assert pair.undo(connected.id).request.changes == (OFF,)
    assert pair.view("ear").connections["heard"] is None


def test_a_dry_run_plans_it_and_touches_nothing(pair: System) -> None:
    report = pair.adapt(*CHANGES, dry_run=True)
    assert [step.action for step in report.steps][:2] == [
        "disconnect heard (from spoken)",
        "disconnect numbers (from spoken)",
    ]
    assert report.architecture is not None
    assert report.architecture.components["ear"].connections["heard"] is None
    assert pair.view("ear").connections["heard"] == "spoken"


def test_a_port_that_must_be_fed_is_not_disconnected_while_its_component_is_active(pair: System) -> None:
    before = pair.views()
    report = pair.adapt(Connect("listener", "heard", None), OFF)
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert (violation.change, violation.component, violation.field) == (0, "listener", "connect.heard")
    assert violation.problem.startswith(
        "input 'heard' is required while the component is active, but is connected to no topic; topics that carry"
    )
    assert pair.views() == before
    down = ChangeState("listener", Transition.DEACTIVATE)
    assert pair.adapt(down, Connect("listener", "heard", None)).outcome is Outcome.APPLIED
    report = pair.adapt(ChangeState("listener", Transition.ACTIVATE))
    assert [(v.change, v.field) for v in report.violations] == [(0, "connect.heard")]


def test_a_port_that_there_is_not_is_named_with_the_nearest(pair: System) -> None:
    report = pair.adapt(Connect("ear", "herd", None))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert violation.field == "connect.herd"
    assert "did you mean 'heard'?" in violation.problem


def test_an_undone_adaptation_connects_again_what_it_disconnected(pair: System) -> None:
    before = pair.views()
    report = pair.adapt(OFF, MUTE, LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert pair.views() == before
    _hears(pair)


def test_a_mode_disconnects_and_what_is_disconnected_is_left_alone(pair: System) -> None:
    assert pair.adapt(EnterMode("quiet")).outcome is Outcome.APPLIED
    assert pair.view("ear").connections["heard"] is None
    again = pair.adapt(EnterMode("quiet"))
    assert (again.outcome, again.steps) == (Outcome.APPLIED, ())


def test_a_disconnected_port_stays_so_in_a_successor_unless_that_is_given_a_topic(pair: System) -> None:
    assert pair.adapt(OFF).outcome is Outcome.APPLIED
    heard = list(_ear(pair).log)
    report = pair.adapt(Swap("ear", f"{HERE}:OtherEar"))
    assert report.outcome is Outcome.APPLIED, report
    assert pair.view("ear").connections["heard"] is None
    assert _ear(pair).log == heard
    assert pair.adapt(Swap("ear", f"{HERE}:Ear", connections={"heard": "spoken"})).outcome is Outcome.APPLIED
    _hears(pair)
    swapped = pair.adapt(Swap("ear", connections={"heard": None}))
    assert swapped.outcome is Outcome.APPLIED, swapped
    assert pair.view("ear").connections["heard"] is None
    assert pair.undo(swapped.id).outcome is Outcome.APPLIED
    _hears(pair)


def test_a_disconnected_port_stays_so_through_a_crash_and_a_reconfiguration(pair: System) -> None:
    assert pair.adapt(OFF, MUTE).outcome is Outcome.APPLIED
    for name, port in (("ear", "heard"), ("voice", "numbers")):
        pair.restart(name)
        assert pair.view(name).connections[port] is None
        for transition in (Transition.DEACTIVATE, Transition.CLEANUP, Transition.CONFIGURE, Transition.ACTIVATE):
            assert pair.adapt(ChangeState(name, transition)).outcome is Outcome.APPLIED
        assert pair.view(name).connections[port] is None


def test_an_added_component_has_the_ports_without_topic_that_its_spec_names(pair: System) -> None:
    spec = ComponentSpec(cls=f"{HERE}:Ear", connections={"heard": None})
    assert pair.adapt(Add("extra", spec)).outcome is Outcome.APPLIED
    assert pair.view("extra").connections == {"heard": None}


@pytest.mark.parametrize("state", [ProcessState.QUARANTINED, ProcessState.STOPPED])
def test_a_dead_component_is_disconnected(pair: System, state: ProcessState) -> None:
    pair.running.pop("ear").kill()
    pair.host.ended("ear", state)
    report = pair.adapt(OFF)
    assert (report.outcome, report.steps) == (Outcome.APPLIED, ())
    assert pair.host.specs["ear"].connections["heard"] is None
    assert pair.host.processes["ear"].state is state


def test_a_failed_component_is_disconnected_and_comes_back_so(pair: System) -> None:
    ear = pair.running["ear"]
    ear.runtime.post(lambda: ear.component.kit.fail("it is deaf"))
    wait_until(lambda: pair.view("ear").state is State.UNCONFIGURED)
    assert pair.adapt(OFF).outcome is Outcome.APPLIED
    for transition in (Transition.CONFIGURE, Transition.ACTIVATE):
        assert pair.adapt(ChangeState("ear", transition)).outcome is Outcome.APPLIED
    assert pair.view("ear").connections["heard"] is None


def test_a_hung_component_is_started_again_without_its_connection(pair: System) -> None:
    gate = threading.Event()
    pair.running["ear"].runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        pair.running.pop(name).kill()

    pair.host.terminate = kill
    report = pair.adapt(OFF)
    assert report.outcome is Outcome.APPLIED, report
    wait_until(lambda: pair.host.processes["ear"].state is ProcessState.RUNNING, "the next run")
    assert pair.view("ear").connections["heard"] is None


@pytest.mark.parametrize(("name", "call", "when"), POINTS)
def test_an_interrupted_disconnection_is_undone_on_return(
    pair: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    before = pair.views()
    dying_at(pair, monkeypatch, CHANGES, name, call, when)
    pair.lines()
    assert pair.views() == before
    _hears(pair)
    assert pair.adapt(*CHANGES).outcome is Outcome.APPLIED


def test_an_undone_disconnection_of_a_hung_component_leaves_it_as_it_was_to_be(pair: System) -> None:
    gate = threading.Event()
    pair.running["ear"].runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        pair.running.pop(name).kill()

    pair.host.terminate = kill
    report = pair.adapt(OFF, LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert _specified(pair) == "spoken"
    assert pair.view("ear").connections["heard"] == "spoken"
