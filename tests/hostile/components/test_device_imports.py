"""Modules of robots' devices whose import does what it likes: they are tried before a command imports them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.components.test_imports import HOSTILE, command, refused
from tests.support.paths import ROOT

pytestmark = pytest.mark.slow

STACK = """\
system: tests
clock: simulated
world: room.xml
robots: {left: rover, right: rover}
topics: {world_state: {type: regraft/WorldState}}
components:
  world: {class: "regraft.sim_service.world:World", parameters: {file: $world, robots: $robots}}
  again: {class: "regraft.sim_service.world:World", parameters: {file: $world, robots: $robots}}
"""
ROBOT = """\
model: rover.xml
radius: 0.1
devices: {sensor: {class: "hostile_device:Sensor"}}
"""


@pytest.mark.parametrize("what", ["ends the process", "exits", "crashes", "leaves a thread", "raises its own"])
def test_a_devices_module_that_does_what_no_import_may_is_refused_in_one_line(tmp_path: Path, what: str) -> None:
    text, why = HOSTILE[what]
    rover = tmp_path / "rover"
    rover.mkdir()
    (tmp_path / "stack.yaml").write_text(STACK)
    (rover / "robot.yaml").write_text(ROBOT)
    (rover / "hostile_device.py").write_text(text)
    for model in (tmp_path / "room.xml", rover / "rover.xml"):
        model.write_text("<mujoco/>")
    done = command(tmp_path, "up", ".", "--headless")
    refused(done, f"importing 'hostile_device' {why}")
    (line,) = done.stderr.splitlines()
    assert line.startswith("regraft: rover/robot.yaml:3: "), line
    assert str(ROOT) not in line
