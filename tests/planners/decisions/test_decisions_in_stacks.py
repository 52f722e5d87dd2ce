"""A decision is compared with a stack before anything runs: what it reads, connects, sets and swaps in."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.adaptation_manager.planners.decisions.command_line import decision as command
from regraft.cli.outcomes import BadInput
from regraft.stack import StackError, check_with_classes, load

STACK = """\
system: tests
clock: real
topics:
  light: regraft/LightLevel
  charger: regraft/ChargerState
  health: regraft/SensorHealth
  mission: regraft/MissionStatus
  odometry: regraft/Odometry
  echo: regraft/Odometry
  scan: regraft/LaserScan
  velocity: {type: regraft/Twist, writers: many}
components:
  eyes: {class: 'tests.stack.parts:Eyes'}
  navigator: {class: 'tests.stack.parts:Navigator'}
"""
LOOK = """\
context:
  dark: {topic: light, field: darkness}
  docked: {topic: charger, field: connected}
  silent: {topic: health, field: watched, reduce: length}
  state: {topic: mission, field: state}
  frame: {topic: odometry, field: child_frame}
  lost: {topic: system/faults, field: present, reduce: length}
choices:
  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.2]}
  smell: {component: navigator, port: odometry, topics: [odometry, echo]}
  care: {component: eyes, states: [active, inactive]}
constraints:
  - {require: "dark < 0.5 or docked"}
objective: {utility: "pace * (1 - dark) + docked"}
faults:
  odd: {when: "state == 'paused' or frame == 'base' or lost > 0", excludes: {pace: 0.2}}
"""


def _refused(folder: Path, *changes: tuple[str, str]) -> list[str]:
    """Return the lines of what is refused of the decision with changes, each as from its line."""
    text = LOOK
    for right, wrong in changes:
        assert right in text
        text = text.replace(right, wrong, 1)
    file, stack = folder / "look.yaml", folder / "stack.yaml"
    file.write_text(text)
    stack.write_text(STACK)
    result = CliRunner().invoke(command, ["check", str(file), "--stack", str(stack)])
    assert isinstance(result.exception, BadInput) or result.exit_code == 0, result.output
    return str(result.exception or "").replace(f"{file}:", "").splitlines()


def test_a_decision_that_fits_a_stack_is_right(tmp_path: Path) -> None:
    assert _refused(tmp_path) == []


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("field: darkness", "field: darknes", "2: context.dark.field: LightLevel has no field 'darknes'; it has: "
         "stamp, darkness; did you mean 'darkness'?"),
        ("field: connected", "field: connecte", "3: context.docked.field: ChargerState has no field 'connecte'"),
        (", reduce: length}", "}", "4: context.silent.field: SensorHealth.watched is a list, which no expression has"),
        ("watched, reduce: length", "watched, reduce: min", "4: context.silent.field: SensorHealth.watched is a list"),
        ("topic: light", "topic: lihgt", "2: context.dark.topic: there is no topic 'lihgt'; did you mean 'light'?"),
        ("[odometry, echo]", "[odometry, scan]", "10: choices.smell.topics.1: input 'odometry' takes regraft/Odometry, "
         "but topic 'scan' carries regraft/LaserScan"),
        ("[odometry, echo]", "[odometry, eco]", "10: choices.smell.topics.1: there is no topic 'eco'; did you mean"),
        ("port: odometry", "port: odometri", "10: choices.smell.port: navigator has no port 'odometri'; did you mean"),
        ("values: [0.1, 0.2]", "values: [0.1, 0.2, 2]", "9: choices.pace.values.2: 2: must be at most 0.26 m/s"),
        ("max_velocity", "max_velocty", "9: choices.pace.parameter: navigator has no parameter 'max_velocty'; did you"),
        ("dark < 0.5 or docked", "dark", "13: constraints.0.require: dark is a number, must be true or false"),
        ("dark < 0.5 or docked", "frame", "13: constraints.0.require: frame is a text, must be true or false"),
        ("dark < 0.5 or docked", "dark == 'night'", "13: constraints.0.require: dark, a number, is compared with"),
        ("(1 - dark)", "(1 - frame)", "14: objective.utility: frame is a text, must be a number"),
        ("state == 'paused'", "state == 'pausd'", "16: faults.odd.when: state is compared with 'pausd', which it never "
         "is; did you mean 'paused'?"),
        ("state == 'paused'", "state > 3", "16: faults.odd.when: state, a text, is compared with 3, a number"),
    ],
)  # fmt: skip
def test_what_cannot_be_in_the_stack_is_named_by_line_and_field(
    tmp_path: Path, right: str, wrong: str, told: str
) -> None:
    (found,) = _refused(tmp_path, (right, wrong))
    assert found.startswith(told)


def test_a_class_to_choose_has_to_be_there(tmp_path: Path) -> None:
    line = "  driver: {component: navigator, classes: ['tests.stack.parts:Navigator', 'tests.stack.parts:Joystick']}\n"
    before = "  care: "
    assert _refused(tmp_path, (before, line + before)) == []
    (found,) = _refused(tmp_path, (before, line.replace("Joystick", "Joystik") + before))
    assert found.startswith("11: choices.driver.classes.1: 'tests.stack.parts:Joystik': ")
    assert "did you mean 'Joystick'?" in found


def test_what_another_class_may_have_is_not_refused(tmp_path: Path) -> None:
    line = "  driver: {component: navigator, classes: ['tests.stack.parts:Joystick']}\n"
    assert _refused(tmp_path, ("max_velocity", "layout"), ("  care: ", line + "  care: ")) == []


PLANNER = """\
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite}
  forecast:
    class: regraft.adaptation_manager.planners.forecast.forecast_planner:ForecastPlanner
    parameters:
      decisions: look.yaml
"""
TOPICS = "topics:\n  adaptations: regraft/AdaptationReport\n  architecture: regraft/Architecture\n"


def test_a_stack_whose_planner_takes_a_decision_that_cannot_be_there_does_not_start(tmp_path: Path) -> None:
    (tmp_path / "look.yaml").write_text(LOOK)
    stack = tmp_path / "stack.yaml"
    stack.write_text(STACK.replace("topics:\n", TOPICS) + PLANNER)
    check_with_classes(load(stack))
    wrong = LOOK.replace("parameter: max_velocity", "parameter: max_velocty").replace(
        "[odometry, echo]", "[scan, echo]"
    )
    (tmp_path / "look.yaml").write_text(wrong)
    with pytest.raises(StackError) as refused:
        check_with_classes(load(stack))
    first, second = (each.problem for each in refused.value.problems)
    assert first.startswith(f"{tmp_path}/look.yaml:9: choices.pace.parameter: navigator has no parameter 'max_velocty'")
    assert second.startswith(f"{tmp_path}/look.yaml:10: choices.smell.topics.0: input 'odometry' takes")
    assert {each.field for each in refused.value.problems} == {"components.forecast.parameters.decisions"}
