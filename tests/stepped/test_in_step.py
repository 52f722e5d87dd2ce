"""What simulated time in step promises, on either bus."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping

import pytest

from regraft import Component, Input, Parameter, every, service
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import CauseCode, Join
from regraft.bus_schema.messages.protocol.control import ResentSample
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.lockstep import source
from tests.stepped.parts import Adviser, Clerk, Pusher, Reading, Sleeper, Text, TinyWorld, Waker, Witness
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE, wait_until


class Thinker(Component):
    """Thinks twice at a time, and says then what it does next; the second thought may take until it has said so."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []
        self.has_said = threading.Event()
        self.waits = False

    @every(seconds=1.0)
    async def first(self) -> None:
        self.has_said.clear()
        await self.kit.compute(int)
        self.kit.spawn(self._say())

    async def _say(self) -> None:
        self.said.append("said")
        self.has_said.set()

    @every(seconds=1.0)
    async def second(self) -> None:
        await self.kit.compute(self.has_said.wait, PATIENCE if self.waits else 0.0)
        self.said.append("thought")

    @every(seconds=1.0)
    def be_busy(self) -> None:
        """Look at nothing until both thoughts are done, if none waits for the other."""
        if not self.waits:
            both = threading.Event()
            self.kit.compute(both.set)
            assert both.wait(PATIENCE)


class SlowThinker(Thinker):
    """Does not have its second thought before it has said what the first one was."""

    def __init__(self) -> None:
        super().__init__()
        self.waits = True


class ThinkingWorld(Thinker, TinyWorld):
    """A world that thinks."""


class SlowlyThinkingWorld(SlowThinker, TinyWorld):
    """A world that thinks slowly."""


class Limiter(Component):
    """Sleeps after each message until a time long ago, or for ever."""

    heard = Input(Reading, topic="position")
    seconds = Parameter(0.0, unit="s")

    @heard.handler
    async def take(self, reading: Reading) -> None:
        await self.kit.sleep(self.seconds)


class Dial(Component):
    """Notes which tick it is at which time, in its steps and when anybody asks."""

    def __init__(self) -> None:
        self.seen: set[tuple[int, int | None]] = set()

    @every(seconds=0.05)
    def look(self) -> None:
        self.seen.add((round(self.kit.now() * 1000), self.kit.tick))

    @service("look")
    def look_for(self, asked: Text) -> Text:
        self.look()
        return asked


EVERYBODY = ("adviser", "clerk", "pusher", "witness")


@pytest.mark.parametrize("seconds", [-1e3, 1e12])
def test_a_sleep_until_long_ago_or_for_ever_ends_nobody(seconds: float) -> None:
    steps = StepSite("memory")
    try:
        steps.start(Limiter, "limiter", parameters={"seconds": seconds})
        steps.start_world(TinyWorld, ("limiter",), 1.0)
        assert steps.wait_finished().reproducible
    finally:
        steps.close()


def _start_all(steps: StepSite, duration: float) -> None:
    steps.start(Pusher, "pusher")
    steps.start(Adviser, "adviser")
    steps.start(Witness, "witness")
    steps.start(Clerk, "clerk")
    steps.start_world(TinyWorld, EVERYBODY, duration)


def _digest(kind: str, goal: float = 3.0) -> str:
    steps = StepSite(kind)
    try:
        steps.start(Pusher, "pusher", parameters={"goal": goal})
        steps.start(Adviser, "adviser")
        steps.start(Witness, "witness")
        steps.start(Clerk, "clerk")
        steps.start_world(TinyWorld, EVERYBODY, 5.0)
        told = steps.wait_finished()
        assert told.reproducible
        assert (told.tick, told.time) == (99, 5_000_000_000)
        witness: Witness = steps.component("witness")
        assert len([entry for entry in witness.seen if entry[0] == "position"]) >= 90
        assert len([entry for entry in witness.seen if entry[0] == "push"]) >= 45
        return witness.digest()
    finally:
        steps.close()


def test_equal_runs_are_equal_on_every_bus_and_others_differ() -> None:
    runs = {_digest("memory"), _digest("memory"), _digest("zenoh"), _digest("zenoh")}
    assert len(runs) == 1
    assert _digest("memory", goal=4.0) not in runs


@pytest.mark.parametrize("cls", [Thinker, SlowThinker])
def test_what_heavy_work_leads_to_comes_in_the_same_order_on_every_machine(
    steps: StepSite, cls: type[Component]
) -> None:
    steps.start(cls, "thinker")
    steps.start_world(TinyWorld, ("thinker",), 3.5)
    steps.wait_finished()
    assert steps.component("thinker").said == ["said", "thought"] * 3


@pytest.mark.parametrize("cls", [ThinkingWorld, SlowlyThinkingWorld])
def test_so_it_does_in_the_source_of_time(steps: StepSite, cls: type[TinyWorld]) -> None:
    steps.start_world(cls, (), 3.5)
    steps.wait_finished()
    assert steps.component("world").said == ["said", "thought"] * 3


def test_time_goes_on_at_the_rate_of_ticks(steps: StepSite) -> None:
    _start_all(steps, 5.0)
    steps.wait_finished()
    witness: Witness = steps.component("witness")
    stamps = [stamp for kind, stamp, _ in witness.seen if kind == "position"]
    assert stamps == pytest.approx([0.05 * (n + 1) for n in range(len(stamps))])


def test_the_world_feels_what_the_members_do(steps: StepSite) -> None:
    _start_all(steps, 15.0)
    steps.wait_finished()
    assert steps.component("world").x == pytest.approx(3.0, abs=0.1)


def test_a_slot_takes_no_simulated_time_and_questions_are_answered_in_it(steps: StepSite) -> None:
    _start_all(steps, 5.0)
    steps.wait_finished()
    clerk: Clerk = steps.component("clerk")
    assert clerk.slots == [0.0] * 5
    assert clerk.log == [f"1 at {float(n)}" for n in range(1, 6)]


def test_a_question_outside_a_slot_is_refused(steps: StepSite) -> None:
    _start_all(steps, 1.0)
    steps.wait_finished()
    with pytest.raises(RuntimeError, match="exclusive"):
        steps.component("pusher").kit.ask("anything", b"", 1.0)


def test_what_comes_from_outside_is_handled_in_a_slot(steps: StepSite) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    answer = steps.client.call("file", Text("hello"), Text, PATIENCE)
    assert answer.text == "HELLO"
    assert answer.number > 1000


def test_a_component_that_is_never_stepped_knows_the_time_in_its_slot(steps: StepSite) -> None:
    steps.start(Adviser, "adviser")
    steps.start_world(TinyWorld, ("adviser",), 3600.0)
    steps.wait_for_time(2.0)
    told = steps.told()
    assert steps.client.call("advise", Reading(0.0, 1.0), Reading, PATIENCE).stamp >= told.time / 1e9


class Questioner(Component):
    """Asks many questions one after another."""

    def __init__(self) -> None:
        self.ticks: list[int | None] = []

    @every(seconds=1.0)
    async def ask(self) -> None:
        for _ in range(20):
            self.ticks.append(self.kit.tick)
            await self.kit.call("advise", Reading(self.kit.now(), 1.0), Reading)


def test_calls_in_a_row_take_no_time_up_to_the_rounds_of_a_tick(steps: StepSite) -> None:
    steps.start(Adviser, "adviser")
    steps.start(Questioner, "questioner")
    steps.start_world(TinyWorld, ("adviser", "questioner"), 1.5)
    assert steps.wait_finished().reproducible
    assert steps.component("questioner").ticks == [19] * 16 + [20] * 4


def test_a_tick_has_one_number_also_for_what_comes_before_the_next(steps: StepSite) -> None:
    steps.start(Dial, "dial")
    steps.start_world(TinyWorld, ("dial",), 1.0)
    steps.wait_finished()
    assert steps.client.call("look", Text("late"), Text, PATIENCE)
    assert steps.component("dial").seen == {(50 * (n + 1), n) for n in range(20)}


def test_a_new_source_of_time_counts_on(steps: StepSite) -> None:
    steps.start(Dial, "dial")
    steps.start_world(TinyWorld, ("dial",), 3600.0)
    steps.wait_for_time(1.0)
    steps.end("world")
    last = steps.component("dial").kit.now()
    steps.start(TinyWorld, "world", incarnation=2, members=("dial",), parameters={"speed": "max"})
    steps.wait_for_time(last + 2.0)
    seen = sorted(steps.component("dial").seen)
    assert seen == [(50 * (n + 1), n) for n in range(len(seen))]


def test_outsiders_are_answered_while_time_stands_still(steps: StepSite) -> None:
    _start_all(steps, 1.0)
    steps.wait_finished()
    assert steps.client.call("file", Text("late"), Text, PATIENCE) == Text("LATE", 1000)


def test_a_member_may_join_later_and_is_stepped_from_then_on(steps: StepSite) -> None:
    steps.start(Adviser, "adviser")
    steps.start(Pusher, "pusher")
    steps.start_world(TinyWorld, ("adviser", "pusher"), 3600.0)
    steps.wait_for_time(2.0)
    steps.start(Witness, "witness")
    wait_until(lambda: "witness" in steps.runtimes and len(steps.component("witness").seen) > 20)
    assert steps.told().reproducible


def test_a_member_that_leaves_does_not_stop_time_and_the_run_is_marked(steps: StepSite) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    steps.end("adviser")
    steps.end("witness")
    told = steps.told(lambda t: set(t.dropped) == {"adviser", "witness"}, "both to be dropped")
    assert not told.reproducible
    assert {(cause.code, cause.component) for cause in told.causes} == {
        (CauseCode.LEFT, "adviser"),
        (CauseCode.LEFT, "witness"),
    }
    assert all(cause.stamp >= 1.0 for cause in told.causes)
    steps.wait_for_time(told.time / 1e9 + 2.0)


def test_a_member_that_leaves_in_the_middle_of_a_step_has_lost_no_messages(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    runtime = steps.runtimes["witness"]
    take_samples = runtime.inbound.arrive_early

    def end_and_take(samples: Mapping[str, ResentSample]) -> None:
        runtime.lifecycle.reach(State.FINALIZED)
        take_samples(samples)

    monkeypatch.setattr(runtime.inbound, "arrive_early", end_and_take)
    steps.threads["witness"].join()
    told = steps.told(lambda t: t.dropped == ("witness",), "it to be dropped")
    assert {(cause.code, cause.component) for cause in told.causes} == {(CauseCode.LEFT, "witness")}


def test_a_member_that_comes_back_goes_on(steps: StepSite) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    steps.end("adviser")
    steps.start(Adviser, "adviser", incarnation=2)
    told = steps.told(lambda t: "adviser" in t.dropped and "adviser" in t.members, "the adviser's second run to join")
    world: TinyWorld = steps.component("world")
    steps.wait_for_time(told.time / 1e9 + 8.0)
    wait_until(lambda: world.x == pytest.approx(3.0, abs=0.2), "the world to be where it should")


def test_a_new_source_of_time_takes_the_members_over_and_time_does_not_go_back(steps: StepSite) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(2.0)
    before = steps.component("pusher").kit.now()
    steps.end("world")
    steps.start(TinyWorld, "world", incarnation=2, members=EVERYBODY, parameters={"speed": "max"})
    wait_until(lambda: steps.component("pusher").kit.now() > before + 2.0, "time going on")
    stamps = [stamp for kind, stamp, _ in steps.component("witness").seen if kind == "position"]
    assert stamps == sorted(stamps)


def test_a_new_source_of_time_waits_for_a_member_that_lives_and_is_slow(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(source, "MEMBERS_BACK_TIMEOUT", 0.1)
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    steps.end("world")
    last, may_go_on, joins = steps.told(), threading.Event(), Counter[str]()
    steps.runtimes["pusher"].post(lambda: may_go_on.wait(PATIENCE))
    steps.listen("steps/clock/join", lambda sample: joins.update([codec.decode(sample.payload, Join).member]))
    steps.start(TinyWorld, "world", incarnation=2, members=EVERYBODY, parameters={"speed": "max"})
    wait_until(lambda: joins["adviser"] > 4, "the others to ask again and again")
    assert not joins["pusher"]
    may_go_on.set()
    told = steps.told(lambda t: t.time > last.time + 1e9, "time to go on")
    assert set(told.members) == {*EVERYBODY, "world"}
    assert told.dropped == ()


def test_a_new_source_of_time_says_whom_it_left_behind(steps: StepSite, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "MEMBERS_BACK_TIMEOUT", 0.1)
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    steps.end("world")
    steps.end("pusher")
    steps.start(TinyWorld, "world", incarnation=2, members=EVERYBODY, parameters={"speed": "max"})
    told = steps.told(lambda t: "pusher" in t.dropped, "the one left behind to be told")
    assert not told.reproducible
    assert [(cause.code, cause.component) for cause in told.causes] == [
        (CauseCode.SOURCE_RESTARTED, "world"),
        (CauseCode.NOT_JOINED, "pusher"),
    ]


def test_a_deactivated_member_is_silent_and_comes_back(steps: StepSite) -> None:
    _start_all(steps, 3600.0)
    steps.wait_for_time(1.0)
    pusher = steps.runtimes["pusher"]
    pusher.post(lambda: pusher.lifecycle.perform(Transition.DEACTIVATE))
    wait_until(lambda: not pusher.timers.periodic)
    told = steps.told()
    steps.wait_for_time(told.time / 1e9 + 2.0)
    published = pusher.writers.sequences()
    steps.wait_for_time(told.time / 1e9 + 4.0)
    assert pusher.writers.sequences() == published


def test_a_component_that_nothing_has_woken_knows_the_time_when_it_is_activated(steps: StepSite) -> None:
    steps.start_world(TinyWorld, ("sleeper", "waker"), 4.0)
    steps.start(Sleeper, "sleeper", state=State.INACTIVE)
    steps.start(Waker, "waker")
    steps.wait_finished()
    assert steps.component("sleeper").activated == steps.component("waker").asked == [3.0]


def test_an_input_that_is_only_read_wakes_nobody(steps: StepSite) -> None:
    _start_all(steps, 2.0)
    steps.wait_finished()
    witness = steps.runtimes["witness"]
    assert not witness.inputs["position"].wakes
