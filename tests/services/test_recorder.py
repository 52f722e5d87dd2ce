"""Promises of the recorder."""

from dataclasses import replace

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.geometry import FramedPose, Pose, Twist, Vector3
from regraft.bus_schema.messages.maps import Goals, NamedGoal
from regraft.bus_schema.messages.perception import Detection, Detections
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Outcome,
    SetParameters,
    StepReport,
    StepState,
)
from regraft.evaluation.recorder import Recorder
from regraft.testing import Rig

from .rigs import run, world_on

SLOWER = AdaptationReport(
    "a1",
    Outcome.APPLIED,
    AdaptationRequest((SetParameters("navigator", {"max_velocity": 0.18}),), key="k1"),
    1,
    2,
    started=3.0,
    duration=0.01,
    tick=60,
    steps=(StepReport(1, "navigator", "set max_velocity", StepState.DONE, 0.004),),
)


def summary(rig: Rig) -> RunSummary:
    return rig.call("run_summary", RunSummaryRequest(), RunSummary)


def driven(seed: int, turn: float = 0.3, seconds: float = 2.0) -> RunSummary:
    """Drive FROG's robot about and sum up."""
    with Rig(seed=seed) as rig:
        world = world_on(rig)
        rig.add(Recorder)
        rig.publish("velocity", Twist.planar(0.2, turn))
        run(rig, world, seconds)
        return summary(rig)


def with_reports(*reports: AdaptationReport) -> RunSummary:
    with Rig() as rig:
        rig.add(Recorder)
        for report in reports:
            rig.publish("adaptations", report)
        return summary(rig)


def test_equal_runs_have_equal_digests_and_others_do_not() -> None:
    first = driven(3)
    assert driven(3) == first
    assert driven(3, turn=0.31).digest != first.digest
    assert driven(4).digest != first.digest


def test_what_came_since_it_last_looked_counts_too() -> None:
    assert driven(3, seconds=1.4).ticks == 28
    assert driven(3, seconds=1.4).digest != driven(3, seconds=1.0).digest


def test_the_digest_does_not_depend_on_when_it_was_asked() -> None:
    digests = []
    for asked_between in (False, True):
        with Rig(seed=3) as rig:
            world = world_on(rig)
            rig.add(Recorder)
            run(rig, world, 1.3)
            if asked_between:
                summary(rig)
            run(rig, world, 1.3)
            digests.append(summary(rig).digest)
    assert digests[0] == digests[1]


def test_distance_and_visits_are_counted() -> None:
    places = {"west": -1.0, "east": 1.0}
    with Rig() as rig:
        rig.add(Recorder)
        named = tuple(NamedGoal(n, FramedPose("map", Pose.planar(x, 0.0, 0.0))) for n, x in places.items())
        rig.publish("goals", Goals(0.0, named))
        way = [
            (-2.0, 0.2),
            (-1.1, 0.2),
            (-1.0, 0.0),
            (-0.9, 0.0),
            (0.0, 0.0),
            (1.0, 0.2),
            (1.1, 0.0),
            (-1.0, 0.0),
        ]
        for tick, (x, speed) in enumerate(way):
            truth = GroundTruth(0.05 * tick, tick, Pose.planar(x, 0.0, 0.0), Twist.planar(speed, 0.0), (), 2)
            rig.publish("ground_truth", truth)
        result = summary(rig)
    assert result.distance == pytest.approx(3.1 + 2.1)
    assert result.visits == {"east": 1, "west": 2}
    assert (result.ticks, result.contacts) == (7, 2)


def test_pictures_and_hits_are_counted_by_camera() -> None:
    seen = Detection("hydrant", 0.9, "map", Vector3(), 0.0, 1.0)
    with Rig() as rig:
        rig.add(Recorder)
        for detections in (
            Detections(0.0, "camera"),
            Detections(0.2, "camera", (seen,)),
            Detections(0.3, "corner"),
        ):
            rig.publish("detections", detections)
        result = summary(rig)
    assert result.pictures == {"camera": 2, "corner": 1}
    assert result.hits == {"camera": 1, "corner": 0}


def test_adaptations_count_for_what_they_changed_not_for_how_long_they_took() -> None:
    base = with_reports(SLOWER)
    step = replace(SLOWER.steps[0], duration=0.4)
    same = replace(SLOWER, id="a9", duration=2.0, started=3.1, steps=(step,), request=replace(SLOWER.request, key="k2"))
    assert with_reports(same).digest == base.digest
    assert base.adaptations == {"applied": 1}
    faster = replace(SLOWER.request, changes=(SetParameters("navigator", {"max_velocity": 0.26}),))
    for other in (
        replace(SLOWER, tick=61),
        replace(SLOWER, outcome=Outcome.ROLLED_BACK),
        replace(SLOWER, request=faster),
    ):
        assert with_reports(other).digest != base.digest


def test_a_restored_recorder_goes_on_with_the_same_digest() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        rig.add(Recorder)
        run(rig, world, 1.5)
        state = codec.unpack_plain(codec.encode(rig.runtimes["recorder"].checkpoints.snapshot()))["state"]
        successor = rig.add(Recorder, "successor")
        successor.restore(state)
        run(rig, world, 1.5)
        old, new = (rig.runtimes[name].component for name in ("recorder", "successor"))
        assert isinstance(old, Recorder)
        assert isinstance(new, Recorder)
        assert new.run_summary(RunSummaryRequest()) == old.run_summary(RunSummaryRequest())
