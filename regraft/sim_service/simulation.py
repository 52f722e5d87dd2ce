"""A world with its robots: physics, devices, and the people who walk there."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from regraft.component.parameters import ParameterSet, limited
from regraft.planar import Pose2D
from regraft.sim_service.cameras.camera import RenderState
from regraft.sim_service.cameras.room_lamps import check_level
from regraft.sim_service.devices.core.calling import Calls, call
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.device_kit import DeviceKit, DeviceParameters, Progress
from regraft.sim_service.devices.core.fitting import Fitted, fitted
from regraft.sim_service.layout.placement import Placement, check_apart, draw_placement
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.people.walkers import Person, Walker
from regraft.sim_service.simulated_robot import SimulatedRobot
from regraft.sim_service.stability import StabilityCheck

SNAPSHOT_VERSION = 5


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """The periods (s) of a simulation's loop, and who walks in its world."""

    tick: float = 0.05
    """Period of the world tick, at which devices sense."""
    control_period: float = 0.01
    """How often commands reach the actuators and contacts are looked for; a whole number of physics steps."""
    people: tuple[Person, ...] = ()
    """The people who walk in the world, which has a body for each."""


def own_parameters(device: Fitted) -> DeviceParameters:
    """Return the parameters of a device in a simulation without a bus: those of the robot's file, and defaults."""
    values = ParameterSet(limited(device.declared.parameters, device.spec.parameters))
    values.set(device.spec.parameters, starting=True)
    return DeviceParameters(values.values)


class SnapshotError(ValueError):
    """A snapshot does not fit this world or this version."""


class Simulation:
    """A world with its robots, advanced on demand.

    Equal scene, seed, settings and calls give equal results, bit by bit. Not thread-safe.

    Args:
        scene: the world with its robots, see `load_scene`.
        seed: of the placement and of every sensor's noise.
        settings: periods, and who walks where.
        placement: where things stand; drawn from the seed if left out.
        parameters: what gives the parameters of each device; those of the robots' files if left out.

    Raises:
        SceneError: the world lacks an element that a device names, or a person that the settings send on a walk.
        PlacementError: no placement satisfies the world's rules, or two robots stand in one place.
        ParameterError: a robot's devices do not fit their classes.
        DeviceError: a device cannot be built.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        settings: SimulationSettings | None = None,
        placement: Placement | None = None,
        parameters: Callable[[Fitted], DeviceParameters] = own_parameters,
    ) -> None:
        self._scene = scene
        self._parameters = parameters
        self._fitted = fitted(scene.robots)
        self._settings = settings or SimulationSettings()
        self._seed = seed
        self._placement = draw_placement(scene, seed) if placement is None else placement
        self._light = 1.0
        self._begin()

    @property
    def scene(self) -> Scene:
        """The world as loaded, before placement."""
        return self._scene

    @property
    def seed(self) -> int:
        """Seed of the placement and of every sensor's noise."""
        return self._seed

    @property
    def settings(self) -> SimulationSettings:
        """The settings it was built with."""
        return self._settings

    @property
    def placement(self) -> Placement:
        """Where the placed bodies stand; a camera in another process needs it."""
        return self._placement

    @property
    def time(self) -> float:
        """Simulated time (s) since the start."""
        return self.progress.time

    def advance(self, seconds: float, calls: Calls | None = None) -> None:
        """Let simulated time pass, all of it also if a device raises: ``calls`` has that then.

        Raises:
            DeviceError, DeviceErrors: devices raise, and there are no ``calls``.
            ValueError: seconds is negative or not a whole number of physics steps.
            UnstablePhysics: a number makes no sense. There is no way on, except by `restore`.
        """
        through = Calls() if calls is None else calls
        progress = self.progress
        remaining = self._whole_steps(seconds)
        while remaining > 0:
            steps = min(
                remaining,
                self._steps_per_control - progress.steps % self._steps_per_control,
                progress.steps_per_tick - progress.steps % progress.steps_per_tick,
            )
            for device in self._acting:
                through.call(device, device.act)
            if self._walkers:
                poses = self._robot_poses()
                for walker in self._walkers:
                    walker.move(self._data, steps * progress.timestep, poses)
            for _ in range(steps):
                mujoco.mj_step(self._model, self._data)
                self._stability.check()
            progress.steps += steps
            remaining -= steps
            self._after_control_period(through)
        mujoco.mj_kinematics(self._model, self._data)
        if calls is None:
            through.raise_all()

    def _after_control_period(self, calls: Calls) -> None:
        progress = self.progress
        touching = self._data.contact.geom.tolist()
        for robot in self.robots.values():
            robot.contacts.update(touching, progress.time)
        for device in self._watching:
            calls.call(device, device.watch)
        if progress.steps % progress.steps_per_tick == 0:
            for device in self._ticking:
                calls.call(device, device.tick)

    def set_light(self, level: float) -> None:
        """Set the lamps to a level between 0 (dark) and 1 (full)."""
        self._light = check_level(level)

    @property
    def present(self) -> frozenset[str]:
        """The groups of people that are present."""
        return frozenset(walker.group for walker in self._walkers if walker.group and walker.is_present)

    def set_present(self, group: str, present: bool) -> None:
        """Have all people of a group come or go; they come where no robot is near, while time passes."""
        for walker in self._walkers:
            if walker.group == group:
                walker.set_present(self._data, present)
        mujoco.mj_kinematics(self._model, self._data)

    def robot(self, name: str = "") -> SimulatedRobot:
        """Return a robot; raises KeyError for an unknown name."""
        return self.robots[name]

    def render_state(self, calls: Calls | None = None) -> RenderState:
        """Everything that a camera needs to draw this moment, except the world file and the placement.

        Devices whose colours raise do not shine, and ``calls`` has that; raises like `advance`.
        """
        through = Calls() if calls is None else calls
        shining = [through.call(device, device.colours) or {} for device in self._shining]
        colours = {geom: colour for of_device in shining for geom, colour in of_device.items()}
        if calls is None:
            through.raise_all()
        return RenderState(self._data.qpos.copy(), self._light, self.progress.steps, colours)

    def snapshot(self) -> dict[str, Any]:
        """Return everything needed to continue, as plain values and bytes that MessagePack can carry."""
        return {
            "version": SNAPSHOT_VERSION,
            "world": self._scene.fingerprint,
            "seed": self._seed,
            "placement": self._placement.to_plain(),
            "steps": self.progress.steps,
            "light": self._light,
            "physics": self._physics_state().astype("<f8").tobytes(),
            "robots": {name: robot.snapshot() for name, robot in self.robots.items()},
            "people": [walker.snapshot() for walker in self._walkers],
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Continue from a snapshot taken by any simulation of the same world with the same settings.

        Raises:
            SnapshotError: the snapshot is of another version or another world.
        """
        if snapshot.get("version") != SNAPSHOT_VERSION:
            raise SnapshotError(f"snapshot version {snapshot.get('version')!r}, expected {SNAPSHOT_VERSION}")
        if snapshot["world"] != self._scene.fingerprint:
            raise SnapshotError(f"the snapshot was taken in another world than {self._scene.path}")
        self._seed = int(snapshot["seed"])
        self._placement = Placement.from_plain(snapshot["placement"])
        self._begin()
        self.progress.steps = int(snapshot["steps"])
        self._light = float(snapshot["light"])
        physics = np.frombuffer(snapshot["physics"], dtype="<f8").astype(np.float64)
        mujoco.mj_setState(self._model, self._data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_kinematics(self._model, self._data)
        for name, robot in self.robots.items():
            robot.restore(snapshot["robots"][name])
        for walker, walked in zip(self._walkers, snapshot["people"], strict=True):
            walker.restore(walked)

    def digest(self) -> str:
        """Return a SHA-256 over physics and light: equal for equal runs."""
        values = struct.pack("<2d", self._light, float(self.progress.steps))
        return hashlib.sha256(self._physics_state().tobytes() + values).hexdigest()

    def _begin(self) -> None:
        settings = self._settings
        self._model = self._scene.new_model()
        self._data = mujoco.MjData(self._model)
        self._stability = StabilityCheck(self._scene, self._model, self._data)
        self._placement.apply(self._scene, self._model, self._data.qpos)
        mujoco.mj_kinematics(self._model, self._data)
        self.progress = Progress(float(self._model.opt.timestep), 1)
        self._steps_per_control = max(1, self._whole_steps(settings.control_period))
        self.progress.steps_per_tick = max(1, self._whole_steps(settings.tick))
        self.robots = {spec.name: SimulatedRobot(self._scene, self._data, spec) for spec in self._scene.robots}
        check_apart(self._scene, self._data)
        self._walkers = [Walker(self._scene, person) for person in settings.people]
        for walker in self._walkers:
            walker.begin(self._data, self._robot_poses())
        if self._walkers:
            mujoco.mj_kinematics(self._model, self._data)
        devices = [self._built(device) for device in self._fitted]
        self._acting = [device for device in devices if type(device).act is not Device.act]
        self._watching = [device for device in devices if type(device).watch is not Device.watch]
        self._ticking = [device for device in devices if type(device).tick is not Device.tick]
        self._shining = [device for device in devices if type(device).colours is not Device.colours]

    def _built(self, device: Fitted) -> Device:
        robot = self.robots[device.robot.name]
        built = device.cls()
        built.kit = DeviceKit(
            device.spec.name,
            device.robot,
            self._scene,
            self._model,
            self._data,
            self._seed,
            self.progress,
            self._parameters(device),
            robot.base,
            robot.devices,
            lambda: {other.spec.name: other.devices for other in self.robots.values() if other is not robot},
            lambda: self._light,
        )
        call(built, built.build)
        robot.devices[device.spec.name] = built
        return built

    def _robot_poses(self) -> Sequence[Pose2D]:
        return [robot.pose() for robot in self.robots.values()]

    def _whole_steps(self, seconds: float) -> int:
        timestep = self.progress.timestep
        steps = round(seconds / timestep)
        if steps < 0 or abs(steps * timestep - seconds) > 1e-9:
            raise ValueError(f"{seconds} s is not a whole number of physics steps of {timestep} s")
        return steps

    def _physics_state(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        spec = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(self._model, spec))
        mujoco.mj_getState(self._model, self._data, state, spec)
        return state
