"""A topic's type that is not known, or is no message type, is told with the type that may be meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.encoding.topic_types import PROTOCOL, know_schema
from regraft.bus_schema.suggestions import near
from regraft.process.main import NoSuchClass, load_class
from regraft.stack import load
from tests.stack.reading.files import problems, write

STACK = """\
system: tests
topics: {{light: regraft/LightLevel, other: '{kind}'}}
components: {{lighting: {{class: 'regraft.services.lighting:Lighting'}}}}
"""
ON_TOPICS = (
    "AdaptationReport",
    "Architecture",
    "LaserScan",
    "MissionStatus",
    "ReflectedEntries",
    "SystemStatus",
    "Twist",
)


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("regraft/Twits", "regraft/Twist"),
        ("regraft/twist", "regraft/Twist"),
        ("regrft/Twist", "regraft/Twist"),
        ("Twist", "regraft/Twist"),
        ("regraft.bus_schema.messages.geometry:Twist", "regraft/Twist"),
        ("regraft.bus_schema.messages.geometry.Twist", "regraft/Twist"),
    ],
)
def test_a_type_that_is_not_known_is_told_with_the_one_that_is_meant(tmp_path: Path, given: str, meant: str) -> None:
    (problem,) = problems(tmp_path, STACK.format(kind=given))
    assert (problem.line, problem.field) == (2, "topics.other")
    assert problem.problem == f"no message type {given!r} is known here; did you mean {meant!r}?"


def test_a_shared_package_makes_no_name_near(tmp_path: Path) -> None:
    assert near("regraft/Twist", ["regraft/JoinHost"]) is None
    assert near("robot.left_wheel", ["robot.lidar"]) is None
    (problem,) = problems(tmp_path, STACK.format(kind="regraft/Zebra"))
    assert "did you mean" not in problem.problem


def test_types_that_only_hosts_and_the_clock_exchange_are_not_suggested(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, STACK.format(kind="regraft/JoinHosts"))
    assert "JoinHost'?" not in problem.problem


def test_a_class_is_no_type_of_a_topic(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, STACK.format(kind="regraft.services.battery:Battery"))
    assert problem.problem.endswith("a topic has a message type such as 'regraft/Twist', no class")


def test_a_message_type_is_no_class_of_a_component() -> None:
    with pytest.raises(NoSuchClass, match=r"must look like 'package\.module:Class'; message types belong to topics"):
        load_class("regraft/Twist")
    with pytest.raises(NoSuchClass, match="it is the message type 'regraft/Twist', which belongs to topics"):
        load_class("regraft.bus_schema.messages.geometry:Twist")


def test_types_of_the_schema_are_known_whatever_has_been_imported(tmp_path: Path) -> None:
    assert "other" in load(write(tmp_path, STACK.format(kind="regraft/RunSummary"))).architecture.topics


@pytest.mark.parametrize("name", ON_TOPICS)
def test_types_that_the_platform_puts_on_topics_are_suggested(name: str) -> None:
    know_schema()
    assert type_named(f"regraft/{name}").cls.__module__ not in PROTOCOL
