"""What a component promises to publish is as if it were published, and keeps nobody waiting who does not need it."""

from __future__ import annotations

import threading

from regraft import Component, Input, Output, every
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE, wait_until

FAILS_AT = 2.0


class Eye(Component):
    """Sees something every second; looking takes as long as the gate is closed."""

    position = Input(Reading)
    picture = Output(Reading)

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.gate.set()

    @every(seconds=1.0)
    def look(self) -> None:
        seen, now = self.position.latest, self.kit.now()
        if seen is not None:
            self.picture.publish_deferred(lambda: self._picture(Reading(now, seen.stamp)))

    def _picture(self, picture: Reading) -> Reading:
        assert self.gate.wait(PATIENCE)
        return picture


class PromptEye(Eye):
    """The same, without promises."""

    @every(seconds=1.0)
    def look(self) -> None:
        seen, now = self.position.latest, self.kit.now()
        if seen is not None:
            self.picture.publish(Reading(now, seen.stamp))


class BlindEye(Eye):
    """Once, it cannot keep its promise."""

    def _picture(self, picture: Reading) -> Reading:
        if picture.stamp == FAILS_AT:
            raise RuntimeError("too dark")
        return picture


class Hasty(Eye):
    """Publishes behind what it has promised."""

    @every(seconds=1.0)
    def look(self) -> None:
        now = self.kit.now()
        self.picture.publish_deferred(lambda: Reading(now, 1.0))
        self.picture.publish(Reading(now, 2.0))
        self.picture.publish_deferred(lambda: Reading(now, 3.0))


class Viewer(Component):
    """Writes down what was seen when."""

    picture = Input(Reading, keep=100)

    def __init__(self) -> None:
        self.viewed: list[tuple[float, float, float]] = []

    @every(seconds=0.5)
    def view(self) -> None:
        self.viewed += [(self.kit.now(), r.stamp, r.value) for r in self.picture.take()]


def _start(steps: StepSite, eye: type[Eye], duration: float = 4.0) -> None:
    steps.start(eye, "eye")
    steps.start(Viewer, "viewer")
    steps.start_world(TinyWorld, ("eye", "viewer"), duration)


def _viewed(steps: StepSite) -> list[tuple[float, float, float]]:
    assert steps.wait_finished().reproducible
    viewer: Viewer = steps.component("viewer")
    return viewer.viewed


def test_what_is_promised_is_read_when_what_is_published_would_be(steps: StepSite) -> None:
    _start(steps, Eye)
    assert _viewed(steps) == [(n + 0.5, n, n) for n in (1.0, 2.0, 3.0)]


def test_a_promise_changes_nothing_for_who_reads_it() -> None:
    viewed = []
    for eye in (Eye, PromptEye):
        steps = StepSite("memory")
        try:
            _start(steps, eye)
            viewed.append(_viewed(steps))
        finally:
            steps.close()
    assert viewed[0] == viewed[1]


def test_time_goes_on_until_somebody_needs_what_is_being_made(steps: StepSite) -> None:
    steps.start(Eye, "eye")
    steps.start(Viewer, "viewer")
    wait_until(lambda: "eye" in steps.runtimes, "the eye")
    eye: Eye = steps.component("eye")
    eye.gate.clear()
    steps.start_world(TinyWorld, ("eye", "viewer"), 4.0)
    told = steps.told(lambda t: t.waiting_for == ("viewer",), "the viewer to wait for the picture")
    assert told.time == 1_500_000_000
    eye.gate.set()
    assert len(_viewed(steps)) == 3


def test_a_promise_that_cannot_be_kept_is_reported_and_lost_and_nobody_waits_for_it(steps: StepSite) -> None:
    _start(steps, BlindEye)
    assert [stamp for _, stamp, _ in _viewed(steps)] == [1.0, 3.0]
    assert steps.runtimes["viewer"].reporter.status.lost == 1
    assert "too dark" in steps.runtimes["eye"].reporter.status.error


def test_promises_and_messages_keep_their_order(steps: StepSite) -> None:
    _start(steps, Hasty, 2.0)
    assert [value for _, stamp, value in _viewed(steps) if stamp == 1.0] == [1.0, 2.0, 3.0]
