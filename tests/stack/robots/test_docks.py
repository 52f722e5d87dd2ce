"""Devices of robots: each of several robots on one host may have a device of its own, such as its dock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.offers import HostOffer, offer_problems
from regraft.client.capability import capability
from regraft.stack import StackError, load
from tests.stack.reading.folders import write_all

ROBOT = """\
model: rover.xml
parameters: {max_velocity: 0.5, motion_power: [1.0], consumers: []}
topics: {battery: regraft/BatteryState, charger: regraft/ChargerState}
components:
  senses: {command: [senses], outputs: {battery: regraft/BatteryState, charger: regraft/ChargerState}}
  docking: {class: "regraft.services.charging.docking:Docking"}
"""


def two_robots(folder: Path, *devices: str) -> Architecture:
    """Load a stack of two robots on a host with these devices."""
    text = f"system: two\nhosts: {{local: {{devices: {list(devices)}}}}}\nrobots: {{left: rover, right: rover}}\n"
    file = write_all(folder, stack=text, rover_robot=ROBOT)
    (folder / "rover" / "rover.xml").write_text("<mujoco/>")
    return load(file).architecture


def holders(architecture: Architecture) -> dict[str, str | None]:
    """Return which component holds each device of the host."""
    return {line.name: line.holder for line in capability(architecture, "local").devices}


def test_two_robots_on_one_host_have_a_dock_each(tmp_path: Path) -> None:
    architecture = two_robots(tmp_path, "left/dock", "right/dock")
    assert holders(architecture) == {"left/dock": "left.docking", "right/dock": "right.docking"}


def test_a_robot_without_a_device_of_its_own_holds_the_one_of_all(tmp_path: Path) -> None:
    architecture = two_robots(tmp_path, "dock", "right/dock")
    assert holders(architecture) == {"dock": "left.docking", "right/dock": "right.docking"}


@pytest.mark.parametrize("devices", [["dock"], ["left/dock"]])
def test_a_device_of_all_or_of_another_robot_is_not_for_two(tmp_path: Path, devices: list[str]) -> None:
    with pytest.raises(StackError) as refused:
        two_robots(tmp_path, *devices)
    fields = {problem.field for problem in refused.value.problems}
    assert fields <= {"components.left.docking", "components.right.docking"}
    assert "components.right.docking" in fields


def test_a_host_that_joins_may_offer_a_robots_device(tmp_path: Path) -> None:
    architecture = two_robots(tmp_path, "left/dock", "right/dock")
    bare = replace(architecture, host_rules={})
    assert not list(offer_problems(bare, "local", HostOffer(devices=("left/dock", "right/dock"))))
    assert list(offer_problems(bare, "local", HostOffer(devices=("left/dock",))))
