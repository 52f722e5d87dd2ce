"""Cameras where there is no OpenGL."""

from __future__ import annotations

from pathlib import Path

from tests.support.commands import run
from tests.support.machine.renderers import without_opengl
from tests.support.paths import FROG

STACK = f"""\
system: cameras
clock: simulated
speed: max
world: {FROG}/world.xml
robot: {{robot: waffle}}
topics:
  world_state: {{type: regraft/WorldState, rate: 20}}
  camera/image: {{type: regraft/Image, rate: 5, sensor_stream: true}}
  corner_camera/image: {{type: regraft/Image, rate: 5, sensor_stream: true}}
components:
  world:
    class: regraft.sim_service.world:World
    parameters: {{file: $world, robots: $robots}}
  camera:
    class: regraft.sim_service.camera_component:Camera
    parameters: {{file: $world, robots: $robots, camera: camera}}
    connect: {{image: camera/image}}
  corner_camera:
    class: regraft.sim_service.camera_component:Camera
    parameters: {{file: $world, robots: $robots, camera: corner_camera}}
    connect: {{image: corner_camera/image}}
"""


def test_all_cameras_together_say_once_what_to_install_and_cast_rays(tmp_path: Path) -> None:
    (tmp_path / "stack.yaml").write_text(STACK)
    environment = {**without_opengl(tmp_path / "none"), "REGRAFT_HOME": str(tmp_path / "home")}
    done = run("up", str(tmp_path), "--headless", "--for", "0.5", environment=environment, fresh=True)
    assert done.returncode == 0, done.stderr
    told = done.stdout + done.stderr
    assert told.count("no OpenGL here (libEGL.so.1 and libOSMesa.so.8 cannot be loaded)") == 1
    assert told.count("apt-get install libegl1") == 1
    assert "NoneType" not in told
    assert "renderer ray" in told.splitlines()[-1]
