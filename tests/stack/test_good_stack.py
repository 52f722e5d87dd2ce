"""A good stack file gives the architecture that it describes."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.encoding.codec import decode, encode
from regraft.bus_schema.model.architecture import (
    Architecture,
    Constraint,
    ConstraintKind,
    Restart,
    RestartPolicy,
    TopicSpec,
    Writers,
)
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State
from regraft.stack import load, time_source
from tests.stack.reading.files import GOOD, changed, good, write


def test_head_of_the_file_is_read(tmp_path: Path) -> None:
    stack = good(tmp_path)
    assert (stack.name, stack.clock, stack.seed, stack.speed) == ("frog", "simulated", 1, "max")
    assert stack.duration == 120.0
    assert stack.folder == tmp_path
    assert time_source(stack) == "world"


def test_topics_are_read_with_type_rate_and_reliability(tmp_path: Path) -> None:
    assert good(tmp_path).architecture.topics == {
        "odometry": TopicSpec("odometry", "regraft/Odometry", True, 20.0),
        "scan": TopicSpec("scan", "regraft/LaserScan", False, 5.0),
        "velocity": TopicSpec("velocity", "regraft/Twist", True, None, Writers.ONE),
        "truth": TopicSpec("truth", "regraft/Odometry"),
    }


def test_component_is_read_with_every_port_and_service(tmp_path: Path) -> None:
    navigator = good(tmp_path).architecture.components["rescuer.navigator"]
    assert navigator.cls == "tests.stack.parts:Navigator"
    assert navigator.parameters == {"max_velocity": 0.2, "gains": [1, 2.5]}
    assert navigator.connections == {"odometry": "odometry", "scan": "scan", "velocity": "velocity"}
    assert navigator.services == {"navigate_to": "rescuer/navigate_to"}
    assert navigator.state is State.ACTIVE
    assert navigator.restart == RestartPolicy(Restart.ON_FAILURE, limit=3)
    assert navigator.description is not None


def test_optional_input_without_a_topic_stays_unconnected(tmp_path: Path) -> None:
    navigator = good(tmp_path).architecture.components["rescuer.navigator"]
    assert "smell" not in navigator.connections


def test_a_port_can_be_connected_to_no_topic(tmp_path: Path) -> None:
    smelling = ("  truth: regraft/Odometry\n", "  smell: stacktest/Smell\n")
    text = changed(smelling, ("      odometry: odometry\n", "      odometry: odometry\n      smell: null\n"))
    stack = load(write(tmp_path, text))
    assert stack.architecture.components["rescuer.navigator"].connections["smell"] is None
    assert violations(stack.architecture) == ()
    (tmp_path / "over.yaml").write_text(
        "include: [stack.yaml]\ncomponents: {rescuer.navigator: {connect: {smell: smell}}}\n"
    )
    (tmp_path / "again.yaml").write_text(
        "include: [over.yaml]\ncomponents: {rescuer.navigator: {connect: {smell: null}}}\n"
    )
    for name, topic in (("over", "smell"), ("again", None)):
        again = load(tmp_path / f"{name}.yaml")
        assert again.architecture.components["rescuer.navigator"].connections["smell"] == topic


def test_optional_input_whose_topic_exists_is_connected(tmp_path: Path) -> None:
    text = changed(("  truth: regraft/Odometry\n", "  smell: stacktest/Smell\n"))
    navigator = load(write(tmp_path, text)).architecture.components["rescuer.navigator"]
    assert navigator.connections["smell"] == "smell"


def test_program_is_described_by_what_the_file_states(tmp_path: Path) -> None:
    recorder = good(tmp_path).architecture.components["recorder"]
    assert recorder.command == ("python", "-m", "recorder")
    assert (recorder.cls, recorder.managed, recorder.state) == ("", False, State.INACTIVE)
    assert recorder.restart == RestartPolicy(Restart.NEVER)
    assert recorder.description is not None
    assert [(port.name, port.direction, port.type) for port in recorder.description.ports] == [
        ("scan", "input", "regraft/LaserScan")
    ]
    assert recorder.connections == {"scan": "scan"}
    assert recorder.parameters == {"depth": 3, "folder": "runs"}


def test_path_parameter_is_looked_for_beside_the_stack_file(tmp_path: Path) -> None:
    world = good(tmp_path).architecture.components["world"]
    assert world.parameters["file"] == str(tmp_path / "world.xml")


def test_absolute_path_parameter_stays(tmp_path: Path) -> None:
    stack = load(write(tmp_path, changed(("file: world.xml", "file: /srv/world.xml"))))
    assert stack.architecture.components["world"].parameters["file"] == "/srv/world.xml"


def test_constraints_are_read(tmp_path: Path) -> None:
    assert good(tmp_path).architecture.constraints == (
        Constraint(
            ConstraintKind.AT_LEAST_ONE_ACTIVE,
            components=("world", "rescuer.navigator"),
            because="somebody must work",
        ),
        Constraint(ConstraintKind.PARAMETER, parameter="rescuer.navigator.max_velocity", maximum=0.26),
    )


def test_architecture_is_consistent_and_can_travel(tmp_path: Path) -> None:
    architecture = good(tmp_path).architecture
    assert violations(architecture) == ()
    assert decode(encode(architecture), Architecture).topics == architecture.topics


def test_lines_of_all_fields_are_known(tmp_path: Path) -> None:
    stack = good(tmp_path)
    for field, piece in (("seed", "seed: 1"), ("components.world.class", "class: tests.stack.parts:World")):
        assert piece in GOOD.splitlines()[(stack.locations[field].line or 0) - 1]


def test_hosts_are_the_local_one_and_those_named(tmp_path: Path) -> None:
    stack = load(
        write(
            tmp_path,
            changed(
                ("seed: 1\n", "seed: 1\nhosts: [arm]\n"),
                ("class: tests.stack.parts:Navigator", "host: arm\n    class: tests.stack.parts:Navigator"),
            ),
        )
    )
    assert stack.architecture.hosts == ("local", "arm")
    assert {spec.name for spec in stack.architecture.components.values() if spec.host == "arm"} == {"rescuer.navigator"}


def test_imports_make_message_types_known(tmp_path: Path) -> None:
    (tmp_path / "stack_own_types.py").write_text(
        "from dataclasses import dataclass\n"
        "from regraft.bus_schema.encoding.registry import message\n"
        "@message('stacktest/Taste')\n"
        "@dataclass(frozen=True, slots=True)\n"
        "class Taste:\n"
        "    'Taste.'\n"
        "    sweet: float\n"
    )
    text = changed(
        ("seed: 1\n", "seed: 1\nimports: [stack_own_types]\n"),
        ("truth: regraft/Odometry", "truth: stacktest/Taste"),
    )
    assert load(write(tmp_path, text)).architecture.topics["truth"].type == "stacktest/Taste"


def test_classes_beside_the_stack_file_are_found(tmp_path: Path) -> None:
    (tmp_path / "stack_own_parts.py").write_text(
        "from regraft import Component\nclass Horn(Component):\n    'Toots.'\n"
    )
    text = "system: own\ncomponents:\n  horn: {class: 'stack_own_parts:Horn'}\n"
    assert load(write(tmp_path, text)).architecture.components["horn"].description is not None


@pytest.mark.parametrize(("written", "meant"), [("1e-1", 0.1), ("0x0", 0), (".2", 0.2), ("+0.1", 0.1)])
def test_numbers_are_read_as_people_write_them(tmp_path: Path, written: str, meant: float) -> None:
    stack = load(write(tmp_path, changed(("max_velocity: 0.2\n", f"max_velocity: {written}\n"))))
    assert stack.architecture.components["rescuer.navigator"].parameters["max_velocity"] == meant


def test_an_alias_repeats_a_value(tmp_path: Path) -> None:
    text = changed(("limit: 3}", "limit: &times 3}"), ("restart: never", "restart: {limit: *times}"))
    assert load(write(tmp_path, text)).architecture.components["recorder"].restart.limit == 3
