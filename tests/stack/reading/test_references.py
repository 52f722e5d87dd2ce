"""References stand for a robot's parameters, its name, the world and the robots."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.stack import load
from regraft.stack.sections.components import in_run_folder
from tests.stack.reading.folders import ROBOT, SINGLE, TWO, at, rovers, told


def test_a_parameter_may_be_any_value_and_refer_to_others(tmp_path: Path) -> None:
    robot = ROBOT.replace("beams: 90", "beams: 90, gains: [$low, 2], low: 1").replace(
        "{max_velocity: $speed}", "{max_velocity: $speed, gains: $gains}"
    )
    assert load(rovers(tmp_path, SINGLE, robot)).architecture.components["navigator"].parameters["gains"] == [1, 2]


def test_a_robot_knows_its_name_and_the_world(tmp_path: Path) -> None:
    command = "  scribe: {command: [scribe], managed: false, parameters: {name: $robot, world: $world}}\n"
    robot = ROBOT.replace("constraints:\n", f"{command}constraints:\n")
    components = load(rovers(tmp_path, robot=robot)).architecture.components
    assert components["left.scribe"].parameters == {"name": "left", "world": str(tmp_path / "room.xml")}


def test_a_component_of_a_robot_may_take_all_robots(tmp_path: Path) -> None:
    robot = ROBOT.replace(
        "components:\n", 'components:\n  fleet: {class: "tests.stack.parts:Fleet", parameters: {robots: $robots}}\n'
    )
    text = TWO.partition("components:")[0]
    text = text.replace("  right: ", "  # right: ")
    parameters = load(rovers(tmp_path, text, robot)).architecture.components["left.fleet"].parameters
    assert [one["name"] for one in parameters["robots"]] == ["left"]


def test_without_robots_their_list_is_empty(tmp_path: Path) -> None:
    text = SINGLE.replace("robot: rover\n", "")
    assert load(rovers(tmp_path, text)).architecture.components["world"].parameters["robots"] == []


@pytest.mark.parametrize(
    ("written", "meant"),
    [("$RUN/a", "$RUN/a"), ("$RUN", "$RUN"), ("$$speed", "$speed"), ("'$$x'", "$x"), ("$a-b", "$a-b"), ("a$b", "a$b")],
)
def test_other_texts_stay_and_two_dollars_are_one(tmp_path: Path, written: str, meant: str) -> None:
    text = f"system: a\ncomponents:\n  a: {{command: [x], managed: false, parameters: {{p: {written}}}}}\n"
    assert load(rovers(tmp_path, text)).architecture.components["a"].parameters == {"p": meant}


def test_a_wrong_value_is_told_where_it_is_written(tmp_path: Path) -> None:
    robot = ROBOT.replace("speed: 0.2", "speed: fast")
    lines = told(rovers(tmp_path, SINGLE, robot))
    assert lines[0] == at("rover/robot.yaml", robot, "speed:") + (
        "components.navigator.parameters.max_velocity: 'fast': must be a number"
    )


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "{limit: $speed}",
            "{limit: $sped}",
            "4: robot.devices.drive.parameters.limit: '$sped': there is no such value; "
            "did you mean '$speed'?; a text that begins with '$' is written '$$sped'",
        ),
        ("speed: 0.2", "speed: $beams", None),
        ("speed: 0.2", "speed: $speed", "2: robot.parameters.speed: '$speed': refers to itself: $speed > $speed"),
        (
            "beams: 90",
            "beams: [$horn, $a], a: $b, b: {c: $beams}",
            "2: robot.parameters.beams.1: '$a': refers to itself: $a > $b > $beams > $a",
        ),
        (
            "{limit: $speed}",
            "{all: $robots}",
            "4: robot.devices.drive.parameters.all: '$robots': the list of the robots",
        ),
    ],
)
def test_a_reference_to_nothing_or_to_itself_is_refused(
    tmp_path: Path, old: str, new: str, problem: str | None
) -> None:
    lines = told(rovers(tmp_path, SINGLE, ROBOT.replace(old, new)))
    if problem is None:
        assert "must be at most 0.26" in lines[0]
    else:
        assert lines[0].startswith(f"rover/robot.yaml:{problem}"), lines


def test_a_world_that_the_stack_has_not_is_refused(tmp_path: Path) -> None:
    text = TWO.replace("world: room.xml\n", "")
    assert told(rovers(tmp_path, text)) == [
        at("stack.yaml", text, "  world:") + "components.world.parameters.file: '$world': the stack has no 'world'"
    ]


def test_references_are_bounded_in_what_they_stand_for(tmp_path: Path) -> None:
    doubling = ", ".join(f"p{n}: [{', '.join([f'$p{n + 1}'] * 9)}]" for n in range(20))
    robot = ROBOT.replace("beams: 90", f"beams: $p0, {doubling}, p20: [1, 2, 3]")
    assert told(rovers(tmp_path, SINGLE, robot)) == [
        "rover/robot.yaml:2: holds more than 20000 values, counting what references stand for"
    ]


def test_references_are_bounded_in_depth(tmp_path: Path) -> None:
    chain = ", ".join(f"p{n}: [$p{n + 1}]" for n in range(60))
    robot = ROBOT.replace("beams: 90", f"beams: $p0, {chain}, p60: 1")
    assert "refers on and on" in told(rovers(tmp_path, SINGLE, robot))[0]


def test_an_argument_of_a_program_may_be_a_number_that_a_reference_has_or_nothing(tmp_path: Path) -> None:
    wheels = 'components:\n  wheels: {command: [wheels, $robot, "", --beams, $beams, $speed]}\n'
    robot = ROBOT.replace("components:\n", wheels)
    single = load(rovers(tmp_path, SINGLE, robot)).architecture
    assert single.components["wheels"].command == ("wheels", "", "", "--beams", "90", "0.2")
    two = load(rovers(tmp_path, TWO, robot)).architecture
    assert two.components["right.wheels"].command == ("wheels", "right", "", "--beams", "90", "0.1")


def test_a_number_that_is_written_as_an_argument_of_a_program_stands_in_quotes(tmp_path: Path) -> None:
    (line,) = told(rovers(tmp_path, TWO + "  wheels: {command: [wheels, 0644]}\n"))
    assert line.endswith("components.wheels.command.1: must be a text, is a number: put it in quotes, '644'")
    (line,) = told(rovers(tmp_path, TWO + "  wheels: {command: ['']}\n"))
    assert line.endswith("components.wheels.command.0: must be a text, is empty")


def test_only_the_folder_of_the_running_system_is_meant_by_its_name(tmp_path: Path) -> None:
    (line,) = told(rovers(tmp_path, TWO + "  notes: {command: [notes], parameters: {a: $RUNTIME}}\n"))
    assert "components.notes.parameters.a: '$RUNTIME': there is no such value" in line
    spec = ComponentSpec("a", parameters={"a": "$RUN", "b": "$RUN/x", "c": "$RUN-x", "d": "$RUNTIME"})
    assert in_run_folder(spec, "/run").parameters == {"a": "/run", "b": "/run/x", "c": "$RUN-x", "d": "$RUNTIME"}


def test_a_robot_may_have_a_parameter_whose_name_begins_as_that_of_the_folder(tmp_path: Path) -> None:
    given = ROBOT.replace("speed: ", "RUNTIME: 3, speed: ", 1)
    assert given != ROBOT
    load(rovers(tmp_path, robot=given.replace("max_velocity: $speed", "max_velocity: $speed", 1)))
