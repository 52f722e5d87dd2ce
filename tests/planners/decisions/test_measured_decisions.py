"""Decisions by measured qualities: what stands has what its components measure, everything else what is estimated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from regraft import Component, Output, Parameter, Quality
from regraft.adaptation_manager.planners.decisions.command_line import decision as command
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import SystemMeasurements
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import Outcome
from regraft.cli.outcomes import BadInput
from regraft.testing import Rig
from tests.planners.decisions.deciding import PLANNERS
from tests.planners.parts import SmallManager, spec

PACE = """\
choices:
  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}
qualities:
  speed: {measured: navigator.speed, estimated: navigator.speed}
objective:
  utility: speed
  settle: 1
"""
BOUNDED = PACE.replace("  settle: 1\n", "  settle: 1\n  bounds: {speed: {at_least: 0.15}}\n")
STANDS = 0.26
"""The pace that stands at first."""


class Driver(Component):
    """Measures its speed, and expects to reach the one that is allowed."""

    velocity = Output(Twist)
    max_velocity = Parameter(STANDS, minimum=0.0, maximum=0.26, unit="m/s")

    speed = Quality(unit="m/s", better="higher", minimum=0.0, maximum=1.0)
    slip = Quality(estimated=False)
    power = Quality(unit="W", measured=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        return {"speed": float(parameters["max_velocity"]), "power": 1.0}


class Silent(Driver):
    """Declares what it measures, but never does."""

    evaluate_every = None


class Bench:
    def __init__(self, rig: Rig, manager: SmallManager, name: str) -> None:
        self.rig, self.manager, self.name = rig, manager, name

    @property
    def now(self) -> float:
        return self.rig.clock.now() / 1e9

    def measures(self, component: str = "navigator", unknown: str = "", **values: float) -> None:
        """Let the system say what a component has measured now."""
        why = {unknown: "not given"} if unknown else {}
        measured = MeasuredQualities(self.now, component, 1, 1.0, values, why)
        self.rig.publish("system/measurements", SystemMeasurements(self.now, (measured,)))

    def propose(self, apply: bool = False) -> dict[str, Any]:
        request = ProposalRequest("drive", inputs={"decision": "pace"}, apply=apply)
        return self.rig.call(f"planners/{self.name}/propose", request, Proposal, timeout=60.0).choice


@contextmanager
def bench(folder: Path, name: str = "forecast", text: str = PACE, scope: str = "") -> Iterator[Bench]:
    (folder / "pace.yaml").write_text(text)
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        whose = f"{scope}." if scope else ""
        manager.architecture = manager.architecture.with_component(spec(Driver, f"{whose}navigator"))
        rig.add(PLANNERS[name], f"{whose}{name}", {"decisions": str(folder)}, scope=scope)
        yield Bench(rig, manager, f"{name}")


# --- the forecast ---


def test_what_stands_has_its_measured_quality_and_the_others_their_estimates(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        assert on.propose()["option"] == {"pace": STANDS}
        on.measures(speed=0.05)
        chosen = on.propose()
        assert chosen["option"] == {"pace": 0.18}
        assert chosen["standing"] == 0.05
        assert chosen["predicted"]["speed"] == {
            "before": 0.05,
            "after": 0.18,
            "before_from": "measured",
            "after_from": "estimated",
        }


def test_the_explanation_says_from_where_and_when_a_quality_was_measured(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        on.rig.advance(0.5)
        on.measures(speed=0.25)
        source = {"navigator.speed": {"value": 0.25, "stamp": on.now}}
        assert on.propose()["measured"] == {"speed": {"value": 0.25, "from": source}}


def test_a_planner_describes_by_which_qualities_it_measures(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        described = on.rig.call("planners/forecast/describe", PlannerQuery(), PlannerDescription)
        assert "It measures pace.speed by navigator.speed." in described.inputs["anyOf"][1]["description"]


def test_the_journal_gets_what_the_decision_was_measured_by(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        on.measures(speed=0.05)
        on.propose(apply=True)
        assert on.manager.requests[-1].context["measured"] == {"speed": 0.05}


def test_a_bound_holds_for_the_measured_quality_of_what_stands(tmp_path: Path) -> None:
    with bench(tmp_path, text=BOUNDED.replace("utility: speed", "utility: 0.5")) as on:
        assert on.propose()["option"] == {"pace": STANDS}
        on.measures(speed=0.05)
        chosen = on.propose()
        assert chosen["option"] == {"pace": 0.18}
        assert {each["alternative"] for each in chosen["excluded"]} == {0.1, STANDS}


def test_a_measured_quality_holds_for_whatever_changes_nothing_that_it_depends_on(tmp_path: Path) -> None:
    text = PACE.replace(
        "choices:\n", "choices:\n  way: {component: drive, port: velocity, topics: [velocity, slow/velocity]}\n"
    )
    with bench(
        tmp_path, text=text.replace("utility: speed", "utility: speed + (0.1 if way == 'slow/velocity' else 0.0)")
    ) as on:
        on.measures(speed=0.5)
        chosen = on.propose()
        assert chosen["option"] == {"way": "slow/velocity", "pace": STANDS}
        assert chosen["utility"] == 0.6
        assert chosen["predicted"]["speed"]["after_from"] == "measured"


def test_what_was_measured_before_the_last_change_showed_effect_does_not_count(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        on.measures(speed=0.05)
        assert on.propose(apply=True)["option"] == {"pace": 0.18}
        on.rig.advance(0.9)
        on.measures(speed=0.01)
        chosen = on.propose()
        assert chosen["measured"] == {}
        (note,) = chosen["notes"]
        assert note.startswith("speed is estimated: navigator.speed is not measured: not measured since 1")
        on.rig.advance(0.2)
        on.measures(speed=0.16)
        assert on.propose()["measured"]["speed"]["value"] == 0.16


def test_a_change_that_is_rejected_leaves_what_is_measured_as_it_was(tmp_path: Path) -> None:
    with bench(tmp_path) as on:
        on.measures(speed=0.05)
        on.manager.fates = [Outcome.REJECTED]
        assert on.propose(apply=True)["outcome"] == "rejected"
        assert on.propose()["measured"]["speed"]["value"] == 0.05


@pytest.mark.parametrize(
    ("says", "why"),
    [
        (lambda on: None, "navigator is not active, or has measured nothing yet"),
        (lambda on: on.measures("drive", speed=0.05), "navigator is not active, or has measured nothing yet"),
        (lambda on: on.measures(unknown="speed"), "not given"),
        (lambda on: on.measures(spede=0.05), "navigator measures no 'speed'"),
        (lambda on: (on.measures(speed=0.05), on.rig.advance(3.1)), "late: measured at 0 s, and not every 1 s since"),
    ],
    ids=["silent", "gone", "unknown", "undeclared", "late"],
)
def test_an_unknown_measurement_is_said_with_the_reason_and_the_estimate_counts(
    tmp_path: Path, says: Any, why: str
) -> None:
    with bench(tmp_path) as on:
        says(on)
        chosen = on.propose()
        assert (chosen["option"], chosen["utility"]) == ({"pace": STANDS}, STANDS)
        assert chosen["notes"] == [f"speed is estimated: navigator.speed is not measured: {why}"]
        assert chosen["predicted"]["speed"]["before_from"] == "estimated"


def test_one_expression_for_both_is_measured_only_where_the_class_measures_it(tmp_path: Path) -> None:
    text = "choices:\n  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.26]}\n"
    text += "qualities: {speed: navigator.speed, power: navigator.power}\nobjective: {utility: speed + power}\n"
    with bench(tmp_path, text=text) as on:
        on.measures(speed=0.25)
        chosen = on.propose()
        assert set(chosen["measured"]) == {"speed"}
        assert chosen["notes"] == []


def test_measurements_that_would_tie_too_much_together_are_left_out_and_that_is_said(tmp_path: Path) -> None:
    slots = "".join(
        f"  s{i}: {{alternatives: {{{', '.join(f'a{n}: {{figures: {{worth: {n}}}}}' for n in range(10))}}}}}\n"
        for i in range(6)
    )
    text = "choices:\n  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.26]}\n" + slots
    text += "qualities: {worth: {measured: navigator.speed, estimated: total.worth}}\n"
    text += "objective: {utility: worth, range: [0, 99]}\n"
    with bench(tmp_path, text=text) as on:
        on.measures(speed=0.25)
        chosen = on.propose()
        assert chosen["utility"] == 54.0
        assert any(note.startswith("worth is ") for note in chosen["notes"])


# --- the bandits ---


def test_the_bandits_credit_a_choice_with_what_was_measured_since_its_effect(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.measures(speed=0.9)
        on.propose(apply=True)
        on.rig.advance(1.1)
        on.measures(speed=0.2)
        on.rig.advance(1.0)
        assert on.propose(apply=True)["credit"]["utility"] == 0.2


def test_the_bandits_say_why_a_choice_has_no_credit(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.measures(speed=0.9)
        on.propose(apply=True)
        on.rig.advance(2.0)
        chosen = on.propose(apply=True)
        assert "credit" not in chosen
        assert any(
            note.startswith("the choice before has no credit: navigator.speed is not measured: ")
            for note in chosen["notes"]
        )


def test_a_bound_keeps_the_bandits_from_what_is_measured_to_be_too_slow(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits", BOUNDED) as on:
        assert on.propose()["options"] == 2
        on.measures(speed=0.05)
        assert on.propose()["options"] == 1


# --- one robot among several, and what is read ---


def test_short_names_are_those_of_the_robot_that_the_planner_belongs_to(tmp_path: Path) -> None:
    with bench(tmp_path, scope="rescuer") as on:
        on.measures("rescuer.navigator", speed=0.05)
        request = ProposalRequest("drive", inputs={"decision": "pace"}, apply=False)
        chosen = on.rig.call("rescuer/planners/forecast/propose", request, Proposal, timeout=60.0).choice
        assert chosen["option"] == {"pace": 0.18}
        assert set(chosen["measured"]["speed"]["from"]) == {"navigator.speed"}


@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_measurements_are_read_only_where_a_decision_is_measured_by_them(
    tmp_path: Path, planner: type[DecidingPlanner]
) -> None:
    def topics(text: str) -> list[str | None]:
        (tmp_path / "pace.yaml").write_text(text)
        return [port.topic for port in planner.ports_for({"decisions": str(tmp_path)})]

    assert topics(PACE) == ["system/measurements"]
    assert topics(PACE.replace("measured: navigator.speed", "measured: 0.2")) == []


# --- checking a file ---

STACK = """\
system: tests
clock: real
topics: {velocity: {type: regraft/Twist, writers: many}}
components:
  navigator: {class: 'tests.planners.decisions.test_measured_decisions:Driver'}
  sleeper: {class: 'tests.planners.decisions.test_measured_decisions:Silent'}
  wheels: {command: [wheels], managed: false, inputs: {velocity: regraft/Twist}}
"""


def checked(folder: Path, text: str) -> tuple[list[str], list[str]]:
    """Return what the command ``decision check`` prints, and the lines of its refusal."""
    (folder / "pace.yaml").write_text(text)
    (folder / "stack.yaml").write_text(STACK)
    result = CliRunner().invoke(command, ["check", str(folder / "pace.yaml"), "--stack", str(folder / "stack.yaml")])
    refused = str(result.exception).splitlines() if isinstance(result.exception, BadInput) else []
    assert refused or result.exit_code == 0, result.output
    return result.output.splitlines(), refused


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("navigatr.speed", "there is no component 'navigatr'; did you mean 'navigator'?"),
        ("navigator.spede", "navigator measures no 'spede'; did you mean 'speed'?"),
        ("navigator.power", "navigator only estimates 'power'"),
        ("sleeper.speed", "sleeper measures nothing: its evaluate_every is None"),
        ("wheels.speed", "wheels is unmanaged: it measures nothing"),
    ],
)
def test_what_no_component_measures_is_refused_by_file_and_line(tmp_path: Path, name: str, why: str) -> None:
    _, refused = checked(tmp_path, PACE.replace("measured: navigator.speed", f"measured: {name} * 2"))
    assert refused == [f"{tmp_path / 'pace.yaml'}:4: qualities.speed.measured: {name}: {why}"]


def test_checking_says_what_each_planner_cannot_express_of_measured_qualities(tmp_path: Path) -> None:
    lines, _ = checked(tmp_path, PACE)
    assert [line for line in lines if "forecast cannot" in line] == []
    text = BOUNDED.replace("measured: navigator.speed, estimated: navigator.speed", "measured: navigator.slip")
    lines, _ = checked(tmp_path, text.replace("utility: speed", "utility: navigator.power"))
    assert lines[1:] == [
        "bandits cannot express objective.utility: navigator.power is an estimate, "
        "so the utility that was earned is not known: measure it as a quality",
        "bandits cannot express qualities.speed: is only measured, so only what stands can keep its bounds",
        "forecast cannot express qualities.speed: is only measured, so it cannot be expected",
    ]
