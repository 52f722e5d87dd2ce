"""A real stack that reflects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.machine.ports import free_port
from tests.support.systems import System, home

STACK = """\
system: tests
topics:
  odometry: {{type: regraft/Odometry, rate: 20}}
  other_odometry: {{type: regraft/Odometry, rate: 20}}
  battery: {{type: regraft/BatteryState, rate: 20}}
  light: {{type: regraft/LightLevel, rate: 20}}
  reflection: regraft/ReflectedEntries
  mission: {{type: regraft/MissionStatus, rate: 1}}
  architecture: regraft/Architecture
  adaptations: regraft/AdaptationReport
components:
  wheels: {{class: "tests.reflection.parts:Wheels"}}
  other_wheels:
    class: tests.reflection.parts:Wheels
    parameters: {{speed: 0.5}}
    connect: {{odometry: other_odometry}}
  battery:
    class: tests.reflection.parts:Battery
    restart: never
  lamp: {{class: "tests.reflection.parts:Lamp"}}
  system_reflection:
    class: regraft.services.system_reflection:SystemReflection
    parameters:
      mapping:
        - {{topic: odometry, field: twist.linear.x, entry: speed, rate: 10}}
        - {{topic: battery, field: charge, entry: charge, rate: 10, stale_after: 0.5}}
  bt_executor:
    class: regraft.services.bt_executor.executor:Executor
    parameters: {{mission: mission.xml}}
  adaptation_manager: {{class: "regraft.adaptation_manager.manager:AdaptationManager"}}
  gateway:
    class: regraft.dashboard_api.gateway:Gateway
    parameters: {{port: {port}}}
"""
MISSION = """\
<root BTCPP_format="4"><BehaviorTree ID="Main"><Sleep msec="1000000"/></BehaviorTree></root>
"""


@pytest.fixture
def system(tmp_path: Path) -> Iterator[System]:
    """Return a running system of its own."""
    folder = tmp_path / "stack"
    folder.mkdir()
    (folder / "stack.yaml").write_text(STACK.format(port=free_port()))
    (folder / "mission.xml").write_text(MISSION)
    with home(tmp_path / "home"):
        running = System(folder, log=tmp_path / "up.log")
        yield running
        running.end()
