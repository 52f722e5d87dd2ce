"""Components read in step what the system says of itself: in the order of everything else, and only where wanted."""

from __future__ import annotations

import pytest

from regraft import Component, Input, Parameter, every
from regraft import Quality as MeasuredQuality
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.management.system import (
    SystemDiagnostics,
    SystemFaults,
    SystemQualities,
    SystemStates,
)
from regraft.bus_schema.messages.protocol.faults import FaultInjected
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE, wait_until

TOPICS = {name: f"system/{name}" for name in ("states", "faults", "diagnostics", "qualities")}
Seen = list[tuple[float, str, str]]


class Ailing(Component):
    """Fails by itself at 1 s, after a complaint; one of its handlers raises at 0.5 s."""

    position = Input(Reading)

    @every(seconds=0.5)
    def work(self) -> None:
        now = self.kit.now()
        self.kit.diagnose("motor", Level.WARNING, f"warm at {now}")
        self.kit.report_quality(Quality(now, "speed", "speed", metric=now))
        if now >= 1.0:
            self.kit.fail("motor burnt")
        else:
            raise RuntimeError("a hiccup")


class Watcher(Component):
    """Writes down what the system says, and when."""

    states = Input(SystemStates, topic="system/states", required=False)
    faults = Input(SystemFaults, topic="system/faults", required=False)
    diagnostics = Input(SystemDiagnostics, topic="system/diagnostics", required=False)
    qualities = Input(SystemQualities, topic="system/qualities", required=False)

    def __init__(self) -> None:
        self.seen: Seen = []

    @states.handler
    def see_states(self, states: SystemStates) -> None:
        told = " ".join(f"{s.component}:{s.state.value if s.state else None}" for s in states.components)
        self.seen.append((self.kit.now(), "states", told))

    @faults.handler
    def see_faults(self, faults: SystemFaults) -> None:
        news = " ".join(f"{fault.component}:{fault.kind.value}" for fault in faults.news)
        self.seen.append((self.kit.now(), "faults", f"{news}; {len(faults.present)} present"))

    @diagnostics.handler
    def see_diagnostics(self, diagnostics: SystemDiagnostics) -> None:
        self.seen.append((self.kit.now(), "diagnostics", " ".join(d.text for d in diagnostics.present)))

    @qualities.handler
    def see_qualities(self, qualities: SystemQualities) -> None:
        self.seen.append((self.kit.now(), "qualities", " ".join(str(q.metric) for q in qualities.qualities)))


class FaultWatcher(Component):
    """Reads faults alone."""

    faults = Input(SystemFaults, topic="system/faults", required=False)

    def __init__(self) -> None:
        self.texts: list[str] = []

    @faults.handler
    def see(self, faults: SystemFaults) -> None:
        self.texts += [fault.text for fault in faults.news]


def _run(steps: StepSite, duration: float = 2.0) -> Seen:
    steps.start(Ailing, "ailing", connections={"position": "position"})
    steps.start(Watcher, "watcher", connections=TOPICS)
    steps.start_world(TinyWorld, ("ailing", "watcher"), duration)
    assert steps.wait_finished().reproducible
    watcher: Watcher = steps.component("watcher")
    return watcher.seen


class Wordy(Component):
    """Has more to tell than a message may hold: one of its news twice, or two of them."""

    position = Input(Reading)
    count = Parameter(1)

    @every(seconds=0.5)
    def work(self) -> None:
        for number in range(self.count):
            self.kit.diagnose(f"motor {number}", Level.WARNING, "warm", seen="x" * 12_000)


@pytest.mark.parametrize("count", [1, 2])
def test_what_is_too_large_together_is_left_out_and_time_goes_on(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    monkeypatch.setattr(codec, "MAX_MESSAGE_SIZE", 20_000)
    steps.start(Wordy, "wordy", parameters={"count": count}, connections={"position": "position"})
    steps.start(Watcher, "watcher", connections=TOPICS)
    steps.start_world(TinyWorld, ("wordy", "watcher"), 2.0)
    assert steps.wait_finished().reproducible
    watcher: Watcher = steps.component("watcher")
    assert not any(text for _, topic, text in watcher.seen if topic == "diagnostics")


def test_a_failure_is_seen_in_its_tick_with_the_state_that_it_left(steps: StepSite) -> None:
    seen = _run(steps)
    assert (1.0, "faults", "ailing:failed; 1 present") in seen
    assert (1.0, "states", "ailing:unconfigured watcher:active world:active") in seen


def test_an_exception_of_a_handler_is_news_in_its_tick_and_does_not_stay(steps: StepSite) -> None:
    assert (0.5, "faults", "ailing:raised; 0 present") in _run(steps)


class Stumbling(Component):
    """Raises far more often in a tick than anybody wants to read, and then fails."""

    def __init__(self) -> None:
        self.stumbled = 0

    @every(seconds=0.5)
    def work(self) -> None:
        for _ in range(150):
            self.kit.spawn(self.stumble())

    async def stumble(self) -> None:
        self.stumbled += 1
        if self.stumbled == 150:
            self.kit.fail("too often")
        raise RuntimeError("a hiccup")


def test_a_failure_is_seen_behind_any_number_of_exceptions(steps: StepSite) -> None:
    steps.start(Stumbling, "stumbling")
    steps.start(Watcher, "watcher", connections=TOPICS)
    steps.start_world(TinyWorld, ("stumbling", "watcher"), 2.0)
    assert steps.wait_finished().reproducible
    (news,) = (text for when, topic, text in steps.component("watcher").seen if (when, topic) == (0.5, "faults"))
    assert news.count(":raised") == 100
    assert news.endswith("stumbling:failed; 1 present")


FAULT = ScheduledFault(0.5, "looker", FaultKind.EXCEPTION)


class Looker(Component):
    """Looks every 2 s, and measures and keeps its state more often."""

    checkpoint_every = 0.1
    sharpness = MeasuredQuality(unit="px", better="higher")

    @every(seconds=2.0)
    def look(self) -> None: ...

    def snapshot(self) -> int:
        return 0

    def restore(self, state: int) -> None: ...

    def evaluate(self) -> dict[str, float]:
        return {"sharpness": 1.0}


class Saboteur(Component):
    """Has the looker's next handler raise, as its host does."""

    @every(seconds=FAULT.at)
    async def inject(self) -> None:
        async with self.kit.exclusive():
            await self.kit.ask(f"{self.kit.system}/component/looker/1/fault", codec.encode(FAULT), PATIENCE)


def test_an_exception_on_the_schedule_is_that_of_a_handler(steps: StepSite) -> None:
    steps.start(Looker, "looker", faults=(FAULT,))
    steps.start(Saboteur, "saboteur")
    steps.start(Watcher, "watcher", connections=TOPICS)
    steps.start_world(TinyWorld, ("looker", "saboteur", "watcher"), 3.0)
    assert steps.wait_finished().reproducible
    seen: Seen = steps.component("watcher").seen
    assert [each for each in seen if "raised" in each[2]] == [(2.0, "faults", "looker:raised; 0 present")]


@pytest.mark.parametrize("seen_by_the_host", ["killed: its loop hung", "killed: no heartbeat since its start"])
def test_an_end_on_the_schedule_has_one_text_however_the_host_has_seen_it(
    steps: StepSite, seen_by_the_host: str
) -> None:
    fault = ScheduledFault(0.5, "looker", FaultKind.STOP)
    steps.serve("steps/host/local/inject", lambda _: FaultInjected("looker", 1, seen_by_the_host))
    steps.start(Looker, "looker")
    steps.start(FaultWatcher, "watcher", connections={"faults": "system/faults"})
    steps.start_world(TinyWorld, ("looker", "watcher"), 1.0, faults=(fault,))
    steps.wait_finished()
    assert steps.component("watcher").texts == ["looker: killed: its loop hung"]


def test_diagnostics_and_qualities_are_seen_in_the_tick_in_which_they_are_reported(steps: StepSite) -> None:
    seen = _run(steps)
    for when in (0.5, 1.0):
        assert (when, "diagnostics", f"warm at {when}") in seen
        assert (when, "qualities", str(when)) in seen


def test_what_is_seen_is_the_same_in_every_run() -> None:
    runs = []
    for kind in ("memory", "zenoh", "zenoh"):
        steps = StepSite(kind)
        try:
            runs.append(_run(steps))
        finally:
            steps.close()
    assert runs[0] == runs[1] == runs[2]


def test_the_end_of_a_process_is_seen_as_the_tick_begins_that_is_without_it(steps: StepSite) -> None:
    steps.start(Ailing, "ailing", connections={"position": "position"})
    steps.start(Watcher, "watcher", connections=TOPICS)
    steps.start_world(TinyWorld, ("ailing", "watcher"), 3600.0)
    steps.wait_for_time(0.2)
    steps.kill("ailing")
    watcher: Watcher = steps.component("watcher")
    wait_until(lambda: any("ailing:died" in text for _, _, text in watcher.seen), "the end to be seen")
    at = next(when for when, _, text in watcher.seen if "ailing:died" in text)
    assert any(when == at and text.startswith("ailing:None") for when, kind, text in watcher.seen if kind == "states")


def test_a_reader_that_comes_late_gets_the_present_state_at_once(steps: StepSite) -> None:
    steps.start(Ailing, "ailing", connections={"position": "position"})
    steps.start_world(TinyWorld, ("ailing",), 3600.0)
    steps.wait_for_time(2.0)
    steps.start(Watcher, "late", connections=TOPICS)
    wait_until(lambda: "late" in steps.runtimes, "the reader")
    late: Watcher = steps.component("late")
    wait_until(lambda: {kind for _, kind, _ in late.seen} >= {*TOPICS}, "all topics to be read")
    began = late.seen[0][0]
    known = {kind: text for when, kind, text in late.seen if when == began}
    assert known["states"].startswith("ailing:unconfigured")
    assert known["faults"].endswith("1 present")
    assert known["diagnostics"] == "warm at 1.0"
    assert known["qualities"] == "1.0"


@pytest.mark.parametrize("reads", [False, True])
def test_nothing_is_published_where_nobody_reads(reads: bool) -> None:
    steps, heard = StepSite("zenoh"), list[Sample]()
    try:
        steps.listen("steps/topic/system/**", heard.append)
        steps.start(Ailing, "ailing", connections={"position": "position"})
        if reads:
            steps.start(FaultWatcher, "watcher", connections={"faults": "system/faults"})
        steps.start_world(TinyWorld, ("ailing", *(["watcher"] if reads else [])), 2.0)
        assert steps.wait_finished().reproducible
        if reads:
            wait_until(lambda: heard, "the faults, which come over another session than the time")
        assert {sample.key for sample in heard} == ({"steps/topic/system/faults"} if reads else set())
    finally:
        steps.close()
