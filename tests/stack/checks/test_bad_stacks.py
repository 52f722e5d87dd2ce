"""A stack that cannot run is refused with every problem: its line, field, what is wrong and what would do."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import load
from tests.stack.reading.files import changed, line_of, problems, write

LIMIT = "      max_velocity: 0.2\n"
WORLD = "class: tests.stack.parts:World"
NAVIGATOR = "class: tests.stack.parts:Navigator"
CONNECT = "      odometry: odometry\n"
N = "components.rescuer.navigator"

# What is changed in the good stack: the piece taken out, the piece put in, the part on whose line the problem
# stands, the field, and how the problem begins.
CASES = [
    ("seed: 1\n", "seeds: 1\n", "seeds", "seeds", "there is no such field; did you mean 'seed'?"),
    ("seed: 1\n", "seed: -1\n", "seed", "seed", "-1: must be from 0 to"),
    ("seed: 1\n", "seed: one\n", "seed", "seed", "must be a whole number, is 'one'"),
    ("system: frog", "system: fr/og", "system", "system", "'fr/og' cannot name a system"),
    ("system: frog", "system: 7", "system", "system", "must be a text, is a number: put it in quotes, '7'"),
    ("clock: simulated", "clock: fast", "clock", "clock", "must be one of: real, simulated; is 'fast'"),
    ("speed: max", "speed: double", "speed", "speed", "must be one of: real, max; is 'double'"),
    ("duration: 120", "duration: .inf", "duration", "duration", "must be finite"),
    ("duration: 120", "duration: 0", "duration", "duration", "0: must be at least 0.001"),
    ("truth: regraft/Odometry", "truth: regraft/Odometri", "truth", "topics.truth", "no message type"),
    ("truth: regraft/Odometry", "truth: {rate: 3}", "truth", "topics.truth", "has no 'type'"),
    (
        "rate: 20}\n  scan",
        "rate: quick}\n  scan",
        "rate: quick",
        "topics.odometry.rate",
        "must be a number, is a text",
    ),
    (
        "rate: 20}",
        "rat: 20}",
        "rat: 20",
        "topics.odometry.rat",
        "there is no such field; did you mean 'rate'?",
    ),
    (
        "sensor_stream: true",
        "sensor_stream: yes",
        "sensor",
        "topics.scan.sensor_stream",
        "must be true or false",
    ),
    (
        "rate: 20}",
        "writers: two}",
        "writers",
        "topics.odometry.writers",
        "must be one of: one, many; is 'two'",
    ),
    (
        WORLD,
        "class: nowhere:World",
        "class: nowhere",
        "components.world.class",
        "'nowhere:World': cannot import",
    ),
    (WORLD, "class: World", "class: World", "components.world.class", "'World' must look like"),
    (
        WORLD,
        "class: tests.stack.parts:Wrld",
        "Wrld",
        "components.world.class",
        "'tests.stack.parts:Wrld': 'tests",
    ),
    (
        WORLD,
        "class: tests.stack.parts:Plain",
        "Plain",
        "components.world.class",
        "'tests.stack.parts:Plain' is no",
    ),
    (
        WORLD,
        "class: tests.stack.checks.broken:A",
        "broken",
        "components.world.class",
        "'tests.stack.checks.broken:A': importing",
    ),
    (
        WORLD,
        "cls: tests.stack.parts:World",
        "cls",
        "components.world.cls",
        "there is no such field; it is called 'class'",
    ),
    (
        LIMIT,
        "      max_velocity: 0.9\n",
        "0.9",
        f"{N}.parameters.max_velocity",
        "0.9: must be at most 0.26 m/s",
    ),
    (LIMIT, "      max_velocity: fast\n", "fast", f"{N}.parameters.max_velocity", "'fast': must be a number"),
    (LIMIT, "      max_velocity: .nan\n", ".nan", f"{N}.parameters.max_velocity", "nan: must be finite"),
    (
        LIMIT,
        "      max_velocty: 0.2\n",
        "velocty",
        f"{N}.parameters.max_velocty",
        "there is no such parameter; did",
    ),
    (
        LIMIT,
        "      planner: star\n",
        "star",
        f"{N}.parameters.planner",
        "'star': must be one of: grid, straight",
    ),
    (LIMIT, "      careful: 1\n", "careful", f"{N}.parameters.careful", "1: must be a boolean"),
    (
        "gains: [1, 2.5]",
        "gains: [1, a]",
        "gains",
        f"{N}.parameters.gains",
        "[1, 'a']: must be an array of numbers",
    ),
    ("gains: [1, 2.5]", "gains: [1, -1]", "gains", f"{N}.parameters.gains", "[1, -1]: must be at least 0"),
    (
        CONNECT,
        "      odometry: null\n",
        "odometry: null",
        f"{N}.connect.odometry",
        "input 'odometry' is required while the component is active, but is connected to no topic; topics that carry",
    ),
    (
        CONNECT,
        CONNECT + "      smel: null\n",
        "smel: null",
        f"{N}.connect.smel",
        "there is no port 'smel'; did you mean 'smell'?",
    ),
    (
        CONNECT,
        "      odometry: odometri\n",
        "odometri",
        f"{N}.connect.odometry",
        "input 'odometry' is connected to",
    ),
    (
        CONNECT,
        "      odom: odometry\n",
        "odom: ",
        f"{N}.connect.odom",
        "there is no port 'odom'; did you mean",
    ),
    (
        CONNECT,
        "      odometry: scan\n",
        "odometry: scan",
        f"{N}.connect.odometry",
        "input 'odometry' takes regraft/Odometry, but topic 'scan' carries regraft/LaserScan; topics that",
    ),
    (
        CONNECT,
        "      odometry: truth\n",
        "odometry: truth",
        f"{N}.connect.odometry",
        "input 'odometry' is required, but no component writes topic 'truth'",
    ),
    ("rescuer/navigate_to}", "'a b'}", "'a b'", f"{N}.services.navigate_to", "'a b' cannot name a service"),
    (
        "{navigate_to:",
        "{navigat_to:",
        "navigat_to",
        f"{N}.services.navigat_to",
        "there is no service 'navigat_to'",
    ),
    (
        "when: on_failure",
        "when: seldom",
        "seldom",
        f"{N}.restart.when",
        "must be one of: always, on_failure, never",
    ),
    ("limit: 3", "limit: 5000", "limit", f"{N}.restart.limit", "is 5000, must be at most 1000"),
    ("restart: never", "restart: 5", "restart: 5", "components.recorder.restart", "must be one of: always"),
    (
        "state: inactive",
        "state: asleep",
        "asleep",
        "components.recorder.state",
        "must be one of: active, inactive",
    ),
    (
        "state: inactive",
        "host: moon",
        "moon",
        "components.recorder.host",
        "there is no host 'moon'; there are: local",
    ),
    ("[python, -m, recorder]", "[]", "command", "components.recorder.command", "must name a program"),
    (
        "[python, -m, recorder]",
        "python",
        "command",
        "components.recorder.command",
        "must be a list, is a text",
    ),
    (
        "depth: 3",
        "depth: [1, a]",
        "depth",
        "components.recorder.parameters.depth",
        "must be true or false, a number",
    ),
    ("{scan: regraft/", "{scan: regrft/", "inputs", "components.recorder.inputs.scan", "no message type"),
    (
        "[world, ",
        "[wrld, ",
        "wrld",
        "constraints.0.at_least_one_active.0",
        "there is no component 'wrld'; did you",
    ),
    (
        "[world, rescuer.navigator]",
        "[recorder]",
        "at_least",
        "constraints.0",
        "at least one of recorder must be",
    ),
    ("[world, rescuer.navigator]", "[]", "[]", "constraints.0.at_least_one_active", "must list components"),
    ("at_least_one_active", "at_least_two", "at_least_two", "constraints.0", "must have exactly one of"),
    (
        "at_most: 0.26",
        "at_most: 0.1",
        LIMIT,
        f"{N}.parameters.max_velocity",
        "0.2: a constraint says that it must",
    ),
    (
        "at_most: 0.26",
        "because: it",
        "parameter: ",
        "constraints.1",
        "must say 'at_least', 'at_most' or both",
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[3]}: {case[1].strip()}")
def test_problem_is_told_with_line_field_and_remedy(tmp_path: Path, case: tuple[str, str, str, str, str]) -> None:
    old, new, piece, field, start = case
    text = changed((old, new))
    found = problems(tmp_path, text)
    matching = [problem for problem in found if problem.field == field and problem.problem.startswith(start)]
    assert len(matching) == 1, "\n".join(map(str, found))
    assert matching[0].line == line_of(text, piece)
    assert matching[0].file == str(tmp_path / "stack.yaml")


def test_all_problems_are_told_in_the_order_of_their_lines(tmp_path: Path) -> None:
    text = changed(
        ("seed: 1\n", "seed: one\n"),
        ("rate: 20}", "rat: 20}"),
        (LIMIT, "      max_velocity: 0.9\n"),
        ("state: inactive", "state: asleep"),
        ("at_most: 0.26", "at_most: 1"),
    )
    assert [problem.field for problem in problems(tmp_path, text)] == [
        "seed",
        "topics.odometry.rat",
        f"{N}.parameters.max_velocity",
        "components.recorder.state",
    ]


def test_problem_reads_as_file_line_field_and_text(tmp_path: Path) -> None:
    text = changed((LIMIT, "      max_velocity: 0.3\n"), ("at_most: 0.26", "at_most: 1"))
    (problem,) = problems(tmp_path, text)
    place = f"{write(tmp_path, text)}:{line_of(text, 'max_velocity: 0.3')}"
    assert str(problem) == f"{place}: {N}.parameters.max_velocity: 0.3: must be at most 0.26 m/s"


def test_missing_system_and_components_are_told(tmp_path: Path) -> None:
    (system,) = problems(tmp_path, "clock: real\n")
    assert system.problem == "is missing: must name the system, such as 'frog'"
    (components,) = problems(tmp_path, "system: frog\n")
    assert components.problem == "there are none: a stack needs at least one"


def test_components_that_are_no_map_are_told_alone(tmp_path: Path) -> None:
    text = (
        "system: a\nclock: simulated\ncomponents: [world]\nmodes:\n  night:\n    - {change: remove, component: world}\n"
    )
    (problem,) = problems(tmp_path, text)
    assert (problem.line, problem.field) == (3, "components")


def test_component_without_class_or_command_is_told(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: a\ncomponents:\n  eye: {state: inactive}\n")
    assert (problem.line, problem.field) == (3, "components.eye")
    assert problem.problem == "must have 'class' (module:Class) or 'command', has neither"


def test_component_whose_class_is_unknown_hides_no_other_problem_and_adds_none(tmp_path: Path) -> None:
    text = changed(
        (WORLD, "class: nowhere:World"), (LIMIT, "      max_velocity: 0.9\n"), ("at_most: 0.26", "at_most: 1")
    )
    assert [problem.field for problem in problems(tmp_path, text)] == [
        "components.world.class",
        f"{N}.parameters.max_velocity",
    ]


def test_two_writers_of_a_topic_are_told_at_both(tmp_path: Path) -> None:
    text = changed(("  recorder:\n", "  stick: {class: 'tests.stack.parts:Joystick'}\n  recorder:\n"))
    first, second = problems(tmp_path, text)
    assert first.problem.startswith("output 'velocity' writes topic 'velocity', as 'stick' does")
    assert (second.field, second.line) == ("components.stick.connect.velocity", line_of(text, "stick:"))


def test_many_writers_are_welcome_where_the_topic_says_so(tmp_path: Path) -> None:
    text = changed(
        ("  recorder:\n", "  stick: {class: 'tests.stack.parts:Joystick', host: moon}\n  recorder:\n"),
        ("velocity: regraft/Twist", "velocity: {type: regraft/Twist, writers: many}"),
    )
    (problem,) = problems(tmp_path, text)
    assert problem.field == "components.stick.host"


OFFER = "system: a\nhosts: {local: {devices: [/dev/gripper], amounts: {grip: 2}}}\n"


def test_a_device_or_an_amount_that_the_host_does_not_offer_is_told(tmp_path: Path) -> None:
    component = "components:\n  g: {class: 'tests.stack.parts:Squeezer', host: edge}\n"
    text = f"system: a\nhosts: {{edge: {{amounts: {{gripp: 3}}}}}}\n{component}"
    amount, device = problems(tmp_path, text)
    assert (amount.line, amount.field) == (4, "components.g")
    assert amount.problem == (
        "needs 1.5 grip, and host 'edge' offers none: name it under hosts.edge.amounts; did you mean 'gripp'?"
    )
    assert device.problem.startswith("needs /dev/gripper for itself, and host 'edge' has none")


def test_more_of_an_amount_than_the_host_offers_is_told_with_who_needs_it(tmp_path: Path) -> None:
    parts = "components:\n  g: {class: 'tests.stack.parts:Squeezer'}\n  h: {class: 'tests.stack.parts:Presser'}\n"
    (problem,) = problems(tmp_path, OFFER + parts)
    assert (problem.line, problem.field) == (2, "hosts.local.amounts.grip")
    assert problem.problem == (
        "offers 2 grip, but its components need 2.25 (g 1.5, h 0.75): place some of them elsewhere"
    )
    assert load(write(tmp_path, OFFER + parts.replace("Presser'", "Presser', state: unconfigured")))


def test_an_amount_that_a_class_cannot_need_is_told(tmp_path: Path) -> None:
    for name, why in (("Negative", "is -1, must be finite and at least 0"), ("Doubled", "is a field of its own")):
        (problem,) = problems(tmp_path, f"{OFFER}components:\n  g: {{class: 'tests.stack.parts:{name}'}}\n")
        assert (problem.line, problem.field) == (4, "components.g.class")
        assert "resources.amounts." in problem.problem
        assert why in problem.problem


def test_device_held_twice_is_told(tmp_path: Path) -> None:
    gripper = "{class: 'tests.stack.parts:Gripper'}"
    first, second = problems(tmp_path, f"{OFFER}components:\n  left: {gripper}\n  right: {gripper}\n")
    assert first.problem.startswith("needs /dev/gripper of host 'local' for itself, but 'right' holds it")
    assert (second.line, second.field) == (5, "components.right")


def test_simulated_time_needs_one_source(tmp_path: Path) -> None:
    (problem,) = problems(
        tmp_path, f"{OFFER}clock: simulated\ncomponents:\n  g: {{class: 'tests.stack.parts:Gripper'}}\n"
    )
    assert (problem.line, problem.field) == (3, "clock")


def test_simulated_time_has_only_one_source(tmp_path: Path) -> None:
    text = changed(
        (
            "  recorder:\n",
            "  moon:\n    class: tests.stack.parts:World\n    parameters: {speed: max}\n"
            "    connect: {odometry: truth, scan: echo}\n  recorder:\n",
        ),
        ("  truth: regraft/Odometry\n", "  truth: regraft/Odometry\n  echo: regraft/LaserScan\n"),
        ("speed: max\n", ""),
    )
    found = problems(tmp_path, text)
    assert {problem.field for problem in found} == {"components.moon.class", "components.world.class"}


def test_real_time_has_no_source_and_no_speed(tmp_path: Path) -> None:
    found = problems(tmp_path, changed(("clock: simulated", "clock: real")))
    assert [problem.field for problem in found] == ["speed", "components.world.class"]


def test_speed_given_twice_is_told(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, changed(("tick_rate: 10}", "speed: real}")))
    assert problem.field == "speed"
