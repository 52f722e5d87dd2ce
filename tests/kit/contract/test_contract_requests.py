"""What services and actions promise, on either bus."""

from __future__ import annotations

import threading

import pytest

from regraft import CallFailed, Component, RefusalCode
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client import Client
from regraft.component.future import Future
from regraft.host.watchdog.hang_detection import HUNG_TIMEOUT
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data import writers
from regraft.runtime.data.writers import Identity, Writer, Writers
from regraft.runtime.requests.request_server import REMEMBERED_NUMBERS, REMEMBERED_REPLIES
from regraft.testing import Rig
from tests.kit.parts import Asker, Follower, Number, Oracle, Other, Walker
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until


def test_a_call_gets_its_reply(site: Site) -> None:
    site.start(Oracle, "oracle")
    assert site.client.call("double", Number(21), Number) == Number(42)


def test_an_async_service_lets_others_run(site: Site) -> None:
    oracle = site.start(Oracle, "oracle")
    slow: list[Number] = []
    waiting = threading.Thread(target=lambda: slow.append(site.client.call("wait", Number(3), Number, PATIENCE)))
    waiting.start()
    wait_until(lambda: oracle.waiting)
    assert site.client.call("double", Number(1), Number) == Number(2)
    assert not slow
    oracle.go_on = True
    waiting.join(PATIENCE)
    assert slow == [Number(3)]


def test_heavy_work_returns_its_result(site: Site) -> None:
    site.start(Oracle, "oracle")
    assert site.client.call("heavy", Number(1), Number) == Number(2)


def test_a_refusal_says_why(site: Site) -> None:
    site.start(Oracle, "oracle")
    with pytest.raises(CallFailed, match="not today") as failed:
        site.client.call("refuse", Number(1), Number)
    assert failed.value.answer is Answer.REFUSED


def test_an_exception_in_a_service_is_a_failed_call(site: Site) -> None:
    site.start(Oracle, "oracle")
    with pytest.raises(CallFailed, match="by design") as failed:
        site.client.call("break", Number(1), Number)
    assert failed.value.answer is Answer.FAILED
    assert site.client.call("double", Number(1), Number) == Number(2)


def test_a_reply_of_the_wrong_type_is_a_failed_call(site: Site) -> None:
    site.start(Oracle, "oracle")
    with pytest.raises(CallFailed, match="returned Other"):
        site.client.call("wrong", Number(1), Number)


def test_a_request_that_does_not_fit_is_refused(site: Site) -> None:
    site.start(Oracle, "oracle")
    with pytest.raises(CallFailed) as refused:
        site.client.call("double", Other("?"), Number)
    assert (refused.value.code, refused.value.field) == (RefusalCode.MALFORMED, "value")
    assert str(refused.value) == "double: value: is missing"


def test_a_service_that_nobody_offers_is_said_to_be_missing(site: Site) -> None:
    with pytest.raises(CallFailed, match="nobody"):
        site.client.call("nothing", Number(1), Number, 0.3)


class CountedTime:
    """A clock that only naps move."""

    def __init__(self) -> None:
        self.napped = 0.0

    def monotonic(self) -> float:
        return self.napped

    def sleep(self, seconds: float) -> None:
        self.napped += seconds


class Coordinator(Component):
    """Asks many robots at once, before the first of them is there."""

    def on_activate(self) -> None:
        calls = [self.kit.call(f"/robot_{n}/navigate_to", Number(n), Number, timeout=5.0) for n in range(30)]
        self.calls: list[Future[Number]] = calls


def test_many_services_that_nobody_offers_do_not_keep_the_loop_until_it_counts_as_hung(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    naps = CountedTime()
    monkeypatch.setattr(writers, "time", naps)
    with Rig() as rig:
        coordinator = rig.add(Coordinator)
        assert naps.napped < HUNG_TIMEOUT
        rig.advance(6.0)
        for call in coordinator.calls:
            assert isinstance(call.error, CallFailed)
            assert "nobody offers this service" in str(call.error)


def test_an_inactive_component_refuses_and_says_so(site: Site) -> None:
    site.start(Oracle, "oracle", state=State.INACTIVE)
    with pytest.raises(CallFailed, match="inactive"):
        site.client.call("double", Number(1), Number)


def test_one_component_can_call_another(site: Site) -> None:
    site.start(Oracle, "oracle")
    site.start(Asker, "asker")
    answers = site.collect("answers", Number)
    writer = site.writer("question", Number)
    assert writer.wait_for_reader(PATIENCE)
    writer.put(codec.encode(Number(4)))
    wait_until(lambda: answers == [Number(8)])


def _bare_client(site: Site, name: str) -> tuple[Writer, list[Reply]]:
    """Return what asks the service ``double`` without the kit's help, and the replies that come."""
    bus = site.session()
    replies: list[Reply] = []

    def take(item: object) -> None:
        sample = bus.open_sample(item)
        if sample and sample.payload:
            replies.append(codec.decode(sample.payload, Reply))

    bus.subscribe(site.keys.reply("double", name), take)
    requests = Writers(bus, RealClock(), Identity(name, 1, 1)).open(
        site.keys.request("double"), type_of(Request).encoding
    )
    assert requests.wait_for_reader(PATIENCE)
    return requests, replies


def test_a_request_asked_twice_is_done_once_and_answered_twice(site: Site) -> None:
    site.start(Oracle, "oracle")
    requests, replies = _bare_client(site, "stutterer")
    request = codec.encode(Request("stutterer", 1, Verb.CALL, {"value": 3, "share": 0.0}))
    requests.put(request)
    requests.put(request)
    wait_until(lambda: len(replies) == 2)
    assert replies[0] == replies[1]


def test_a_call_whose_reply_is_forgotten_by_now_is_refused_not_done_again(site: Site) -> None:
    site.start(Oracle, "oracle")
    requests, replies = _bare_client(site, "forgetful")
    for number in (*range(1, REMEMBERED_REPLIES + 2), 1):
        requests.put(codec.encode(_call("forgetful", number)))
    wait_until(lambda: len(replies) == REMEMBERED_REPLIES + 2)
    assert {reply.answer for reply in replies[:-1]} == {Answer.RESULT}
    assert (replies[-1].number, replies[-1].answer) == (1, Answer.REFUSED)


def test_a_call_that_was_lost_is_done_when_it_comes_at_last_and_many_newer_ones_came_before(site: Site) -> None:
    site.start(Oracle, "oracle")
    requests, replies = _bare_client(site, "unlucky")
    newer = range(2, 5 * REMEMBERED_REPLIES)
    for number in (*newer, 1, 1, newer[-1] + REMEMBERED_NUMBERS + REMEMBERED_REPLIES, 3):
        requests.put(codec.encode(_call("unlucky", number)))
    wait_until(lambda: len(replies) == len(newer) + 4)
    assert [(reply.number, reply.answer) for reply in replies[len(newer) :]] == [
        (1, Answer.RESULT),
        (1, Answer.RESULT),
        (replies[-2].number, Answer.RESULT),
        (3, Answer.REFUSED),
    ]


def _call(client: str, number: int) -> Request:
    return Request(client, number, Verb.CALL, {"value": number, "share": 0.0})


def test_a_goal_is_accepted_gives_feedback_and_ends(site: Site) -> None:
    walker = site.start(Walker, "walker")
    heard: list[Number] = []
    goal = site.client.goal("walk", Number(3), Number, Number, on_feedback=heard.append)
    assert goal.result(PATIENCE) == Number(3)
    wait_until(lambda: len(heard) == 3)
    assert [number.value for number in heard] == [0, 1, 2]
    assert walker.ended == ["arrived"]


def test_a_cancelled_goal_ends_where_it_awaits(site: Site) -> None:
    walker = site.start(Walker, "walker")
    goal = site.client.goal("walk", Number(10_000), Number, Number)
    goal.cancel()
    with pytest.raises(CallFailed) as failed:
        goal.result(PATIENCE)
    assert failed.value.answer is Answer.CANCELLED
    assert walker.ended == ["cancelled"]


def test_a_newer_goal_replaces_the_older_one(site: Site) -> None:
    walker = site.start(Walker, "walker")
    first = site.client.goal("walk", Number(10_000), Number, Number)
    second = site.client.goal("walk", Number(2), Number, Number)
    with pytest.raises(CallFailed, match="replaced"):
        first.result(PATIENCE)
    assert second.result(PATIENCE) == Number(2)
    assert walker.ended == ["cancelled", "arrived"]


def test_a_goal_ends_when_its_client_is_gone_unless_it_is_to_outlive_it(site: Site) -> None:
    walker = site.start(Walker, "walker")
    passer = Client(site.session(), "site", "passer")
    passer.goal("walk", Number(100_000), Number, Number)
    passer.close()
    wait_until(lambda: walker.ended == ["cancelled"], "the walk to end")
    planner = Client(site.session(), "site", "planner")
    planner.goal("walk", Number(200), Number, Number, outlives=True)
    planner.close()
    wait_until(lambda: walker.ended == ["cancelled", "arrived"], "the other walk to end")


def test_a_goal_of_a_component_that_dies_ends(site: Site) -> None:
    walker = site.start(Walker, "walker")
    site.start(Follower, "follower")
    runtime = site.runtimes["walker"]
    wait_until(lambda: runtime.servers[0].goals, "the goal to be pursued")
    site.cut_off("follower")
    wait_until(lambda: walker.ended == ["cancelled"], "the walk to end")


def test_deactivating_ends_goals_and_says_why(site: Site) -> None:
    site.start(Walker, "walker")
    goal = site.client.goal("walk", Number(10_000), Number, Number)
    runtime = site.runtimes["walker"]
    runtime.post(lambda: runtime.lifecycle.perform(Transition.DEACTIVATE))
    with pytest.raises(CallFailed, match="deactivated"):
        goal.result(PATIENCE)


def test_a_client_name_that_is_no_name_is_refused(site: Site) -> None:
    site.start(Oracle, "oracle")
    bus = site.session()
    requests = Writers(bus, RealClock(), Identity("rogue", 1, 1)).open(
        site.keys.request("double"), type_of(Request).encoding
    )
    assert requests.wait_for_reader(PATIENCE)
    plain = {"client": "../**", "number": 1, "verb": "call", "body": None, "patience": 1.0}
    requests.put(codec.pack_plain(plain))
    wait_until(lambda: site.status("oracle").refused == 1)


def test_a_goal_cancelled_before_anybody_accepted_it_is_never_begun() -> None:
    with Rig() as rig:
        goal = rig.goal("walk", Number(3), Number, Number)
        goal.cancel()
        walker = rig.add(Walker)
        rig.advance(5.0)
        assert walker.ended == []
        assert goal.error is not None
        assert goal.error.answer is Answer.CANCELLED


def test_a_client_that_is_deactivated_while_it_awaits_a_goal_cancels_it() -> None:
    with Rig() as rig:
        walker = rig.add(Walker)
        rig.add(Follower)
        rig.advance(0.1)
        rig.transition("follower", Transition.DEACTIVATE)
        rig.advance(0.1)
        assert walker.ended == ["cancelled"]
