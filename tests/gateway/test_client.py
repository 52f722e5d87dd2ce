"""What a tool may rely on, on either bus."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from regraft import CallFailed, Component, Output, Parameter, RequestRefused, action, service
from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.management.manager import CancelAdaptation, JournalPage, JournalRequest
from regraft.bus_schema.messages.protocol.control import ParameterValues, SetTransition
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import Image
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client import (
    Client,
    ClientGoal,
    ControlRefused,
    NoSuchComponent,
    NoSuchHost,
    TopicSample,
    as_json,
    read_plain,
)
from regraft.client.listener import LOOK_AWAY, Listener
from regraft.client.topics import MAX_WAITING
from tests.gateway.parts import HostStub
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

SLOWLY = Twist.planar(0.2, 0.1)


class Worker(Component):
    """Counts its calls, and works on goals."""

    speed = Parameter(1.0, minimum=0.0, maximum=2.0)
    work = Output(Twist)

    def __init__(self) -> None:
        self.calls = 0
        self.go_on = False

    @service("count")
    def count(self, request: CancelAdaptation) -> JournalPage:
        """Count."""
        self.calls += 1
        if request.id == "bad":
            raise RequestRefused("bad is not counted")
        if request.id == "worse":
            raise ValueError("worse breaks it")
        return JournalPage((), more=self.calls > 1)

    @service("never")
    async def never(self, request: JournalRequest) -> JournalPage:
        """Never answer."""
        await self.kit.sleep(3600.0)
        return JournalPage(())

    @action("labour", feedback=CancelAdaptation)
    async def labour(self, goal: JournalRequest) -> JournalPage:
        """Work until told that it is enough."""
        self.kit.feedback(CancelAdaptation("half-way"))
        while not self.go_on:
            await self.kit.sleep(0.01)
        return JournalPage((), more=True)


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    site = Site(request.param)
    yield site
    site.close()


@pytest.fixture
def worker(site: Site) -> Worker:
    return site.start(Worker, "worker")


@pytest.fixture
def client(site: Site, worker: Worker) -> Iterator[Client]:
    with Client(site.session(), "site") as client:
        yield client


def test_a_service_is_called_once_per_call(client: Client, worker: Worker) -> None:
    assert client.call("count", CancelAdaptation("1"), JournalPage) == JournalPage(())
    assert client.call("count", CancelAdaptation("1"), JournalPage) == JournalPage((), more=True)
    assert worker.calls == 2


def test_refusal_failure_and_silence_are_told_apart(client: Client) -> None:
    with pytest.raises(CallFailed, match="bad is not counted") as refused:
        client.call("count", CancelAdaptation("bad"), JournalPage)
    assert refused.value.answer is Answer.REFUSED
    with pytest.raises(CallFailed, match="worse breaks it") as failed:
        client.call("count", CancelAdaptation("worse"), JournalPage)
    assert failed.value.answer is Answer.FAILED
    wait_until(lambda: client.reaches("never"), "the service that never answers is known")
    with pytest.raises(CallFailed, match=r"no answer within 0\.3 s") as silent:
        client.call("never", JournalRequest(), JournalPage, 0.3)
    assert silent.value.answer is None
    with pytest.raises(CallFailed, match="nobody offers this service"):
        client.call("nothing", JournalRequest(), JournalPage, 0.3)


def test_a_service_that_comes_late_is_still_found(site: Site) -> None:
    answers: list[JournalPage] = []
    with Client(site.session(), "site") as client:
        late = threading.Thread(
            target=lambda: answers.append(client.call("count", CancelAdaptation("1"), JournalPage, PATIENCE))
        )
        late.start()
        site.start(Worker, "worker")
        late.join(PATIENCE)
    assert answers == [JournalPage(())]


def test_what_cannot_travel_is_refused_at_once(client: Client) -> None:
    with pytest.raises(BadMessage):
        client.call("count", CancelAdaptation(7), JournalPage)  # type: ignore[arg-type]
    assert client.call("count", CancelAdaptation("1"), JournalPage)


def test_calls_from_many_threads_get_their_own_answers(client: Client, worker: Worker) -> None:
    answers: list[JournalPage] = []
    threads = [
        threading.Thread(target=lambda: answers.append(client.call("count", CancelAdaptation("1"), JournalPage)))
        for _ in range(20)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert len(answers) == worker.calls == 20


def begin(client: Client, **more: Any) -> ClientGoal[JournalPage, CancelAdaptation]:
    return client.goal("labour", JournalRequest(), JournalPage, CancelAdaptation, **more)


def test_a_goal_gives_feedback_and_a_result(client: Client, worker: Worker) -> None:
    told: list[CancelAdaptation] = []
    goal = begin(client, on_feedback=told.append)
    with pytest.raises(CallFailed, match="still being pursued"):
        goal.result(0.05)
    assert not goal.done
    wait_until(lambda: told == [CancelAdaptation("half-way")])
    assert goal.feedback == told[0]
    worker.go_on = True
    assert goal.result(PATIENCE) == JournalPage((), more=True)
    assert goal.done


def test_a_cancelled_goal_says_so(client: Client) -> None:
    goal = begin(client)
    goal.cancel()
    with pytest.raises(CallFailed) as cancelled:
        goal.result(PATIENCE)
    assert cancelled.value.answer is Answer.CANCELLED


def test_a_goal_nobody_takes_up_fails_within_its_bound(client: Client) -> None:
    with pytest.raises(CallFailed, match="nobody offers"):
        client.goal("nothing", JournalRequest(), JournalPage, accept_within=0.3)


def test_a_component_is_described_viewed_and_controlled(client: Client) -> None:
    assert client.describe("worker").description == "Counts its calls, and works on goals."
    assert client.view("worker").parameters == {"speed": 1.0}
    client.control("worker", "parameters", ParameterValues({"speed": 2.0}))
    assert client.view("worker").parameters == {"speed": 2.0}
    client.control("worker", "transition", SetTransition(Transition.DEACTIVATE))
    assert client.view("worker").state is State.INACTIVE


def test_a_refused_control_query_says_why(client: Client) -> None:
    with pytest.raises(ControlRefused, match=r"at most 2\.0") as refused:
        client.control("worker", "parameters", ParameterValues({"speed": 3.0, "colour": "red"}))
    assert len(refused.value.problems) == 2


def test_an_unknown_component_is_named_with_those_that_are_there(client: Client) -> None:
    with pytest.raises(NoSuchComponent, match=r"'nobody'.*worker"):
        client.view("nobody")
    with pytest.raises(NoSuchHost):
        client.logs("worker")
    with pytest.raises(NoSuchHost, match="none"):
        client.host_view("local")


def test_components_are_seen_with_state_host_and_process(site: Site, client: Client) -> None:
    host = HostStub(site.session(), site.keys)
    wait_until(lambda: client.components(PATIENCE).keys() == {"worker", "navigator"})
    seen = client.components(PATIENCE)
    assert seen["worker"].alive
    assert seen["worker"].status
    assert seen["worker"].status.state is State.ACTIVE
    assert not seen["navigator"].alive
    assert seen["navigator"].process
    assert (seen["navigator"].host, seen["navigator"].process.pid) == ("local", 4711)
    assert client.hosts()["local"].alive
    assert client.logs("navigator", 2) == ("line 998", "line 999")
    host.close()


def test_a_component_that_left_is_seen_no_more(site: Site, client: Client) -> None:
    assert "worker" in client.components()
    site.stop("worker")
    wait_until(lambda: "worker" not in client.components())


def test_a_topic_is_seen_in_its_type_or_as_plain_data(site: Site, client: Client) -> None:
    typed: list[TopicSample] = []
    plain: list[TopicSample] = []
    wrong = client.topic("work", Quality, lambda _: None)
    client.topic("work", Twist, typed.append)
    client.topic("work", None, plain.append)
    writer = site.writer("work", Twist, "somebody")
    wait_until(lambda: writer.matched)

    def put_and_look() -> bool:
        writer.mark()
        writer.put(codec.encode(SLOWLY))
        return bool(typed and plain and wrong.refused)

    wait_until(put_and_look)
    assert typed[-1].message == SLOWLY
    assert plain[-1].message == codec.to_plain(SLOWLY)
    assert (plain[-1].type, plain[-1].source) == ("regraft/Twist@1", "somebody")
    assert "regraft/Quality" in wrong.last_problem


def test_what_is_told_of_requirements_is_heard_until_the_subscription_is_closed(site: Site, client: Client) -> None:
    heard: list[Quality] = []
    listening = client.requirements(heard.append)
    reporter = site.runtimes["worker"]
    told = Quality(0.0, "MoveSafely", "Safety", satisfied=True)
    wait_until(lambda: reporter.post(lambda: reporter.reporter.quality(told)) or bool(heard))  # type: ignore[func-returns-value]
    assert heard[0] == told
    listening.close()
    client.call("count", CancelAdaptation("1"), JournalPage)
    heard.clear()
    reporter.post(lambda: reporter.reporter.quality(told))
    client.call("count", CancelAdaptation("1"), JournalPage)
    assert heard == []


def test_events_are_heard_until_the_subscription_is_closed(site: Site, client: Client) -> None:
    heard: list[Event] = []
    listening = client.events(heard.append)
    reporter = site.runtimes["worker"]
    wait_until(lambda: reporter.post(lambda: reporter.reporter.event("test.done", "it is")) or bool(heard))  # type: ignore[func-returns-value]
    assert heard[0].kind == "test.done"
    listening.close()
    client.call("count", CancelAdaptation("1"), JournalPage)
    heard.clear()
    reporter.post(lambda: reporter.reporter.event("test.done", "again"))
    client.call("count", CancelAdaptation("1"), JournalPage)
    assert heard == []


def test_a_callback_that_waits_for_its_own_client_is_told_so(site: Site, client: Client) -> None:
    errors: list[str] = []

    def wait_for_client(_: Event) -> None:
        try:
            client.call("count", CancelAdaptation("1"), JournalPage)
        except RuntimeError as error:
            errors.append(str(error))

    client.events(wait_for_client)
    runtime = site.runtimes["worker"]
    wait_until(lambda: runtime.post(lambda: runtime.reporter.event("a", "b")) or bool(errors))  # type: ignore[func-returns-value]
    assert "callback" in errors[0]


def test_closing_frees_whoever_waits(client: Client) -> None:
    errors: list[CallFailed] = []
    goal = begin(client)

    def wait() -> None:
        try:
            goal.result(PATIENCE)
        except CallFailed as error:
            errors.append(error)

    waiting = threading.Thread(target=wait)
    waiting.start()
    client.close()
    waiting.join(PATIENCE)
    assert "closed" in errors[0].why
    with pytest.raises(CallFailed, match="closed"):
        client.call("count", CancelAdaptation("1"), JournalPage)


def test_arrays_are_shown_by_layout_and_small_ones_by_value() -> None:
    image = Image(0.0, "camera", "base", Pose(), 1.0, np.zeros((2, 3, 3), np.uint8))
    shown = as_json(image)
    assert shown["pixels"] == {"dtype": "|u1", "shape": [2, 3, 3], "data": np.zeros((2, 3, 3), int).tolist()}
    large = as_json({"a": np.zeros(65), "b": b"\x00\xff", "c": [float("inf"), float("-inf")]})
    assert large == {
        "a": {"dtype": "<f8", "shape": [65], "data": "..."},
        "b": "AP8=",
        "c": ["Infinity", "-Infinity"],
    }


@pytest.mark.parametrize(
    "payload", [b"", b"\x01", b"\xff\xff\xff\xff", b"\x01\x00\x00\x00\xc1", b"\x01\x00\x00\x00\x90"]
)
def test_garbage_is_refused_as_a_bad_message(payload: bytes) -> None:
    with pytest.raises(BadMessage):
        read_plain(payload, type_of(Image).encoding)


def test_a_client_reads_what_waits_before_it_asks_again(site: Site) -> None:
    looks: list[float] = []
    ended: list[float] = []
    held, read = threading.Event(), 0
    listener = Listener(site.session(), "reader", lambda: looks.append(time.monotonic()))

    def take(_: Sample) -> None:
        nonlocal read
        read += 1
        held.wait(PATIENCE)
        if read == 1000:
            ended.append(time.monotonic())

    subscription = listener.subscribe(site.keys.topic("numbers"), take)
    publisher = site.session().publisher(site.keys.topic("numbers"), "", reliable=True)
    wait_until(lambda: publisher.matched)
    for _ in range(1000):
        publisher.put(b"x", b"")
    wait_until(lambda: read == 1 and listener._inbox.qsize() == 999, "all others wait")
    begun = time.monotonic()
    looks.clear()
    held.set()
    wait_until(lambda: ended, "all to be read")
    subscription.close()
    listener.stop()
    assert len([look for look in looks if look < ended[0]]) <= 2 + (ended[0] - begun) / LOOK_AWAY


def test_samples_that_cannot_be_opened_leave_room_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    hub = MemoryHub()
    mine, other = MemoryBus(hub), MemoryBus(hub)
    client, seen, sent = Client(mine, "site", "tester"), list[TopicSample](), list[int]()
    subscription = client.topic("pictures", None, seen.append)
    publisher = other.publisher(Keys("site").topic("pictures"), type_of(Twist).encoding, reliable=True)

    def put() -> None:
        sent.append(len(sent) + 1)
        publisher.put(codec.encode(SLOWLY), Envelope("camera", 1, 1, sent[-1], 0).to_bytes())

    try:
        with monkeypatch.context() as patched:
            patched.setattr(mine, "open_sample", lambda item: None)
            while len(sent) < 2 * MAX_WAITING:
                put()
                wait_until(lambda: subscription.dropped == len(sent))
        put()
        wait_until(lambda: [sample.sequence for sample in seen] == sent[-1:])
    finally:
        client.close()
