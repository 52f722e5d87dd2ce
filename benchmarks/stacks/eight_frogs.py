"""Eight Waffles, each in a room of its own in one world, each with FROG's parts and a mission."""

from __future__ import annotations

import shutil
from pathlib import Path

import yaml

from benchmarks.sides.system import ROOT

DEMO = ROOT / "regraft" / "stacks" / "demo_two_robots"
COUNT = 8
WIDE, LONG = 2.4, 5.0
"""Inside of a room, in m."""
ACROSS = 4
"""Rooms in a row."""
CRATES = ((0.0, 1.7), (-0.6, -1.7), (0.7, -0.2))

_SPARE_CAMERA = {
    "class": "regraft.sim_service.camera_component:Camera",
    "parameters": {"file": "$world", "robots": "$robots", "robot": "$robot", "renderer": "ray"},
    "connect": {"image": "spare/image", "world_state": "/world_state"},
}


def written(folder: Path) -> Path:
    """Write the stack into a folder, and return its file."""
    for name in ("patrol.xml", "patrol.yaml", "small_waffle.xml", "small_waffle.yaml"):
        shutil.copy(DEMO / name, folder / name)
    (folder / "patrol.yaml").write_text(
        (folder / "patrol.yaml").read_text().replace("../../robots/waffle/", f"{ROOT}/regraft/robots/waffle/")
    )
    (folder / "world.xml").write_text(_world())
    stack = folder / "stack.yaml"
    stack.write_text(yaml.safe_dump(_stack(), sort_keys=False))
    return stack


def _middle(number: int) -> tuple[float, float]:
    """Return the middle of a room."""
    return (number % ACROSS) * (WIDE + 0.3), (number // ACROSS) * (LONG + 0.3)


def _world() -> str:
    tuples, bodies = [], []
    for number in range(COUNT):
        crates = [f"crate_{number}_{place}" for place in range(len(CRATES))]
        elements = "".join(f'<element objtype="body" objname="{crate}"/>' for crate in crates)
        tuples.append(f'<tuple name="goals_{number}">{elements}</tuple>')
        bodies.append(_room(number, *_middle(number)))
    return f"""<mujoco model="eight_frogs">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast" jacobian="dense" cone="pyramidal" impratio="1"/>
  <custom>{"".join(tuples)}</custom>
  <worldbody>
    <light name="lamp" pos="4 2.5 6" dir="0 0 -1"/>
    <geom name="floor" type="plane" size="20 20 .1"/>
    {"".join(bodies)}
  </worldbody>
</mujoco>
"""


def _room(number: int, x: float, y: float) -> str:
    walls = (
        (-WIDE / 2 - 0.05, 0.0, 0.05, LONG / 2 + 0.1),
        (WIDE / 2 + 0.05, 0.0, 0.05, LONG / 2 + 0.1),
        (0.0, -LONG / 2 - 0.05, WIDE / 2, 0.05),
        (0.0, LONG / 2 + 0.05, WIDE / 2, 0.05),
    )
    geoms = "".join(f'<geom type="box" pos="{dx} {dy} .25" size="{sx} {sy} .25"/>' for dx, dy, sx, sy in walls)
    crates = "".join(
        f'<body name="crate_{number}_{place}" pos="{x + dx} {y + dy} 0">'
        '<geom type="box" pos="0 0 .1" size=".12 .12 .1"/></body>'
        for place, (dx, dy) in enumerate(CRATES)
    )
    return f'<body name="walls_{number}" pos="{x} {y} 0">{geoms}</body>{crates}'


def _stack() -> dict[str, object]:
    robots = {}
    for number in range(COUNT):
        x, y = _middle(number)
        robots[f"robot_{number}"] = {
            "robot": "small_waffle.yaml",
            "parameters": {"goals": f"goals_{number}"},
            "place": {"x": x, "y": y},
            "topics": {
                "light": {"type": "regraft/LightLevel", "rate": 2},
                "sensor_health": {"type": "regraft/SensorHealth"},
                "spare/image": {"type": "regraft/Image", "rate": 2, "sensor_stream": True},
            },
            "components": {
                "camera": {"parameters": {"renderer": "ray"}},
                "spare_camera": _SPARE_CAMERA,
                "lighting": {"class": "regraft.services.lighting:Lighting"},
                "sensor_monitor": {"class": "regraft.services.sensor_monitor:SensorMonitor"},
            },
        }
    return {
        "system": "eight_frogs",
        "clock": "simulated",
        "seed": 1,
        "world": "world.xml",
        "robots": robots,
        "topics": {
            "world_state": {"type": "regraft/WorldState", "rate": 20},
            "system_status": {"type": "regraft/SystemStatus", "rate": 1},
            "adaptations": {"type": "regraft/AdaptationReport"},
            "architecture": {"type": "regraft/Architecture"},
        },
        "components": {
            "world": {
                "class": "regraft.sim_service.world:World",
                "parameters": {"file": "$world", "robots": "$robots"},
            },
            "adaptation_manager": {
                "class": "regraft.adaptation_manager.manager:AdaptationManager",
                "parameters": {"journal": "$RUN/journal.sqlite"},
            },
            "reflection": {"class": "regraft.services.system_status:SystemStatusReporter"},
            "gateway": {"class": "regraft.dashboard_api.gateway:Gateway", "parameters": {"port": 0}},
        },
    }
