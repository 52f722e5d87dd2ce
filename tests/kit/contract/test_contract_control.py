"""What control queries, parameters and the lifecycle promise, on either bus."""

from __future__ import annotations

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import (
    AskQualities,
    ControlCode,
    ControlError,
    Rewire,
    RewireStep,
    SetTransition,
    Snapshot,
    StateRequest,
    StateStep,
)
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client.errors import ControlRefused
from regraft.component.parameters import ParameterError
from regraft.runtime.data.stream import Stream
from tests.kit.parts import Counter, Echo, Fragile, Number
from tests.support.stepped.site import BEYOND, Site
from tests.support.waiting import PATIENCE, wait_until


def test_a_component_describes_itself(site: Site) -> None:
    site.start(Counter, "counter")
    description = site.client.describe("counter")
    rate = description.parameter("rate")
    assert rate is not None
    assert rate.schema == {"type": "number", "minimum": 0.0, "maximum": 2000.0}
    assert rate.unit == "Hz"
    assert [port.name for port in description.ports] == ["count"]


def test_a_component_says_what_quality_it_gives_and_would_give(site: Site) -> None:
    counter = site.start(Counter, "counter", parameters={"rate": 0.0})
    counter.value = 4
    now = site.client.qualities("counter")
    assert (now.estimated, now.evaluated) == ({"pace": 0.0}, {"value": 4.0})
    asked = AskQualities({"rate": 20.0, "step": 2}, {"slope": 0.5})
    assert site.client.qualities("counter", asked).estimated == {"pace": 20.0}
    assert site.client.view("counter").parameters["rate"] == 0.0
    site.client.control("counter", "transition", SetTransition(Transition.DEACTIVATE))
    assert site.client.qualities("counter").evaluated == {}


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        (AskQualities({"speed": 1}), "no such parameter"),
        (AskQualities({"rate": -1.0}), "at least 0"),
        (AskQualities({}, {"slope": "steep"}), "ultiply"),
    ],
)
def test_qualities_that_cannot_be_told_are_refused_with_the_reason(
    site: Site, asked: AskQualities, problem: str
) -> None:
    site.start(Counter, "counter")
    with pytest.raises(ControlRefused, match=problem):
        site.client.qualities("counter", asked)
    assert site.client.qualities("counter").estimated == {"pace": 50.0}


def test_an_infinite_estimate_is_unknown_with_the_reason(site: Site) -> None:
    site.start(Counter, "counter")
    told = site.client.qualities("counter", AskQualities({"rate": 1.0}, {"slope": 1e308 * 10.0}))
    assert (told.estimated, told.unknown) == ({}, {"pace": "inf: must be finite"})


def test_what_comes_for_one_that_holds_still_is_handled_when_it_goes_on_and_not_otherwise(site: Site) -> None:
    site.start(Echo, "echo")
    said = site.collect("said", Number)
    writer = site.writer("heard", Number)
    assert writer.wait_for_reader(PATIENCE)

    def stream() -> Stream:
        return site.runtimes["echo"].inbound.stream(writer.key, "source")

    def goes_on() -> bool:
        writer.put(codec.encode(Number(99)))
        return bool(said) and said[-1].value == 99

    for value, hold in ((0, True), (10, False), (20, True)):
        site.client.control("echo", "transition", SetTransition(Transition.DEACTIVATE, hold=hold))
        for number in range(value, value + 10):
            writer.put(codec.encode(Number(number)))
        wait_until(lambda: stream().handled == writer.sequence, "all to have come")
        if value == 20:
            site.client.control("echo", "transition", SetTransition(Transition.CLEANUP))
            site.client.control("echo", "transition", SetTransition(Transition.CONFIGURE))
        site.client.control("echo", "transition", SetTransition(Transition.ACTIVATE))
    wait_until(goes_on, "it to go on")
    assert [number.value for number in said if number.value != 99] == [*range(10)]


def test_of_too_much_for_one_that_holds_still_the_oldest_goes_and_is_told(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("regraft.runtime.data.hold_buffer.MAX_HELD", 4)
    site.start(Echo, "echo")
    said = site.collect("said", Number)
    writer = site.writer("heard", Number)
    assert writer.wait_for_reader(PATIENCE)
    site.client.control("echo", "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    for number in range(10):
        writer.put(codec.encode(Number(number)))
    inbound = site.runtimes["echo"].inbound
    wait_until(lambda: inbound.stream(writer.key, "source").handled == writer.sequence, "all to have come")
    site.client.control("echo", "transition", SetTransition(Transition.ACTIVATE))
    wait_until(lambda: len(said) == 4, "what was kept")
    assert [number.value for number in said] == [6, 7, 8, 9]
    wait_until(lambda: site.status("echo").lost == 6, "the loss to be told")


def _opens_for_ten(site: Site) -> None:
    """Open an input towards another topic, on which ten messages come behind its writer's marker."""
    site.client.control("echo", "connections", Rewire(RewireStep.OPEN, "heard", "other"))
    writer = site.writer("other", Number)
    assert writer.wait_for_reader(PATIENCE)
    writer.put(codec.encode(Number(99)))
    writer.mark()
    for number in range(10):
        writer.put(codec.encode(Number(number)))
    inbound = site.runtimes["echo"].inbound
    wait_until(lambda: inbound.stream(writer.key, "source").handled == writer.sequence, "all to have come")


@pytest.mark.parametrize("bound", ["MAX_HELD", "MAX_HELD_BYTES"])
def test_of_too_much_for_an_input_that_nobody_switches_the_oldest_goes_and_is_told(
    site: Site, monkeypatch: pytest.MonkeyPatch, bound: str
) -> None:
    size = 4 if bound == "MAX_HELD" else 4 * len(codec.encode(Number(0)))
    monkeypatch.setattr(f"regraft.runtime.data.move_buffer.{bound}", size)
    site.start(Echo, "echo")
    said = site.collect("said", Number)
    _opens_for_ten(site)
    site.client.control("echo", "connections", Rewire(RewireStep.SWITCH, "heard", "other"))
    wait_until(lambda: len(said) == 4, "what was kept")
    assert [number.value for number in said] == [6, 7, 8, 9]
    wait_until(lambda: site.status("echo").lost == 6, "the loss to be told")


def test_of_too_much_for_an_input_that_stays_nothing_is_told(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("regraft.runtime.data.move_buffer.MAX_HELD", 4)
    site.start(Echo, "echo")
    _opens_for_ten(site)
    site.client.control("echo", "connections", Rewire(RewireStep.ABANDON, "heard", "other"))
    assert site.client.view("echo").connections["heard"] == "heard"
    assert site.status("echo").lost == 0


def test_of_too_much_for_an_input_of_an_inactive_component_nothing_is_told(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("regraft.runtime.data.move_buffer.MAX_HELD", 4)
    site.start(Echo, "echo")
    site.client.control("echo", "transition", SetTransition(Transition.DEACTIVATE))
    _opens_for_ten(site)
    site.client.control("echo", "connections", Rewire(RewireStep.SWITCH, "heard", "other"))
    assert site.client.view("echo").connections["heard"] == "other"
    assert site.status("echo").lost == 0


def test_parameters_are_set_together_or_not_at_all(site: Site) -> None:
    site.start(Counter, "counter")
    with pytest.raises(ControlRefused) as refused:
        site.set_parameters("counter", {"step": 3, "label": "ugly", "speed": 1})
    text = str(refused.value)
    assert "plain, fancy" in text
    assert "no such parameter" in text
    assert site.client.view("counter").parameters["step"] == 1
    view = site.set_parameters("counter", {"step": 3, "label": "fancy"})
    assert view.parameters["step"] == 3


def test_a_question_beyond_64_megabytes_is_refused_and_the_next_one_answered() -> None:
    site = Site("memory")
    site.start(Counter, "counter")
    (answer,) = site.bus.query(site.keys.control("counter", 1, "parameters"), bytes(BEYOND), PATIENCE)
    assert answer.error
    assert "must be at most 67108864" in codec.decode(answer.payload, ControlError).problems[0]
    assert site.client.view("counter").parameters["step"] == 1
    site.close()


def test_a_component_may_refuse_values_and_keeps_the_old_ones(site: Site) -> None:
    site.start(Counter, "counter")
    with pytest.raises(ControlRefused, match="seven is never right"):
        site.set_parameters("counter", {"step": 7, "rate": 10.0})
    view = site.client.view("counter")
    assert (view.parameters["step"], view.parameters["rate"]) == (1, 50.0)


def test_a_read_only_parameter_is_set_at_the_start_alone(site: Site) -> None:
    site.start(Counter, "counter", parameters={"serial": "A1"})
    with pytest.raises(ControlRefused, match="read-only"):
        site.set_parameters("counter", {"serial": "B2"})
    assert site.client.view("counter").parameters["serial"] == "A1"


def test_a_component_does_not_start_with_parameters_that_do_not_fit(site: Site) -> None:
    with pytest.raises(ParameterError, match="at most 2000"):
        site.start(Counter, "counter", parameters={"rate": 1e6})


def test_the_rate_of_a_timer_follows_its_parameter(site: Site) -> None:
    site.start(Counter, "counter", parameters={"rate": 0.0})
    counts = site.collect("count", Number)
    site.set_parameters("counter", {"rate": 200.0})
    wait_until(lambda: len(counts) > 10)


def test_hooks_are_called_in_the_order_of_the_lifecycle(site: Site) -> None:
    counter = site.start(Counter, "counter")
    for transition in (Transition.DEACTIVATE, Transition.CLEANUP, Transition.CONFIGURE, Transition.SHUTDOWN):
        site.client.control("counter", "transition", SetTransition(transition))
    wait_until(lambda: counter.hooks[-1] == "shutdown")
    assert counter.hooks == [
        "configure", "activate", "deactivate", "cleanup", "configure", "shutdown",
    ]  # fmt: skip


def test_a_transition_that_is_not_legal_is_refused_with_those_that_are(site: Site) -> None:
    site.start(Counter, "counter")
    with pytest.raises(ControlRefused, match="possible: deactivate, shutdown"):
        site.client.control("counter", "transition", SetTransition(Transition.CONFIGURE))


def test_an_inactive_component_is_silent_and_comes_back(site: Site) -> None:
    site.start(Counter, "counter", parameters={"rate": 200.0})
    counts = site.collect("count", Number)
    wait_until(lambda: len(counts) > 3)
    site.client.control("counter", "transition", SetTransition(Transition.DEACTIVATE))
    silent_from = site.runtimes["counter"].writers.sequences()
    site.client.view("counter")
    site.client.view("counter")
    assert site.runtimes["counter"].writers.sequences() == silent_from
    site.client.control("counter", "transition", SetTransition(Transition.ACTIVATE))
    seen = len(counts)
    wait_until(lambda: len(counts) > seen + 3)


@pytest.mark.parametrize("where", ["configure", "activate"])
def test_a_hook_that_fails_leads_back_to_unconfigured(site: Site, where: str) -> None:
    site.start(Fragile, "fragile", parameters={"where": where})
    wait_until(lambda: f"broken in {where}" in site.status("fragile").error)
    assert site.status("fragile").state is State.UNCONFIGURED


def test_a_component_beyond_repair_is_finalized(site: Site) -> None:
    site.start(Fragile, "fragile", parameters={"where": "configure for good"}, state=State.UNCONFIGURED)
    with pytest.raises(ControlRefused, match="finalized"):
        site.client.control("fragile", "transition", SetTransition(Transition.CONFIGURE))


def test_an_unknown_control_query_is_malformed(site: Site) -> None:
    site.start(Counter, "counter")
    (answer,) = site.bus.query(site.keys.control("counter", 1, "tune"), b"", PATIENCE)
    error = codec.decode(answer.payload, ControlError)
    assert (answer.error, error.code) == (True, ControlCode.MALFORMED)
    assert "there is no control query 'tune'" in error.problems[0]


def test_control_without_the_current_term_is_fenced(site: Site) -> None:
    site.start(Counter, "counter", term=3)
    for term in (None, 2):
        with pytest.raises(ControlRefused) as refused:
            site.set_parameters("counter", {"step": 2}, term)
        assert refused.value.code is ControlCode.FENCED
    site.set_parameters("counter", {"step": 2}, 4)
    with pytest.raises(ControlRefused):
        site.client.control("counter", "transition", SetTransition(Transition.DEACTIVATE, 3))
    assert site.client.view("counter").parameters["step"] == 2


def test_state_is_taken_and_given_back(site: Site) -> None:
    counter = site.start(Counter, "counter", parameters={"rate": 0.0})
    counter.value = 41
    snapshot = site.client.control("counter", "state")
    assert isinstance(snapshot, Snapshot)
    counter.value = 0
    site.client.control("counter", "state", StateRequest(StateStep.RESTORE, snapshot.state, snapshot.version))
    assert counter.value == 41
    with pytest.raises(ControlRefused, match="version 9"):
        site.client.control("counter", "state", StateRequest(StateStep.RESTORE, snapshot.state, 9))
