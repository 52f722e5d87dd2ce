"""The generated modes file loads into our stacks and in a strict parser, with the default first everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from regraft.adaptation_manager.planners.metacontrol.skills.generators.observed_components import observed_components
from regraft.adaptation_manager.planners.metacontrol.skills.generators.system_modes import system_modes
from regraft.stack import load
from regraft.stack.sections.system_modes import read_system_modes
from tests.metacontrol.skills.texts import GOOD, PAPER, checked, errors, realization, skill
from tests.stack.reading.files import GOOD as STACK
from tests.stack.reading.files import write


def modes(text: str, one_system: str = "") -> dict[str, Any]:
    """Return the content of the generated file."""
    assert errors(text) == []
    found = yaml.safe_load(system_modes(checked(text).skills, one_system))
    assert isinstance(found, dict)
    return {name: part["ros__parameters"] for name, part in found.items()}


def changes(text: str, folder: Path, one_system: str = "") -> dict[str, Any]:
    """Return what our stacks make of the generated file."""
    skills = checked(text).skills
    file = folder / "modes.yaml"
    file.write_text(system_modes(skills, one_system))
    return read_system_modes(
        file, {each.name.replace("/", ".") for one in skills.realizations for each in one.components}
    )


def test_a_skill_is_a_system_and_a_realization_its_mode(tmp_path: Path) -> None:
    found = modes(PAPER)
    assert list(found) == ["to_navigate", "amcl", "bt_navigator", "controller_server", "laser_resender"]
    system = found["to_navigate"]
    assert (system["type"], list(system["modes"])) == ("system", ["__DEFAULT__", "f_slow_mode"])
    assert system["parts"].split() == [
        "amcl",
        "bt_navigator",
        "controller_server",
        "pointcloud_to_laser",
        "laser_resender",
    ]
    assert system["modes"]["f_slow_mode"] == {
        "amcl": "active",
        "bt_navigator": "active",
        "controller_server": "active.SLOW",
        "pointcloud_to_laser": "inactive",
        "laser_resender": "active",
    }
    read = changes(PAPER, tmp_path)
    assert [each["transition"] for each in read["to_navigate.__DEFAULT__"]] == ["deactivate"] * 5


def test_a_stack_takes_the_file_as_its_modes(tmp_path: Path) -> None:
    text = skill(
        realization(components="Component rescuer.navigator { Configuration active.SLOW { max_velocity: 0.1 } }")
    )
    (tmp_path / "modes.yaml").write_text(system_modes(checked(text).skills))
    architecture = load(write(tmp_path, f"{STACK}modes: modes.yaml\n")).architecture
    assert list(architecture.modes) == [
        "move.__DEFAULT__",
        "move.go",
        "rescuer/navigator.__DEFAULT__",
        "rescuer/navigator.SLOW",
    ]


def test_the_text_has_neither_tabs_nor_single_underscores() -> None:
    text = system_modes(checked(PAPER).skills)
    assert "\t" not in text
    assert " ros_parameters" not in text
    assert '"navigate_w_replanning_and_recovery.xml"' in text


def test_the_default_is_first_in_systems_and_nodes_and_names_all_that_others_set() -> None:
    text = "Component m { Configuration active.A { p: 1 }, Configuration active.B { q: 2 } }" + skill(
        realization("a", "Component m active.A"), realization("b", "Component n active, Component m active.B")
    )
    found = modes(text)
    for part in found.values():
        assert next(iter(part["modes"])) == "__DEFAULT__"
    assert found["m"]["modes"]["__DEFAULT__"] == {"ros__parameters": {"p": 1, "q": 2}}
    assert found["move"]["modes"]["__DEFAULT__"] == {"m": "inactive", "n": "inactive"}
    assert "n" not in found


@pytest.mark.parametrize("name", ["_DEFAULT_mode", "parked", "__DEFAULT__"])
def test_rest_is_the_default_mode(name: str) -> None:
    text = skill(
        realization(), realization(name, "Component motor unconfigured"), realization("x", "Component arm active")
    )
    found = modes(text)["move"]["modes"]
    assert list(found) == ["__DEFAULT__", "go", "x"]
    assert found["__DEFAULT__"] == {"motor": "unconfigured", "arm": "inactive"}


def test_a_default_configuration_is_the_default_mode_of_its_node(tmp_path: Path) -> None:
    text = skill(realization(components="Component m { Configuration active._Default_ { p: 0.5 } }"))
    assert modes(text)["move"]["modes"]["go"] == {"m": "active"}
    assert modes(text)["m"]["modes"] == {"__DEFAULT__": {"ros__parameters": {"p": 0.5}}}
    values, _ = changes(text, tmp_path)["move.go"]
    assert values["parameters"] == {"p": 0.5}


def test_an_active_configuration_among_several_counts() -> None:
    text = skill(realization(components="Component m { Configuration inactive, Configuration active.X { p: 1 } }"))
    assert modes(text)["move"]["modes"]["go"] == {"m": "active.X"}


def test_unrealisable_realizations_are_left_out(tmp_path: Path) -> None:
    text = skill(realization(), realization("x", "Component motor active, Component arm finalized"))
    assert list(modes(text)["move"]["modes"]) == ["__DEFAULT__", "go"]
    assert list(changes(text, tmp_path)) == ["move.__DEFAULT__", "move.go"]


TWO = skill(realization("x"), realization("y", "Component arm active"), name="a") + skill(
    realization("x"), realization("off", "Component motor inactive"), realization("z", "Component leg active"), name="b"
)


def test_names_of_two_skills_are_apart_in_systems_and_qualified_in_one(tmp_path: Path) -> None:
    assert {name: list(part["modes"]) for name, part in modes(TWO).items()} == {
        "a": ["__DEFAULT__", "x", "y"],
        "b": ["__DEFAULT__", "x", "z"],
    }
    one = modes(TWO, "robot")
    assert list(one) == ["robot"]
    assert list(one["robot"]["modes"]) == ["__DEFAULT__", "a_x", "y", "b_x", "z"]
    assert one["robot"]["modes"]["__DEFAULT__"] == {"motor": "inactive", "arm": "inactive", "leg": "inactive"}
    assert "robot.b_x" in changes(TWO, tmp_path, "robot")


def test_a_qualified_name_takes_no_other_realizations_name() -> None:
    text = TWO + realization("a_x", "Component tail active", of="b")
    names = list(modes(text, "robot")["robot"]["modes"])
    assert len(set(names)) == len(names) == 6


@pytest.mark.parametrize("name", ["null", "yes", "on", "No", "y", "f_mode", "context", "active"])
def test_any_legal_name_is_a_realizations_name(name: str, tmp_path: Path) -> None:
    text = skill(realization(name, f"Component {name}_c active, Component true_{name} inactive"), name=f"s_{name}")
    assert list(modes(text)[f"s_{name}"]["modes"]) == ["__DEFAULT__", name]
    assert f"s_{name}.{name}" in changes(text, tmp_path)


def test_components_of_robots_and_modes_with_dots_have_names_that_system_modes_takes(tmp_path: Path) -> None:
    text = skill(
        realization(components="Component left.motor { Configuration active.A.B { p: 1 } }"),
        realization("x", "Component left/motor { Configuration active.A_B { p: 2 } }"),
    ).replace("left/motor", "left.motor")
    found = modes(text)
    assert list(found["left/motor"]["modes"]) == ["__DEFAULT__", "A_B", "A_B_2"]
    first, _ = changes(text, tmp_path)["move.go"]
    assert (first["component"], first["parameters"]) == ("left.motor", {"p": 1})


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("true", True),
        ("1", 1),
        ("1.0", 1.0),
        ("1e-7", 1e-7),
        ("-2.5e30", -2.5e30),
        ('"yes"', "yes"),
        ('"a: b # c"', "a: b # c"),
        ('"\\n\\t\\\\\\""', '\n\t\\"'),
        ('"\u2028\U0001f600\x7f"', "\u2028\U0001f600\x7f"),
        ('""', ""),
    ],
)
def test_values_come_back_with_their_types(written: str, value: object, tmp_path: Path) -> None:
    text = GOOD.replace("motor active", f"motor {{ Configuration active {{ a.p: {written} }} }}")
    found = modes(text)["motor"]["modes"]["__DEFAULT__"]["ros__parameters"]["a.p"]
    assert (found, type(found)) == (value, type(value))
    parameters, _ = changes(text, tmp_path)["move.go"]
    assert parameters["parameters"] == {"a.p": value}


def test_observed_components_are_words_of_one_scalar() -> None:
    text = skill(
        realization("a", "Component m observable active, Component n active"),
        realization("b", "Component m inactive, Component k observable active"),
    )
    found = yaml.safe_load(observed_components(checked(text).skills))
    assert found == {"modes_observer": {"ros__parameters": {"components": "m k"}}}
    assert "\n      m\n      k\n" in observed_components(checked(text).skills)
    nothing = yaml.safe_load(observed_components(checked(GOOD).skills))
    assert nothing == {"modes_observer": {"ros__parameters": {"components": ""}}}
