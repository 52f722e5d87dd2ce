"""What a hand-over promises, on either bus, under the real clock."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from regraft import Component
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import ControlCode, ParameterValues, Rewire, RewireStep, SetTransition
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client.requests import ClientGoal
from regraft.client.sending import Sender
from tests.handover.parts import Ask, Caller, Doubler, Item, Newer, Report, Sink, Source, Stateless, Totaller, Unable
from tests.handover.site import Refused, Threads, Wiring
from tests.support.waiting import PATIENCE, wait_until

WIRING = Wiring({"items": ("source",)}, {"totals": ("sink",)})
NOTHING = (0, 0, 0, 0)


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """A bus of either kind, with a source, a totaller and a sink."""
    made = Threads(request.param)
    made.start(Sink, "sink")
    made.start(Totaller, "totaller")
    made.start(Source, "source", parameters={"rate": 500.0})
    made.hears_on(10)
    yield made
    made.close()


def ready(site: Threads, cls: type[Component] = Totaller) -> int:
    """Have a successor of the totaller ready to take over; returns its incarnation."""
    successor = site.spawn(cls, "totaller")
    site.bind("totaller", successor, WIRING)
    return successor


def take_over(site: Threads, successor: int) -> None:
    site.step("totaller", successor, HandoverStep.TAKE_OVER)
    site.incarnations["totaller"] = successor


def calls_go_on(site: Threads) -> None:
    before = site.asked().answered
    wait_until(lambda: site.asked().answered > before + 5, "calls go on")


def goes_on(goal: ClientGoal[Item, Item]) -> None:
    heard = goal.feedback
    wait_until(lambda: goal.feedback != heard, "the goal goes on")


# --- nothing is lost ---


def test_nothing_is_lost_doubled_or_disordered_while_a_component_is_handed_over(site: Threads) -> None:
    for _ in range(5):
        site.swap(Totaller, "totaller", WIRING)
        site.hears_on(20)
    assert site.faults() == NOTHING
    assert site.incarnations["totaller"] == 6


def test_nothing_is_lost_where_hardly_anything_is_said(site: Threads) -> None:
    site.control("source", 1, "parameters", ParameterValues({"rate": 0.0}))
    for _ in range(3):
        site.ask("say", Ask(), Item)
        site.swap(Totaller, "totaller", WIRING)
        site.swap(Totaller, "totaller", WIRING)
    assert site.faults() == NOTHING


def test_a_component_that_lags_behind_hands_over_when_it_has_caught_up(site: Threads) -> None:
    for _ in range(3):
        successor, incumbent = ready(site), site.component("totaller")
        nap = threading.Thread(target=lambda: site.ask("nap", Ask(200), Item))
        nap.start()
        assert incumbent.napping.wait(PATIENCE)
        former = site.incarnations["totaller"]
        take_over(site, successor)
        nap.join(PATIENCE)
        site.step("totaller", former, HandoverStep.RETIRE)
        wait_until(lambda: site.gone("totaller", site.incarnations["totaller"] - 1), "the incumbent ends")
    assert site.faults() == NOTHING


@pytest.mark.parametrize("service", ["count", "ponder"])
def test_every_call_is_answered_and_done_once(site: Threads, service: str) -> None:
    site.start(Caller, "caller", parameters={"service_name": service, "rate": 100.0})
    for _ in range(5):
        site.swap(Totaller, "totaller", WIRING)
        calls_go_on(site)
    site.control("caller", 1, "parameters", ParameterValues({"rate": 0.0}))
    wait_until(lambda: site.asked().answered == site.asked().asked, "all calls are answered")
    asked = site.asked()
    assert (asked.failed, asked.miscounted, asked.strange) == (0, 0, 0)


def test_a_component_that_calls_others_gets_the_answers_to_its_own_questions(site: Threads) -> None:
    site.start(Caller, "caller", parameters={"rate": 100.0})
    for _ in range(3):
        wait_until(lambda: site.asked().answered > 5, "calls are answered")
        site.swap(Caller, "caller", Wiring())
        assert site.asked().strange == 0
    wait_until(lambda: site.asked().answered > 5, "calls are answered")
    assert (site.asked().failed, site.asked().strange) == (0, 0)


def test_a_component_that_resumes_does_not_get_the_answers_to_what_its_successor_asked(site: Threads) -> None:
    site.start(Caller, "caller", parameters={"rate": 100.0})
    wait_until(lambda: site.asked().answered > 5, "calls are answered")
    successor = site.spawn(Caller, "caller")
    site.step("caller", successor, HandoverStep.TAKE_OVER)
    wait_until(lambda: site.asked().answered > 5, "its calls are answered")
    site.kill("caller", successor)
    site.resume("caller", 1, successor)
    before = site.asked().answered
    wait_until(lambda: site.asked().answered > before + 10, "calls are answered again")
    assert (site.asked().failed, site.asked().strange) == (0, 0)


def test_a_goal_is_pursued_to_its_end(site: Threads) -> None:
    goal = site.client.goal("walk", Ask(100_000), Item, Item)
    for _ in range(3):
        goes_on(goal)
        site.swap(Totaller, "totaller", WIRING)
    site.ask("hurry", Ask(99_999), Item)
    site.swap(Totaller, "totaller", WIRING)
    assert goal.result(PATIENCE) == Item(100_000)


def test_the_result_of_a_goal_that_the_run_before_ended_can_be_asked_for(site: Threads) -> None:
    sender, bus, replies = Sender(site.session(), "asker"), site.session(), []

    def take(item: object) -> None:
        sample = bus.open_sample(item)
        if sample is not None:
            replies.append(codec.decode(sample.payload, Reply))

    bus.subscribe(site.keys.reply("walk", "asker"), take)
    sender.put(site.keys.request("walk"), Request("asker", 1, Verb.GOAL, codec.to_plain(Ask(3))))
    ended = Reply(1, Answer.RESULT, codec.to_plain(Item(3)))
    wait_until(lambda: ended in replies, "the goal ends")
    site.swap(Totaller, "totaller", WIRING)
    for verb in (Verb.RESULT, Verb.GOAL):
        replies.clear()
        sender.put(site.keys.request("walk"), Request("asker", 1, verb, codec.to_plain(Ask(3))))
        wait_until(lambda: replies, "the result comes again")
        assert replies == [ended]
    sender.close()


def test_the_newest_message_of_a_silent_topic_is_still_known(site: Threads) -> None:
    site.start(Source, "configurer", parameters={"rate": 0.0}, connections={"items": "config"}, services={"say": "set"})
    for _ in range(3):
        site.ask("set", Ask(), Item)
    wait_until(lambda: site.ask("configured", Ask(), Item).number == 3, "it is configured")
    site.swap(Totaller, "totaller", Wiring(WIRING.inputs | {"config": ("configurer",)}, WIRING.outputs))
    assert site.ask("configured", Ask(), Item).number == 3


# --- what goes over ---


def test_parameters_are_as_they_were_unless_the_successor_is_given_others(site: Threads) -> None:
    site.control("totaller", 1, "parameters", ParameterValues({"offset": 7}))
    site.swap(Totaller, "totaller", WIRING)
    assert site.ask("configured", Ask(), Item).total == 7
    site.swap(Totaller, "totaller", WIRING, parameters={"offset": 8})
    assert site.ask("configured", Ask(), Item).total == 8


def test_another_class_goes_on_from_the_same_state(site: Threads) -> None:
    site.swap(Doubler, "totaller", WIRING)
    assert site.ask("double", Ask(21), Item) == Item(42)
    assert site.faults() == NOTHING


def test_a_class_without_that_state_takes_over_without_it_if_so_wanted(site: Threads) -> None:
    site.swap(Stateless, "totaller", WIRING, with_state=False)
    site.hears_on(20)
    report = site.all_was_heard()
    assert (report.lost, report.doubled, report.disordered) == (0, 0, 0)


def test_an_inactive_component_is_handed_over_inactive(site: Threads) -> None:
    site.control("totaller", 1, "transition", SetTransition(Transition.DEACTIVATE))
    calls = site.component("totaller").calls = 5
    site.swap(Totaller, "totaller", WIRING)
    assert site.view("totaller").state is State.INACTIVE
    site.control("totaller", 2, "transition", SetTransition(Transition.ACTIVATE))
    assert site.ask("count", Ask(), Item).total == calls + 1


# --- who speaks ---


def test_one_run_at_a_time_speaks_for_the_component(site: Threads) -> None:
    said: list[tuple[str, ComponentStatus]] = []
    bus = site.session()

    def take(item: object) -> None:
        sample = bus.open_sample(item)
        if sample is not None:
            said.append((sample.key, codec.decode(sample.payload, ComponentStatus)))

    bus.subscribe(site.keys.status("totaller"), take)
    bus.subscribe(site.keys.standby("totaller"), take)
    wait_until(lambda: any(s.incarnation == 1 for _, s in said), "the incumbent is heard")
    successor = ready(site)
    assert (site.role("totaller", 1), site.role("totaller", 2)) == ("live", "waiting")
    take_over(site, successor)
    assert (site.role("totaller", 1), site.role("totaller", 2)) == ("frozen", "live")
    before = len(said)
    wait_until(lambda: {s.incarnation for _, s in said[before:]} == {1, 2}, "both are heard")
    spoke = [s.incarnation for key, s in said if key == site.keys.status("totaller")]
    assert spoke == sorted(spoke)
    assert all(s.incarnation == 1 for key, s in said[before:] if key == site.keys.standby("totaller"))
    assert site.client.components()["totaller"].status.incarnation == 2  # type: ignore[union-attr]
    site.step("totaller", 1, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("totaller", 1), "the incumbent ends")


def test_a_run_that_does_not_speak_takes_no_orders(site: Threads) -> None:
    successor = ready(site)
    take_over(site, successor)
    spare = site.spawn(Totaller, "totaller")
    for incarnation in (1, spare):
        for verb, order in (
            ("parameters", ParameterValues({"offset": 1})),
            ("transition", SetTransition(Transition.DEACTIVATE)),
            ("connections", Rewire(RewireStep.OPEN, "items", "elsewhere")),
        ):
            with pytest.raises(Refused, match="another one speaks") as refused:
                site.control("totaller", incarnation, verb, order)
            assert refused.value.error.code is ControlCode.REFUSED
    assert site.faults() == NOTHING


# --- refused before anything is touched ---


@pytest.mark.parametrize(
    ("cls", "why"),
    [(Newer, "has version 1, Newer takes 2"), (Stateless, "Stateless restores none")],
)
def test_a_class_that_does_not_take_the_state_is_refused_and_nothing_is_touched(
    site: Threads, cls: type[Component], why: str
) -> None:
    successor = site.spawn(cls, "totaller")
    with pytest.raises(Refused, match=why) as refused:
        site.step("totaller", successor, HandoverStep.TAKE_OVER)
    assert refused.value.error.code is ControlCode.REFUSED
    assert site.role("totaller", 1) == "live"
    site.step("totaller", successor, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("totaller", successor), "the successor ends")
    assert site.faults() == NOTHING


def test_a_class_with_a_state_is_refused_where_the_incumbent_gives_none(site: Threads) -> None:
    site.start(Stateless, "bare", connections={"totals": "other"})
    site.assigned["bare"] = {"connections": {"totals": "other"}}
    successor = site.spawn(Totaller, "bare", services={"count": "c", "ponder": "p", "configured": "f", "walk": "w"})
    with pytest.raises(Refused, match="the incumbent gives none"):
        site.step("bare", successor, HandoverStep.TAKE_OVER)


def test_steps_from_a_former_term_are_fenced(site: Threads) -> None:
    site.term = 4
    site.start(Totaller, "other", connections={"totals": "elsewhere"}, services={"count": "other/count"})
    successor = site.spawn(Totaller, "other")
    for term in (3, None):
        site.term = term
        orders = [(successor, step) for step in (HandoverStep.TAKE_OVER, HandoverStep.PROMOTE, HandoverStep.RETIRE)]
        orders += [(1, step) for step in (HandoverStep.PULL, HandoverStep.RESUME, HandoverStep.RETIRE)]
        for incarnation, step in orders:
            with pytest.raises(Refused) as refused:
                site.step("other", incarnation, step)
            assert refused.value.error.code is ControlCode.FENCED
    site.term = 5
    site.step("other", successor, HandoverStep.TAKE_OVER)
    site.step("other", 1, HandoverStep.RETIRE)


# --- asked again, given up ---


def test_steps_may_be_asked_again(site: Threads) -> None:
    successor = ready(site)
    take_over(site, successor)
    take_over(site, successor)
    assert site.step("totaller", successor, HandoverStep.RESUME)["role"] == "live"
    with pytest.raises(Refused, match="not to retire"):
        site.step("totaller", successor, HandoverStep.RETIRE)
    assert site.faults() == NOTHING


def test_a_successor_given_up_before_it_takes_over_leaves_no_trace(site: Threads) -> None:
    successor = ready(site)
    site.kill("totaller", successor)
    site.step("totaller", 1, HandoverStep.RESUME, peer=successor)
    with pytest.raises(Refused, match="no successor of this run any more"):
        site.step("totaller", 1, HandoverStep.PULL, peer=successor)
    assert site.role("totaller", 1) == "live"
    assert site.faults() == NOTHING
    site.swap(Totaller, "totaller", WIRING)
    assert site.faults() == NOTHING


def test_a_successor_that_cannot_go_on_is_undone_without_loss(site: Threads) -> None:
    successor = ready(site, Unable)
    with pytest.raises(Refused, match="not this one"):
        site.step("totaller", successor, HandoverStep.TAKE_OVER)
    assert site.role("totaller", 1) == "frozen"
    site.step("totaller", successor, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("totaller", successor), "the successor ends")
    with pytest.raises(Refused, match="must be higher than"):
        site.step("totaller", 1, HandoverStep.RESUME, peer=successor, incarnation=successor)
    site.resume("totaller", 1, successor)
    site.hears_on(20)
    assert site.view("totaller").incarnation == successor + 1
    wait_until(lambda: site.client.components()["totaller"].status.incarnation == successor + 1, "it speaks")  # type: ignore[union-attr]
    assert site.faults() == NOTHING


def test_the_incumbent_resumes_when_its_successor_is_lost_after_it_went_live(site: Threads) -> None:
    successor = ready(site)
    take_over(site, successor)
    site.hears_on(50)
    site.kill("totaller", successor)
    site.resume("totaller", 1, successor)
    site.hears_on(50)
    assert site.faults() == NOTHING
    site.swap(Totaller, "totaller", WIRING)
    assert site.faults() == NOTHING


def test_a_frozen_incumbent_can_take_over_again_with_the_state_of_now(site: Threads) -> None:
    incumbent = site.runtimes["totaller", 1].component
    for turn in range(3):
        before = site.incarnations["totaller"]
        take_over(site, ready(site, Doubler))
        called = site.ask("count", Ask(), Item).total
        site.hears_on(30)
        site.take_back("totaller", before)
        assert site.component("totaller") is incumbent
        assert site.ask("count", Ask(), Item).total == called + 1
        site.hears_on(30)
        assert site.faults() == NOTHING, turn


def test_a_frozen_incumbent_that_cannot_take_over_leaves_its_successor_live(site: Threads) -> None:
    take_over(site, ready(site))
    with pytest.raises(Refused, match="higher than both"):
        site.step("totaller", 1, HandoverStep.TAKE_OVER, peer=2, incarnation=2)
    site.control("totaller", 2, "transition", SetTransition(Transition.DEACTIVATE))
    site.control("totaller", 2, "transition", SetTransition(Transition.CLEANUP))
    with pytest.raises(Refused, match="only an active or inactive one"):
        site.step("totaller", 1, HandoverStep.TAKE_OVER, peer=2, incarnation=3)
    assert site.role("totaller", 2) == "live"
    assert site.role("totaller", 3) == "frozen"


def test_what_a_resumed_incumbent_says_is_heard_although_its_successor_had_said_more(site: Threads) -> None:
    site.start(Sink, "listener", connections={"totals": "ticks"}, services={"report": "listener/report"})
    given = {"connections": {"items": "ticks"}, "services": {"say": "clock/say"}, "parameters": {"rate": 0.0}}
    site.start(Source, "clock", **given)
    successor = site.spawn(Source, "clock")
    site.bind("clock", successor, Wiring({}, {"ticks": ("listener",)}))
    site.step("clock", successor, HandoverStep.TAKE_OVER)
    site.control("clock", successor, "parameters", ParameterValues({"rate": 500.0}))

    def heard() -> int:
        return site.ask("listener/report", Ask(), Report).heard

    wait_until(lambda: heard() > 50, "the successor is heard")
    site.control("clock", successor, "parameters", ParameterValues({"rate": 0.0}))
    site.kill("clock", successor)
    site.resume("clock", 1, successor)
    before = heard()
    site.ask("clock/say", Ask(), Item)
    wait_until(lambda: heard() == before + 1, "the incumbent is heard")
