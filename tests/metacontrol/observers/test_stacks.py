"""Observers are compared with their stack before anything starts, also those of a robot among several."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import StackError, check_with_classes, load

STACK = """\
system: watched
imports: [tests.metacontrol.patrol.parts]
topics:
  diagnostics: {type: regraft/Diagnostic, writers: many}
components:
  camera: {class: 'tests.metacontrol.patrol.parts:Beacon'}
  workshop: {class: 'tests.metacontrol.patrol.parts:Workshop'}
  logger: {command: [sleep, "9"], managed: false}
  component_observer:
    class: regraft.services.observers.component_observer:ComponentObserver
    parameters: {observed: observed_components.yaml}
  quality_observer:
    class: regraft.services.observers.quality_observer:QualityObserver
    parameters:
      observed: observed_qualities.yaml
      contexts: [{context: Default, when: workshop.energy < 0.5}]
"""
COMPONENTS = "modes_observer:\n  ros__parameters:\n    components: camera\n"
QUALITIES = 'quality_observer:\n  ros__parameters:\n    qualities:\n      safety: "workshop.safety"\n'


def problems(folder: Path, stack: str = STACK, components: str = COMPONENTS, qualities: str = QUALITIES) -> list[str]:
    """Return what is wrong with a stack, without the folder's name."""
    (folder / "observed_components.yaml").write_text(components)
    (folder / "observed_qualities.yaml").write_text(qualities)
    file = folder / "stack.yaml"
    file.write_text(stack)
    try:
        check_with_classes(load(file))
    except StackError as error:
        return [str(each).replace(f"{folder}/", "") for each in error.problems]
    return []


def test_what_the_stack_has_is_right(tmp_path: Path) -> None:
    assert problems(tmp_path) == []


def test_observed_components_have_to_be_there(tmp_path: Path) -> None:
    assert problems(tmp_path, components=COMPONENTS.replace("camera", "camra logger")) == [
        "stack.yaml:11: components.component_observer.parameters.observed: observed_components.yaml:3: "
        "there is no component 'camra'; did you mean 'camera'?",
        "stack.yaml:11: components.component_observer.parameters.observed: observed_components.yaml:3: "
        "'logger' is unmanaged: it has no lifecycle to observe",
    ]


def test_the_observer_of_components_needs_its_file(tmp_path: Path) -> None:
    (found,) = problems(tmp_path, STACK.replace("    parameters: {observed: observed_components.yaml}\n", ""))
    assert found.endswith("names no file: must be the generated observed_components.yaml")


def test_a_file_that_is_wrong_is_refused_with_its_line(tmp_path: Path) -> None:
    assert problems(tmp_path, components=COMPONENTS.replace("ros__", "ros_")) == [
        "stack.yaml:11: components.component_observer.parameters.observed: observed_components.yaml:2: "
        "modes_observer.ros_parameters: there is no such field; did you mean 'ros__parameters'?",
    ]


@pytest.mark.parametrize(
    ("measured", "problem"),
    [
        ("workshop.safty", "workshop.safty: workshop has no 'safty' to decide by; did you mean 'safety'?"),
        ("workshp.safety", "workshp.safety: there is no component 'workshp'; did you mean 'workshop'?"),
        ("safety", "'safety' is no quality: must be such as 'component.quality'"),
        ("workshop.state", "workshop.state is a text, must be a number"),
        ("1 if qualities.MoveSafely.satisfied else 0", "'qualities.MoveSafely.satisfied' has no place here"),
        ("logger.load", "logger.load: logger is unmanaged"),
    ],
)
def test_names_in_expressions_have_to_be_there(measured: str, problem: str, tmp_path: Path) -> None:
    (found,) = problems(tmp_path, qualities=QUALITIES.replace("workshop.safety", measured))
    place = "stack.yaml:15: components.quality_observer.parameters.observed: observed_qualities.yaml:4: safety: "
    assert found.startswith(place + problem)


def test_names_in_conditions_of_contexts_have_to_be_there(tmp_path: Path) -> None:
    (found,) = problems(tmp_path, STACK.replace("workshop.energy <", "workshop.enrgy <"))
    assert "contexts.0.when: workshop.enrgy: workshop has no 'enrgy' to decide by; did you mean 'energy'?" in found
    (found,) = problems(tmp_path, STACK.replace("workshop.energy < 0.5", "workshop.energy"))
    assert "contexts.0.when: workshop.energy is a number, must be true or false" in found


def test_sensors_have_to_be_there(tmp_path: Path) -> None:
    sensors = "[{topic: pictures, component: camra}, {topic: pictures, component: camera}]"
    found = problems(tmp_path, STACK.replace("_components.yaml}", f"_components.yaml, sensors: {sensors}}}"))
    assert found == [
        "stack.yaml:11: components.component_observer.parameters.sensors.1.topic: "
        "this topic is given before: leave one out"
    ]
    one = "[{topic: pictures, component: camra}]"
    found = problems(tmp_path, STACK.replace("_components.yaml}", f"_components.yaml, sensors: {one}}}"))
    assert [each.partition("sensors.0.")[2] for each in found] == [
        "topic: there is no topic 'pictures'; there are: diagnostics",
        "component: there is no component 'camra'; did you mean 'camera'?",
    ]


def test_an_observer_of_a_robot_observes_that_robot(tmp_path: Path) -> None:
    robot = tmp_path / "rover"
    robot.mkdir()
    body = "model: rover.xml\n" + STACK.replace("system: watched\n", "").replace(
        "imports: [tests.metacontrol.patrol.parts]\n", ""
    )
    (robot / "robot.yaml").write_text(body)
    (robot / "rover.xml").write_text("<mujoco/>")
    (robot / "observed_components.yaml").write_text(COMPONENTS)
    (robot / "observed_qualities.yaml").write_text(QUALITIES)
    fleet = "system: fleet\nimports: [tests.metacontrol.patrol.parts]\nrobots: {scout: {robot: rover}}\n"
    assert problems(tmp_path, fleet) == []
    (robot / "observed_components.yaml").write_text(COMPONENTS.replace("camera", "camra"))
    (found,) = problems(tmp_path, fleet)
    assert "there is no component 'scout.camra'; did you mean 'scout.camera'?" in found
