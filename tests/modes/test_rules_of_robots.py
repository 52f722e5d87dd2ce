"""Rules in a robot's file speak of that robot, under whatever name a stack uses it; mistakes are found in that file."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_conditions import NameKind, names_of
from regraft.stack import load
from tests.stack.reading.folders import ROBOT, SINGLE, TWO, at, rovers, told

PLANNER = (
    "  mode_planner: {class: 'regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner'}\n"
    "  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager',"
    " parameters: {journal: $RUN/journal.sqlite}}\n"
)
TOPICS = """\
topics:
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
"""


def _planned(stack: str) -> str:
    return stack.replace("components:\n", TOPICS) + PLANNER


MODES = """\
  fast:
    - {change: set_parameters, component: navigator, parameters: {max_velocity: 0.2}}
  eyes.shut:
    - {change: transition, component: eyes, transition: deactivate}
  eyes.open:
    - {change: transition, component: eyes, transition: activate}
"""
RULES = """\
rules:
  slow_down:
    when: eyes.failed or world.failed or qualities.rescue.degree < 0.5
    mode: slow
    because: it sees nothing
  speed_up:
    when: not (eyes.failed or world.failed)
    mode: fast
    from: slow
  rest:
    when: navigator.failed and eyes.state == 'active' and mode != 'slow' and eyes.target == 'eyes.open'
    mode: eyes.shut
    from: [eyes.open]
"""
RULED = ROBOT + MODES + RULES


def test_two_of_a_kind_have_rules_of_their_own(tmp_path: Path) -> None:
    architecture = load(rovers(tmp_path, _planned(TWO), RULED)).architecture
    rules = {rule.name: rule for rule in architecture.mode_rules}
    assert list(rules) == [
        f"{robot}/{rule}" for robot in ("left", "right") for rule in ("slow_down", "speed_up", "rest")
    ]
    assert rules["left/slow_down"] == ModeRule(
        "left/slow_down",
        "left.eyes.failed or world.failed or qualities.left.rescue.degree < 0.5",
        "left/slow",
        because="it sees nothing",
    )
    assert rules["right/speed_up"] == ModeRule(
        "right/speed_up", "not (right.eyes.failed or world.failed)", "right/fast", ("right/slow",)
    )
    rest = rules["right/rest"]
    assert (rest.mode, rest.start) == ("right/eyes.shut", ("right/eyes.open",))
    assert rest.when == (
        "right.navigator.failed and right.eyes.state == 'active'"
        " and right.mode != 'right/slow' and right.eyes.target == 'right/eyes.open'"
    )
    assert [(known.kind, known.owner) for known in names_of((rest,), architecture).values()] == [
        (NameKind.FAILED, "right.navigator"),
        (NameKind.STATE, "right.eyes"),
        (NameKind.MODE, "right"),
        (NameKind.TARGET, "right.eyes"),
    ]


def test_the_single_robot_s_rules_keep_their_names(tmp_path: Path) -> None:
    rules = load(rovers(tmp_path, _planned(SINGLE), RULED)).architecture.mode_rules
    assert [(rule.name, rule.mode, rule.start) for rule in rules] == [
        ("slow_down", "slow", ()),
        ("speed_up", "fast", ("slow",)),
        ("rest", "eyes.shut", ("eyes.open",)),
    ]
    assert [rule.when for rule in rules] == [
        line.partition("when: ")[2] for line in RULES.splitlines() if "when: " in line
    ]


@pytest.mark.parametrize(
    ("right", "wrong", "field", "problem"),
    [
        ("when: eyes.failed", "when: eyes.faild", "left/slow_down.when", "did you mean 'failed'?"),
        ("when: eyes.failed", "when: eye.failed", "left/slow_down.when", "eye.failed: there is no component 'eye'"),
        ("when: eyes.failed", "when: eyes.failed or or", "left/slow_down.when", "is no expression"),
        (
            "mode: slow\n",
            "mode: slwo\n",
            "left/slow_down.mode",
            "there is no mode 'left/slwo'; did you mean 'left/slow'?",
        ),
        ("from: slow", "from: [slwo]", "left/speed_up.from", "did you mean 'left/slow'?"),
        ("from: [eyes.open]", "from: fast", "left/rest.from", "a mode of another part than 'left/eyes.shut'"),
        ("because:", "becuase:", "left/slow_down.becuase", "did you mean 'because'?"),
    ],
)
def test_a_mistake_in_a_robot_s_rule_is_told_with_the_robot_s_file_and_line(
    tmp_path: Path, right: str, wrong: str, field: str, problem: str
) -> None:
    assert RULES.count(right) == 1
    robot = ROBOT + MODES + RULES.replace(right, wrong)
    lines = told(rovers(tmp_path, _planned(TWO), robot))
    (left,) = [line for line in lines if f"rules.{field}:" in line]
    assert left.startswith(at("rover/robot.yaml", robot, wrong.strip()))
    assert problem in left
    assert [line.partition(": ")[0] for line in lines] == [left.partition(": ")[0]] * 2


def test_a_circle_of_a_robot_s_rules_is_told_with_its_modes_and_the_robot_s_file(tmp_path: Path) -> None:
    rules = "rules:\n  down: {when: mode == 'fast', mode: slow}\n  up: {when: target == 'slow', mode: fast}\n"
    robot = ROBOT + MODES + rules
    (line, *_) = told(rovers(tmp_path, _planned(TWO), robot))
    assert line.startswith(at("rover/robot.yaml", robot, "up:") + "rules.left/up: leads in a circle with 'left/down': ")
    assert "left/slow > left/fast > left/slow" in line or "left/fast > left/slow > left/fast" in line


def test_rules_that_nobody_enforces_are_refused_in_a_robot_too(tmp_path: Path) -> None:
    (line,) = told(rovers(tmp_path, TWO, RULED))
    assert "rules: nobody enforces them: add a component of the class" in line
