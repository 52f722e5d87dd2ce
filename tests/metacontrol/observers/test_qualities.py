"""The observer of qualities publishes what is known, and the context that holds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from regraft import ParameterError, State
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.services.observers.quality_observer import QualityObserver
from tests.metacontrol.observers.scene import Scene, scene, written

FILE = 'quality_observer:\n  ros__parameters:\n    qualities:\n      safety: "laser.clearance / 3"\n'
CHARGING = {"context": "BatteryCharging", "when": "battery.current > 0"}
DOCKED = {"context": "OnChargingStation", "when": "battery.docked > 0.5"}
OTHERWISE = {"context": "Default", "when": "True"}


def values(seen: Scene) -> list[dict[str, Any]]:
    """Return the values of the diagnostics since the last call."""
    return [each for _, _, each in seen.news()]


def test_a_quality_is_published_as_its_expression(tmp_path: Path) -> None:
    with scene(QualityObserver, observed=written(tmp_path, FILE)) as seen:
        seen.measured = {"laser": {"clearance": 1.5}}
        seen.run(1.0)
        assert seen.news() == [("ok", "QA status", {"safety": 0.5})] * 2


def test_a_quality_of_one_objective_names_it(tmp_path: Path) -> None:
    further = [{"quality": "safety", "measured": "laser.clearance", "objective": "patrol"}]
    with scene(QualityObserver, observed=written(tmp_path, FILE), qualities=further) as seen:
        seen.measured = {"laser": {"clearance": 1.5}}
        seen.run(0.5)
        assert [(each.subject, each.values) for each in seen.diagnostics] == [
            ("", {"safety": 0.5}),
            ("patrol", {"safety": 1.5}),
        ]


@pytest.mark.parametrize(
    ("measured", "why"),
    [
        ({}, "laser.clearance is not measured: laser is not active, or has measured nothing yet"),
        ({"laser": {"other": 1.0}}, "laser.clearance is not measured: laser measures no 'clearance'"),
        ({"laser": {"clearance": 0.0}}, "division by zero"),
        ({"laser": {"clearance": 1e-320}}, "is not finite"),
    ],
)
def test_what_is_not_known_is_not_published_and_why_is_reported_once(
    measured: dict[str, dict[str, float]], why: str
) -> None:
    with scene(QualityObserver, qualities=[{"quality": "risk", "measured": "1 / laser.clearance"}]) as seen:
        reported: list[Diagnostic] = []
        seen.rig.bus.subscribe(
            seen.rig.keys.diagnostics, lambda s: reported.append(codec.decode(s.payload, Diagnostic))
        )
        seen.measured = measured
        seen.run(2.0)
        assert seen.news() == []
        (one,) = reported
        assert (one.subject, one.level.value) == ("risk", "warning")
        assert one.text.endswith(why)
        seen.measured = {"laser": {"clearance": 2.0}}
        seen.run(0.5)
        assert values(seen) == [{"risk": 0.5}]
        assert [each.text for each in reported] == [one.text, "known again"]


def test_a_late_measurement_does_not_count() -> None:
    with scene(QualityObserver, qualities=[{"quality": "safety", "measured": "laser.clearance"}]) as seen:
        seen.measured = {"laser": {"clearance": 1.0}}
        seen.run(1.0)
        seen.measured_at = seen.rig.clock.now() / 1e9
        assert len(seen.news()) == 2
        seen.run(1.5)
        assert len(seen.news()) == 3
        seen.run(2.0)
        assert seen.news() == []


def test_states_and_failures_may_have_a_share_in_a_quality() -> None:
    measured = "0 if camera.failed else 1 if laser.active and camera.state == 'active' else 0.5"
    with scene(QualityObserver, qualities=[{"quality": "sight", "measured": measured}]) as seen:
        seen.run(0.5)
        seen.states["laser"] = State.INACTIVE
        seen.run(0.5)
        seen.faults["camera"] = SystemFaultKind.DIED
        seen.run(0.5)
        assert values(seen) == [{"sight": 1.0}, {"sight": 0.5}, {"sight": 0.0}]


def test_the_first_context_that_holds_is_published_when_it_is_another() -> None:
    with scene(QualityObserver, contexts=[DOCKED, CHARGING, OTHERWISE], settle=0.0) as seen:
        seen.run(2.0)
        assert seen.news() == [("ok", "Context status", {"context": "Default"})]
        seen.measured = {"battery": {"current": 1.0, "docked": 0.0}}
        seen.run(2.0)
        seen.measured = {"battery": {"current": 1.0, "docked": 1.0}}
        seen.run(2.0)
        seen.measured = {}
        seen.run(2.0)
        assert [each["context"] for each in values(seen)] == ["BatteryCharging", "OnChargingStation", "Default"]


def test_a_context_is_published_again_for_a_component_that_has_become_active_since() -> None:
    with scene(QualityObserver, contexts=[OTHERWISE], settle=0.0) as seen:
        seen.states["reader"] = State.INACTIVE
        seen.run(2.0)
        assert len(seen.news()) == 1
        seen.states["reader"] = State.ACTIVE
        seen.run(2.0)
        assert seen.news() == [("ok", "Context status", {"context": "Default"})]
        seen.runs["reader"] = 2
        seen.run(2.0)
        assert seen.news() == [("ok", "Context status", {"context": "Default"})]


def test_a_context_has_to_hold_for_a_while() -> None:
    with scene(QualityObserver, contexts=[CHARGING, OTHERWISE], settle=1.2) as seen:
        seen.run(3.0)
        seen.news()
        seen.measured = {"battery": {"current": 1.0}}
        seen.run(1.0)
        seen.measured = {}
        seen.run(3.0)
        assert seen.news() == []


def test_where_no_context_holds_it_stays() -> None:
    with scene(QualityObserver, contexts=[CHARGING], settle=0.0) as seen:
        seen.measured = {"battery": {"current": 1.0}}
        seen.run(1.0)
        seen.measured = {"battery": {"current": 0.0}}
        seen.run(1.0)
        seen.measured = {"battery": {"current": 1.0}}
        seen.run(1.0)
        assert [each["context"] for each in values(seen)] == ["BatteryCharging"]


@pytest.mark.parametrize(
    ("parameters", "problem"),
    [
        ({"qualities": [{"quality": "a", "measured": "b.c d"}]}, "qualities.0.measured: 'b.c d' is no expression"),
        ({"qualities": [{"quality": "a", "measured": "'x'"}]}, "qualities.0.measured: \"'x'\" speaks of nothing"),
        ({"qualities": [{"quality": "a", "measured": "b.c + 'x' == 1"}]}, "qualities.0.measured: "),
        ({"qualities": [{"quality": "", "measured": "b.c"}]}, "qualities.0.quality: is empty"),
        (
            {"qualities": [{"quality": "a", "measured": "b.c"}] * 2},
            "qualities.1.measured: the quality 'a' is given twice",
        ),
        ({"contexts": [{"context": "a", "when": "1"}]}, "contexts.0.when: 1 is a number, must be true or false"),
        ({"contexts": [{"context": "", "when": "True"}]}, "contexts.0.context: is empty"),
    ],
)
def test_wrong_parameters_are_refused_before_anything_starts(parameters: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(problem)):
        _check(parameters)


def _check(parameters: dict[str, Any]) -> None:
    declared = {name: QualityObserver.__dict__[name].checked(value) for name, value in parameters.items()}
    QualityObserver.check_parameters({"observed": "", "qualities": (), "contexts": (), **declared}, 1)
