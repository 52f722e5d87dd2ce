"""Before anything is touched, one can ask what an adaptation would take and give."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Add,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.model.qualities.estimates import Basis, Estimate, Source
from tests.adaptation.system import System

LAMP = Add("lamp", ComponentSpec(cls="tests.adaptation.parts:Lamp", parameters={"level": 4.0}))


def _estimate(report: AdaptationReport) -> Estimate:
    assert report.outcome is Outcome.PENDING, report
    assert report.estimate is not None
    return report.estimate


def _qualities(report: AdaptationReport) -> dict[tuple[str, str], tuple[float | None, float | None]]:
    return {(q.component, q.quality): (q.before, q.after) for q in _estimate(report).qualities}


def test_without_a_past_durations_are_assumed_and_said_to_be(system: System) -> None:
    estimate = _estimate(system.adapt(SetParameters("listener", {"gain": 0.1}), dry_run=True))
    (step,) = estimate.steps
    assert (step.number, step.component, step.samples, step.basis) == (1, "listener", 0, Basis.ASSUMED)
    assert 0.0 < step.median < step.p95
    assert estimate.p95 == step.p95


def test_durations_come_from_the_past_of_the_class_and_otherwise_of_the_kind(system: System) -> None:
    taken = [system.adapt(SetParameters("listener", {"gain": gain / 10})).steps[0].duration for gain in (1, 2, 3, 4)]
    estimate = _estimate(
        system.adapt(
            SetParameters("second", {"gain": 0.1}),
            SetParameters("fragile", {"level": 1}),
            Connect("listener", "heard", "others"),
            dry_run=True,
        )
    )
    same_class, same_kind, new = estimate.steps
    assert (same_class.samples, same_class.basis) == (4, Basis.CLASS)
    assert (same_class.median, same_class.p95) == (sorted(taken)[1], max(taken))
    assert (same_kind.samples, same_kind.basis) == (4, Basis.KIND)
    assert (new.samples, new.basis) == (0, Basis.ASSUMED)
    assert estimate.median > sum(step.median for step in estimate.steps)


def test_the_past_outlives_the_manager_and_the_run_and_grows(system: System) -> None:
    change = SetParameters("listener", {"gain": 0.9})

    def samples() -> int:
        return _estimate(system.adapt(change, dry_run=True)).steps[0].samples

    system.adapt(change)
    assert samples() == 1
    system.adapt(change)
    assert samples() == 2
    system.running["manager"].kill()
    system.start_manager()
    assert samples() == 2
    system.running["manager"].kill()
    system.host.run = "run-2"
    system.start_manager()
    assert samples() == 2


def test_qualities_of_what_changes_are_told_before_and_after(system: System) -> None:
    assert _qualities(system.adapt(LAMP, dry_run=True, context={"darkness": 0.5})) == {
        ("lamp", "power"): (None, 4.0),
        ("lamp", "light"): (None, 2.0),
    }
    assert system.adapt(LAMP).outcome is Outcome.APPLIED
    brighter = SetParameters("lamp", {"level": 6.0})
    assert _qualities(system.adapt(brighter, SetParameters("listener", {"gain": 0.1}), dry_run=True)) == {
        ("lamp", "power"): (4.0, 6.0),
        ("lamp", "light"): (0.0, 0.0),
    }
    for gone in (ChangeState("lamp", Transition.DEACTIVATE), Remove("lamp")):
        assert _qualities(system.adapt(gone, dry_run=True))["lamp", "power"] == (4.0, None)
    assert _qualities(system.adapt(SetParameters("listener", {"gain": 0.1}), dry_run=True)) == {}


def test_a_host_that_does_not_estimate_is_no_obstacle(system: System) -> None:
    system.adapt(LAMP)
    system.host.refuses_estimates = True
    found = _estimate(system.adapt(SetParameters("lamp", {"level": 6.0}), dry_run=True)).qualities
    assert {(each.before, each.after, each.after_source) for each in found} == {(None, None, Source.UNKNOWN)}
    assert all("not today" in each.after_why for each in found)


@pytest.mark.parametrize("running", [False, True])
def test_a_class_that_cannot_say_is_no_obstacle(system: System, running: bool) -> None:
    if running:
        system.adapt(LAMP)
        report = system.adapt(SetParameters("lamp", {"level": 9.5}), dry_run=True)
        assert _qualities(report)["lamp", "power"] == (4.0, None)
    else:
        spec = ComponentSpec(cls="tests.adaptation.parts:Lamp", parameters={"level": 9.5})
        estimate = _estimate(system.adapt(Add("lamp", spec), dry_run=True))
        assert {(q.quality, q.after, q.after_source, q.after_why) for q in estimate.qualities} == {
            (quality, None, Source.UNKNOWN, "estimate raised ValueError: too bright to say")
            for quality in ("power", "light")
        }
