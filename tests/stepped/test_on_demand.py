"""An input that is read on demand sees what any other would see, and nothing is made that nobody opens."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from regraft import Component, Input, Output, Parameter, every
from regraft.bus.inbox import Inbox
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import is_marker
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resend
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data.fetching import Fetching, notice
from regraft.runtime.data.writers import Identity, Writers
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

Seen = tuple[float, float, float]
"""When something was seen, its stamp, its value."""


class Eye(Component):
    """Takes a picture ten times a second, of where the world is then."""

    position = Input(Reading)
    picture = Output(Reading)
    fails_at = Parameter(-1.0)
    blind_from = Parameter(1e9)

    def __init__(self) -> None:
        self.made: list[float] = []

    @every(hz=10)
    def look(self) -> None:
        now, position = self.kit.now(), self.position.opener()
        if position is not None and self.picture.wanted and now < self.blind_from:
            self.picture.publish_deferred(lambda: self._picture(now, position))

    def _picture(self, now: float, position: Callable[[], Reading | None]) -> Reading:
        self.made.append(now)
        seen = position()
        if now == self.fails_at or seen is None:
            raise RuntimeError("too dark")
        return Reading(now, seen.stamp)


class LazyEye(Eye):
    """The same; it opens even the position only for a picture that is opened."""

    position = Input(Reading, latest_only=True, on_demand=True)


class LazyWorld(TinyWorld):
    """Has its position made for who opens it."""

    def advance(self, tick: int, seconds: float) -> None:
        now, x = self.kit.now(), self.x
        if self.position.wanted:
            self.position.publish_deferred(lambda: Reading(now, x))


class Viewer(Component):
    """Looks once a second: at the newest picture, then at the next one."""

    picture = Input(Reading, latest_only=True)

    def __init__(self) -> None:
        self.viewed: list[Seen] = []

    @every(seconds=1.0)
    async def view(self) -> None:
        newest = self.picture.latest
        if newest is not None:
            self.viewed.append((self.kit.now(), newest.stamp, newest.value))
        following = await self.picture.next()
        self.viewed.append((self.kit.now(), following.stamp, following.value))


class Glancer(Viewer):
    """The same, on demand."""

    picture = Input(Reading, latest_only=True, on_demand=True)


class Both(Glancer):
    """Reads the topic by another input as well, which gets every message."""

    every_picture = Input(Reading, topic="picture", keep=100)

    def __init__(self) -> None:
        super().__init__()
        self.all: list[float] = []

    @every(seconds=0.5)
    def collect(self) -> None:
        self.all += [picture.stamp for picture in self.every_picture.take()]


class Watcher(Component):
    """Looks twice a second at what is there."""

    picture = Input(Reading, latest_only=True, on_demand=True)

    def __init__(self) -> None:
        self.seen: list[tuple[float, float]] = []

    @every(seconds=0.5)
    def watch(self) -> None:
        newest = self.picture.latest
        if newest is not None:
            self.seen.append((self.kit.now(), newest.stamp))


class Twin(Component):
    """Looks at what its twin shows, which looks at what this one shows, at the same moment."""

    theirs = Input(Reading, latest_only=True, on_demand=True)
    mine = Output(Reading)

    def __init__(self) -> None:
        self.seen: list[float] = []

    @every(hz=10)
    def look(self) -> None:
        now, seen = self.kit.now(), self.theirs.latest
        if seen is not None:
            self.seen.append(seen.stamp)
        self.mine.publish_deferred(lambda: Reading(now, 0.0))


class LazyTwin(Twin):
    """It looks every half second alone. What it shows is made of what its twin showed, and that of what it showed."""

    @every(hz=10)
    def look(self) -> None:
        now, theirs = self.kit.now(), self.theirs.opener()
        seen = self.theirs.latest if round(10 * now) % 5 == 0 else None
        if seen is not None:
            self.seen.append(seen.stamp)
            assert seen.value == pytest.approx(10 * seen.stamp - 1), "one more for each that it is made of"
        self.mine.publish_deferred(lambda: Reading(now, self._count(theirs)))

    @staticmethod
    def _count(theirs: Callable[[], Reading | None] | None) -> float:
        before = theirs() if theirs is not None else None
        return before.value + 1.0 if before is not None else 0.0


def _run(
    steps: StepSite,
    eye: type[Eye] = Eye,
    viewer: type[Viewer] = Glancer,
    world: type[TinyWorld] = TinyWorld,
    parameters: dict[str, float] | None = None,
) -> tuple[list[Seen], list[float]]:
    steps.start(eye, "eye", parameters=parameters or {})
    steps.start(viewer, "viewer")
    steps.start_world(world, ("eye", "viewer"), 4.0)
    assert steps.wait_finished().reproducible
    viewed: Viewer = steps.component("viewer")
    taken: Eye = steps.component("eye")
    return viewed.viewed, taken.made


def test_only_what_is_opened_is_made_and_it_is_of_its_moment(steps: StepSite) -> None:
    viewed, made = _run(steps)
    assert made == [stamp for _, stamp, _ in viewed], "two of each ten pictures"
    assert len(made) == 7
    assert all(value == pytest.approx(stamp) for _, stamp, value in viewed)


def test_it_sees_what_an_input_sees_that_gets_everything() -> None:
    seen = []
    for viewer in (Glancer, Viewer):
        steps = StepSite("memory")
        try:
            seen.append(_run(steps, viewer=viewer))
        finally:
            steps.close()
    assert seen[0][0] == seen[1][0]
    assert len(seen[1][1]) > 30, "who subscribes gets every picture"


def test_what_is_opened_may_itself_be_opened_only_then(steps: StepSite) -> None:
    viewed, made = _run(steps, LazyEye, Glancer, LazyWorld)
    assert [stamp for _, stamp, _ in viewed] == made
    assert all(value == pytest.approx(stamp) for _, stamp, value in viewed)


def test_an_onlooker_gets_every_message_and_the_reader_the_same_as_ever(steps: StepSite) -> None:
    heard: list[float] = []
    steps.listen(
        "steps/topic/picture",
        lambda s: None if is_marker(s.attachment) else heard.append(codec.decode(s.payload, Reading).stamp),
    )
    viewed, made = _run(steps)
    assert len(viewed) == 7
    wait_until(lambda: heard == made, "the onlooker to have every picture")
    assert len(heard) > 30


def test_another_input_of_the_same_component_gets_every_message(steps: StepSite) -> None:
    viewed, _ = _run(steps, viewer=Both)
    both: Both = steps.component("viewer")
    assert len(viewed) == 7
    assert both.all == pytest.approx([n / 10 for n in range(1, 40)])


@pytest.mark.parametrize("subscribed", [True, False])
def test_who_asks_for_what_is_just_being_made_has_to_wait(subscribed: bool) -> None:
    bus, key = MemoryBus(MemoryHub()), "steps/topic/picture"
    writers = Writers(bus, SteppedClock(), Identity("eye", 1, 1))
    writers.keeps_history = writers.lockstep = True
    asked, waits = Resend(key, 0, 1, 1), []

    def make() -> Reading:
        waits.append(writers.is_making(asked))
        return Reading(1.0, 1.0)

    if subscribed:
        bus.subscribe(key, lambda _: None)
    writers.open(key, type_of(Reading).encoding).put_deferred(lambda: codec.encode(make()))
    assert len(writers.resend(asked).samples) == 1
    assert waits == [True]
    assert not writers.is_making(asked)


def test_what_cannot_be_made_is_reported_and_what_was_seen_before_stays(steps: StepSite) -> None:
    viewed, _ = _run(steps, parameters={"fails_at": 2.0})
    assert [stamp for now, stamp, _ in viewed if 1.9 < now < 2.2] == pytest.approx([1.9, 2.1])
    assert "too dark" in steps.runtimes["eye"].reporter.status.error


def test_the_last_message_is_there_after_its_writer_has_stopped(steps: StepSite) -> None:
    steps.start(Eye, "eye")
    steps.start(Glancer, "viewer")
    steps.start_world(TinyWorld, ("eye", "viewer"), 3600.0)
    steps.wait_for_time(1.5)
    steps.runtimes["eye"].post(lambda: steps.runtimes["eye"].lifecycle.perform(Transition.DEACTIVATE))
    wait_until(lambda: steps.runtimes["eye"].state is State.INACTIVE, "the eye to rest")
    viewer: Glancer = steps.component("viewer")
    eye: Eye = steps.component("eye")
    last = eye.made[-1]
    wait_until(lambda: viewer.viewed[-1][1] == last, "the last picture to be seen")
    assert steps.told().reproducible


def test_a_component_that_ends_makes_nothing_that_nobody_has_opened(steps: StepSite) -> None:
    steps.start(LazyEye, "eye")
    steps.start(Watcher, "viewer")
    steps.start_world(LazyWorld, ("eye", "viewer"), 1.9)
    steps.wait_finished()
    eye: LazyEye = steps.component("eye")
    made = list(eye.made)
    steps.runtimes["eye"].post(lambda: steps.runtimes["eye"].lifecycle.reach(State.FINALIZED))
    wait_until(lambda: steps.runtimes["eye"].state is State.FINALIZED, "the eye to end")
    assert eye.made == made
    assert steps.runtimes["eye"].reporter.status.error == ""


def test_a_reader_of_a_writer_that_was_killed_keeps_what_it_has_seen(steps: StepSite) -> None:
    steps.start(Eye, "eye")
    steps.start(Watcher, "viewer")
    steps.start_world(TinyWorld, ("eye", "viewer"), 3600.0)
    steps.wait_for_time(2.5)
    eye: Eye = steps.component("eye")
    steps.kill("eye")
    told = steps.told(lambda t: "eye" in t.dropped, "the eye to be dropped")
    steps.wait_for_time(told.time / 1e9 + 3.0)
    watcher: Watcher = steps.component("viewer")
    late = [stamp for now, stamp in watcher.seen if now > told.time / 1e9 + 0.5]
    assert len(late) >= 4, "it goes on"
    assert len(set(late)) == 1
    assert late[0] in eye.made


@pytest.mark.parametrize(("kind", "seen"), [(Twin, range(1, 40)), (LazyTwin, range(4, 40, 5))])
def test_two_that_read_from_each_other_do_not_wait_for_ever(
    steps: StepSite, kind: type[Twin], seen: Iterable[int]
) -> None:
    steps.start(kind, "castor", connections={"mine": "a", "theirs": "b"})
    steps.start(kind, "pollux", connections={"mine": "b", "theirs": "a"})
    steps.start_world(TinyWorld, ("castor", "pollux"), 4.0)
    assert steps.wait_finished().reproducible
    for name in ("castor", "pollux"):
        twin: Twin = steps.component(name)
        assert twin.seen == pytest.approx([n / 10 for n in seen])
        assert steps.runtimes[name].reporter.status.error == ""


def test_a_writer_that_does_not_answer_is_given_up_and_named() -> None:
    beats: list[float] = []

    def beat() -> float:
        beats.append(0.0)
        return 0.05

    fetching = Fetching(MemoryBus(MemoryHub()), Keys("steps"), Inbox(), beat)
    assert fetching.fetch(notice("steps/topic/picture", "eye", 7)) is None
    assert fetching.take_error() == "steps/topic/picture of eye, 7: no answer"
    assert fetching.take_error() == ""
    assert len(beats) > 10, "it kept its heartbeat"


@pytest.mark.parametrize(
    "declare",
    [
        lambda: Input(Reading, on_demand=True),
        lambda: Input(Reading, on_demand=True, latest_only=True, keep=3),
        lambda: Input(Reading, on_demand=True, latest_only=True, handler="see"),
    ],
)
def test_an_input_on_demand_sees_the_newest_message_alone(declare: Callable[[], object]) -> None:
    with pytest.raises(TypeError, match="on_demand is latest_only, keeps nothing and has no handler"):
        declare()


def test_an_input_on_demand_has_no_handler() -> None:
    declared: Input[Reading] = Input(Reading, latest_only=True, on_demand=True, name="picture")
    with pytest.raises(TypeError, match="no handler opens all"):
        declared.handler(lambda self, message: None)
