"""A stack includes others and says only what differs; every error names the file and line of its cause."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.lifecycle import State
from regraft.stack import load
from regraft.stack.yaml.document import DEEPEST
from tests.stack.reading.files import GOOD, line_of
from tests.stack.reading.folders import at, loaded, told, write_all

ANOTHER = """\
include: [base.yaml]
seed: 7
topics:
  scan: {rate: 10}
  velocity: {rate: 20}
  truth: null
components:
  rescuer.navigator:
    parameters: {max_velocity: 0.1, gains: [3]}
    restart: never
  recorder: null
  stick: {class: "tests.stack.parts:Joystick", state: inactive}
"""


def test_what_the_including_file_says_goes_over_what_it_includes(tmp_path: Path) -> None:
    stack = loaded(tmp_path, base=GOOD, stack=ANOTHER)
    assert (stack.name, stack.seed, stack.duration) == ("frog", 7, 120)
    topics = stack.architecture.topics
    assert (topics["scan"].rate, topics["scan"].reliable) == (10.0, False)
    assert (topics["velocity"].rate, topics["velocity"].type) == (20.0, "regraft/Twist")
    navigator = stack.architecture.components["rescuer.navigator"]
    assert navigator.parameters == {"max_velocity": 0.1, "gains": [3]}
    assert navigator.connections["odometry"] == "odometry"


def test_null_removes_and_a_whole_new_entry_adds(tmp_path: Path) -> None:
    architecture = loaded(tmp_path, base=GOOD, stack=ANOTHER).architecture
    assert "truth" not in architecture.topics
    assert list(architecture.components) == ["world", "rescuer.navigator", "stick"]
    assert architecture.components["stick"].state is State.INACTIVE


def test_a_later_include_goes_over_an_earlier_one(tmp_path: Path) -> None:
    files = {"base": GOOD, "slow": "seed: 2\nspeed: real\n", "slower": "seed: 3\n"}
    stack = loaded(tmp_path, **files, stack="include: [base.yaml, slow.yaml, slower.yaml]\n")
    assert (stack.seed, stack.speed) == (3, "real")


def test_a_file_that_two_include_applies_once_where_it_is_first(tmp_path: Path) -> None:
    left = "include: [base.yaml]\nseed: 5\n"
    right = "include: [base.yaml]\nduration: 9\n"
    stack = loaded(tmp_path, base=GOOD, left=left, right=right, stack="include: [left.yaml, right.yaml]\n")
    assert (stack.seed, stack.duration) == (5, 9)


def test_relative_paths_are_looked_for_beside_the_file_that_has_them(tmp_path: Path) -> None:
    over = "include: [common/base.yaml]\ncomponents:\n  world: {parameters: {mesh: own.obj}}\n"
    stack = write_all(tmp_path, common_base=GOOD, stack=over)
    (tmp_path / "own.obj").touch()
    parameters = load(stack).architecture.components["world"].parameters
    assert parameters["file"] == str(tmp_path / "common" / "world.xml")
    assert parameters["mesh"] == str(tmp_path / "own.obj")


def test_classes_beside_an_included_file_are_found(tmp_path: Path) -> None:
    base = "system: own\ncomponents:\n  bell: {class: 'included_parts:Bell'}\n"
    write_all(tmp_path, common_base=base, stack="include: [common/base.yaml]\n")
    text = "from regraft import Component\nclass Bell(Component):\n    'Rings.'\n"
    (tmp_path / "common" / "included_parts.py").write_text(text)
    stack = load(tmp_path / "stack.yaml")
    assert stack.architecture.components["bell"].description is not None


def test_a_wrong_value_is_told_where_it_is_written(tmp_path: Path) -> None:
    base = GOOD.replace("tick_rate: 10", "tick_rate: 0")
    over = "include: [base.yaml]\ncomponents:\n  rescuer.navigator:\n    parameters: {max_velocity: 5}\n"
    first, second, third = told(write_all(tmp_path, base=base, stack=over))
    field = "components.rescuer.navigator.parameters.max_velocity"
    # One by the class, one by a constraint of the base: both have the same cause.
    assert first == f"stack.yaml:4: {field}: 5: must be at most 0.26 m/s"
    assert second.startswith(f"stack.yaml:4: {field}: 5: a constraint says")
    assert third.startswith(at("base.yaml", base, "file: world") + "components.world.parameters.tick_rate: 0: must")


@pytest.mark.parametrize(
    ("over", "problem"),
    [
        (
            "components:\n  wrld: null\n",
            "components.wrld: there is no component 'wrld' to remove; did you mean 'world'?",
        ),
        (
            "components:\n  wrld: {parameters: {tick_rate: 3}}\n",
            "components.wrld: there is no component 'wrld' to change, and a new one needs 'class' or 'command'; "
            "did you mean 'world'?",
        ),
        ("topics:\n  skan: null\n", "topics.skan: there is no topic 'skan' to remove; did you mean 'scan'?"),
        (
            "topics:\n  skan: {rate: 3}\n",
            "topics.skan: there is no topic 'skan' to change, and a new one needs 'type'; did you mean 'scan'?",
        ),
        (
            "components:\n  world: {parameters: {tick_rat: ~}}\n",
            "components.world.parameters.tick_rat: there is no field 'tick_rat' to remove; did you mean 'tick_rate'?",
        ),
        ("limits: ~\n", "limits: there is no field 'limits' to remove; there are: clock, components, constraints, "),
    ],
)
def test_a_change_of_what_is_not_there_is_refused_with_the_nearest(tmp_path: Path, over: str, problem: str) -> None:
    text = f"include: [base.yaml]\n{over}"
    (line,) = told(write_all(tmp_path, base=GOOD, stack=text))
    assert line.startswith(f"stack.yaml:{2 + over.startswith(('components', 'topics'))}: {problem}")


def test_a_circle_is_refused_with_its_chain(tmp_path: Path) -> None:
    files = {"stack": "include: [a.yaml]\n", "a": "include: [b.yaml]\n", "b": "seed: 1\ninclude: [a.yaml]\n"}
    (line,) = told(write_all(tmp_path, **files))
    assert line == "b.yaml:2: include.0: 'a.yaml' includes itself: stack.yaml > a.yaml > b.yaml > a.yaml"


def test_a_missing_file_is_refused_with_the_nearest_path(tmp_path: Path) -> None:
    (line,) = told(write_all(tmp_path, base=GOOD, stack="seed: 1\ninclude:\n  - bse.yaml\n"))
    assert line == "stack.yaml:3: include.0: 'bse.yaml': there is no such file; did you mean 'base.yaml'?"


@pytest.mark.parametrize(
    ("include", "problem"),
    [
        ("base.yaml", "include: must be a list of files, is a text"),
        ("[3]", "include.0: must be the path of a file, is a number"),
        ("[.]", "include.0: '.': is not an ordinary file"),
        ("[x" + 300 * "y" + "]", "include.0: "),
    ],
)
def test_an_include_that_is_no_list_of_files_is_refused(tmp_path: Path, include: str, problem: str) -> None:
    (line,) = told(write_all(tmp_path, base=GOOD, stack=f"include: {include}\n{GOOD}"))
    assert line.startswith(f"stack.yaml:1: {problem}")


def test_every_fault_of_every_file_is_told(tmp_path: Path) -> None:
    files = {"stack": "include: [a.yaml, b.yaml]\n", "a": "system: [\n", "b": "seed: 1\nseed: 2\n"}
    first, second = told(write_all(tmp_path, **files))
    assert first.startswith("a.yaml:2: is not YAML")
    assert second.startswith("b.yaml:2: seed: is given twice, first in line 1")


def test_includes_are_bounded_in_depth(tmp_path: Path) -> None:
    files = {f"n{number}": f"include: [n{number + 1}.yaml]\n" for number in range(DEEPEST + 2)}
    (line,) = told(write_all(tmp_path, **files, **{f"n{DEEPEST + 2}": GOOD}, stack="include: [n0.yaml]\n"))
    assert line.endswith(f"include.0: is included too deeply: at most {DEEPEST} levels")


def test_includes_are_bounded_in_size_together(tmp_path: Path) -> None:
    many = f"seed: 1\nx: [{', '.join(['1'] * 11_000)}]\n"
    lines = told(write_all(tmp_path, a=many, b=many, stack=f"include: [a.yaml, b.yaml]\n{GOOD}"))
    assert lines[0] == "b.yaml: the stack holds more than 20000 values with this file"


def test_an_unknown_field_of_an_included_file_is_told_there(tmp_path: Path) -> None:
    base = GOOD + "sed: 3\n"
    (line,) = told(write_all(tmp_path, base=base, stack="include: [base.yaml]\n"))
    assert line == f"base.yaml:{line_of(base, 'sed:')}: sed: there is no such field; did you mean 'seed'?"


def test_a_file_of_modes_stays_beside_modes_that_another_file_has(tmp_path: Path) -> None:
    modes = "{__DEFAULT__: {rescuer/navigator: active}, OFF: {rescuer/navigator: inactive}}"
    (tmp_path / "modes.yaml").write_text(f"drive: {{ros__parameters: {{type: system, modes: {modes}}}}}\n")
    night = "modes: {night: [{change: mode, mode: drive.OFF}]}\n"
    of_file = "modes: modes.yaml\n"
    for base, over in ((of_file, night), (night, of_file)):
        stack = loaded(tmp_path, base=GOOD + base, stack=f"include: [base.yaml]\n{over}")
        assert set(stack.architecture.modes) == {"night", "drive.__DEFAULT__", "drive.OFF"}
    (tmp_path / "others.yaml").write_text(f"pull: {{ros__parameters: {{type: system, modes: {modes}}}}}\n")
    stack = loaded(tmp_path, base=GOOD + of_file, stack="include: [base.yaml]\nmodes: others.yaml\n")
    assert set(stack.architecture.modes) == {"pull.__DEFAULT__", "pull.OFF"}


def test_of_many_names_that_are_not_there_the_first_have_hints(tmp_path: Path) -> None:
    over = "".join(f"  not_there_{number}: {{rate: 1}}\n" for number in range(100))
    lines = told(write_all(tmp_path, base=GOOD, stack=f"include: [base.yaml]\ntopics:\n{over}"))
    assert len(lines) == 100
    assert lines[0].endswith("and a new one needs 'type'; there are: odometry, scan, truth, velocity")
    assert lines[-1].endswith("and a new one needs 'type'; there are 4 others")
