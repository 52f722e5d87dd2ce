"""In simulated time equal runs measure alike, at the times that the period states, and measuring changes no run."""

from __future__ import annotations

from typing import ClassVar

from regraft import Input, Quality
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from tests.stepped.parts import Adviser, Pusher, Reading, TinyWorld, Witness
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

MEMBERS = ("adviser", "pusher", "witness")
DURATION = 5.0


class MeasuringPusher(Pusher):
    """Measures how far the point is from where it should be, at a rate that no tick meets."""

    evaluate_every: ClassVar[float | None] = 0.33

    miss = Quality("how far it is from its goal", unit="m", better="lower", estimated=False)

    def evaluate(self) -> dict[str, float]:
        """Return the distance, once it is known."""
        seen = self.position.latest
        return {} if seen is None else {"miss": self.goal - seen.value}


class SleepingGauge(Witness):
    """Has nothing to do but to measure."""

    evaluate_every: ClassVar[float | None] = 1.0

    position = Input(Reading, keep=10_000)
    seen_last = Quality(unit="m", estimated=False)

    def evaluate(self) -> dict[str, float]:
        """Return what it has last read."""
        seen = self.position.latest
        return {} if seen is None else {"seen_last": seen.value}


def run(pusher: type[Pusher], witness: type[Witness] = Witness) -> tuple[str, list[MeasuredQualities]]:
    """Return the digest of a run, and what was measured."""
    steps = StepSite("zenoh")
    measured: list[MeasuredQualities] = []
    try:
        steps.listen(
            "steps/component/*/qualities", lambda s: measured.append(codec.decode(s.payload, MeasuredQualities))
        )
        steps.start(pusher, "pusher")
        steps.start(Adviser, "adviser")
        steps.start(witness, "witness")
        steps.start_world(TinyWorld, MEMBERS, DURATION)
        assert steps.wait_finished().reproducible
        if pusher is MeasuringPusher:
            wait_until(lambda: any(each.stamp > 4.9 for each in measured), "the last measurement")
        seen: Witness = steps.component("witness")
        return seen.digest(), sorted(measured, key=lambda each: (each.component, each.stamp))
    finally:
        steps.close()


def test_equal_runs_measure_the_same_at_the_same_times() -> None:
    first, second = run(MeasuringPusher), run(MeasuringPusher)
    assert first == second
    periods = [round(each.stamp / 0.33) for each in first[1]]
    assert periods == list(range(1, 16))
    assert all(-1e-9 <= each.stamp - 0.33 * n < 0.05 + 1e-9 for n, each in zip(periods, first[1], strict=True))
    assert len({each.values["miss"] for each in first[1]}) > 10


def test_measuring_changes_nothing_in_a_run() -> None:
    digest, nothing = run(Pusher)
    assert nothing == []
    assert run(MeasuringPusher, SleepingGauge)[0] == digest


def test_a_component_that_would_sleep_measures_all_the_same() -> None:
    _, measured = run(MeasuringPusher, SleepingGauge)
    stamps = [each.stamp for each in measured if each.component == "witness"]
    assert stamps[:4] == [1.0, 2.0, 3.0, 4.0]
