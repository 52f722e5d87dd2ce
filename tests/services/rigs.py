"""What the tests of components share: a simulated world on a rig, moved on tick by tick."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import ControlError, ParameterValues, Rewire, RewireStep
from regraft.bus_schema.messages.sensors import Image
from regraft.component.goal import Goal
from regraft.planar import Pose2D
from regraft.sim_service.cameras.camera import CameraSettings, RenderState, SensorNoise
from regraft.sim_service.cameras.camera_mount import camera_mount
from regraft.sim_service.cameras.renderers import RendererName, make_camera
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.support.paths import ROOT
from tests.support.worlds import FROG_WORLD, frog_scene

FROG = str(ROOT / "regraft" / "stacks" / "frog" / "world.xml")
TICK = 0.05
SIZES = {"ray": (160, 120), "egl": (320, 240), "osmesa": (320, 240)}


def world_on(rig: Rig, **parameters: object) -> World:
    """Add FROG's world to a rig."""
    return rig.add(World, parameters={**FROG_WORLD, **parameters})


def run(rig: Rig, world: World, seconds: float) -> None:
    """Let time pass as the source of simulated time does: the clock, the world, then everybody else."""
    for _ in range(round(seconds / TICK)):
        rig.clock.advance_to(rig.clock.now() + round(TICK * 1e9))
        world.advance(world.ticks, TICK)
        rig.settle()


def run_until(rig: Rig, world: World, done: Callable[[], bool], within: float) -> None:
    """Let time pass until something is done, for some seconds at the most."""
    end = rig.clock.now() + round(within * 1e9)
    while not done() and rig.clock.now() < end:
        run(rig, world, TICK)


def finish(rig: Rig, world: World, goal: Goal[Any, Any], within: float = 120.0) -> Goal[Any, Any]:
    """Let time pass until a goal has ended."""
    run_until(rig, world, lambda: goal.done, within)
    assert goal.done
    return goal


def set_parameters(rig: Rig, component: str, **values: object) -> None:
    """Set parameters as the adaptation manager does."""
    assert not why_refused(rig, component, **values)


def why_refused(rig: Rig, component: str, **values: object) -> str:
    """Set parameters as the adaptation manager does, and return why they are refused; empty if they are set."""
    return _why_refused(rig, component, "parameters", ParameterValues(values))


def disconnect(rig: Rig, component: str, port: str) -> None:
    """Leave a port without a topic, as the adaptation manager does."""
    assert not _why_refused(rig, component, "connections", Rewire(RewireStep.DISCONNECT, port))


def connect(rig: Rig, component: str, port: str, topic: str) -> None:
    """Connect an input to a topic, as the adaptation manager does."""
    for step in (RewireStep.OPEN, RewireStep.SWITCH):
        assert not _why_refused(rig, component, "connections", Rewire(step, port, topic))


def _why_refused(rig: Rig, component: str, what: str, message: object) -> str:
    answers: list[Any] = []
    rig.bus.ask(rig.keys.control(component, 1, what), codec.encode(message), 5.0, answers.extend)
    while not answers:
        rig.settle()
    (answer,) = answers
    return "; ".join(codec.decode(answer.payload, ControlError).problems) if answer.error else ""


class Studio:
    """Takes pictures of FROG's objects, placed at will, as the cameras of the world do."""

    def __init__(self, renderer: RendererName, camera: str = "camera", **poses: Pose2D) -> None:
        """Place the objects; those that are not named stand in the corners, out of the way."""
        corners = {
            "hydrant": Pose2D(1.9, 2.0, 0.0),
            "red_box": Pose2D(1.9, -1.9, 0.0),
            "orange_ball": Pose2D(-1.9, 2.0, 0.0),
            "base": Pose2D(0.0, 0.0, 0.0),
        }
        self.scene = frog_scene()
        self.placement = Placement({**corners, **poses})
        self.camera = camera
        self.size = SIZES[renderer]
        self.mount = camera_mount(self.scene, self.placement, camera)
        settings = CameraSettings(camera, *self.size, camera == "corner_camera", SensorNoise(), 1)
        self._eye = make_camera(renderer, self.scene, self.placement, settings)
        self._qpos = self.scene.model.qpos0.copy()
        self.placement.apply(self.scene, self.scene.new_model(), self._qpos)
        self._taken = 0

    def put_robot(self, x: float, y: float, yaw: float) -> None:
        """Put the robot, and so its camera, somewhere."""
        first = self.scene.free_joint_position("base")
        self._qpos[first : first + 2] = (x, y)
        self._qpos[first + 3 : first + 7] = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))

    def picture(self, light: float = 1.0, stamp: float = 0.0) -> Image:
        """Take a picture; each has its own noise."""
        self._taken += 1
        pixels = self._eye.render(RenderState(np.array(self._qpos), light, self._taken))
        opening = self.mount.horizontal_field_of_view(*self.size)
        return Image(stamp, f"{self.camera}_optical", self.mount.frame, self.mount.pose, opening, pixels)

    def close(self) -> None:
        """Give the renderer back."""
        self._eye.close()
