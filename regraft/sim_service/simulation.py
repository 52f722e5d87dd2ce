"""One simulated robot in one world: physics, actuators and all sensors but the cameras."""

import hashlib
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.cameras.camera import RenderState
from regraft.sim_service.cameras.lights import check_level
from regraft.sim_service.layout.goals import ViewingGoal, viewing_goals
from regraft.sim_service.layout.ground_map import GroundMap, Rasteriser
from regraft.sim_service.layout.headings import yaw_of_matrix
from regraft.sim_service.layout.placement import Placement, draw_placement
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.layout.visitor import Visitor, Walk
from regraft.sim_service.robot.contacts import ContactEvent, ContactMonitor
from regraft.sim_service.robot.drive import DifferentialDrive, DriveSettings
from regraft.sim_service.robot.lidar import Lidar, LidarSettings, Scan
from regraft.sim_service.robot.odometry import NO_DRIFT, Drift, Odometry, OdometryReading, OdometrySettings

SNAPSHOT_VERSION = 2
DOCK = "dock"
"""The MJCF site that a charger stands at, in worlds that have one."""


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """The subject of a simulation: the robot's elements, its sensors and the periods (s) of the loop."""

    drive: DriveSettings = field(default_factory=DriveSettings)
    odometry: OdometrySettings = field(default_factory=OdometrySettings)
    lidar: LidarSettings = field(default_factory=LidarSettings)
    tick: float = 0.05
    """Period of the world tick, at which odometry is read."""
    control_period: float = 0.01
    """How often commands reach the wheels and contacts are looked for; a whole number of physics steps."""
    walk: Walk | None = None
    """Where the visitor walks, in a world that has one."""


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """The truth: time (s), pose of the robot's base in the map frame, twist in the base frame."""

    time: float
    pose: Pose2D
    twist: Twist2D


class SnapshotError(ValueError):
    """A snapshot does not fit this world or this version."""


class Simulation:
    """A robot in a world, advanced on demand.

    Equal scene, seed, settings and calls give equal results, bit by bit. Not thread-safe.

    Args:
        scene: the world, see `load_scene`.
        seed: of the placement and of every sensor's noise.
        settings: the robot's elements and sensors.
        placement: where things stand; drawn from the seed if left out.

    Raises:
        SceneError: the world lacks an element that the settings name, or the visitor that they send on a walk.
        PlacementError: no placement satisfies the world's rules.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        settings: SimulationSettings | None = None,
        placement: Placement | None = None,
    ) -> None:
        self._scene = scene
        self._settings = settings or SimulationSettings()
        self._seed = seed
        self._placement = draw_placement(scene, seed) if placement is None else placement
        self._light = 1.0
        self._steps = 0
        self._drift = NO_DRIFT
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
        return self._steps * self._timestep

    def advance(self, seconds: float) -> None:
        """Let simulated time pass.

        Raises:
            ValueError: seconds is negative or not a whole number of physics steps.
        """
        remaining = self._whole_steps(seconds)
        while remaining > 0:
            steps = min(
                remaining,
                self._steps_per_control - self._steps % self._steps_per_control,
                self._steps_per_tick - self._steps % self._steps_per_tick,
            )
            self._drive.apply(self._data, self.time)
            if self._visitor is not None:
                self._visitor.move(self._data, steps * self._timestep, self._robot_pose())
            mujoco.mj_step(self._model, self._data, nstep=steps)
            self._steps += steps
            remaining -= steps
            self._contacts.update(self._data, self.time)
            if self._steps % self._steps_per_tick == 0:
                self._odometry.update(self._data, self._steps, self.time, self._drift)
        mujoco.mj_kinematics(self._model, self._data)

    def command(self, v: float, w: float) -> None:
        """Command forward velocity v (m/s) and yaw rate w (rad/s), until the command timeout."""
        self._drive.command(v, w, self.time)

    def set_light(self, level: float) -> None:
        """Set the lamps to a level between 0 (dark) and 1 (full)."""
        self._light = check_level(level)

    def spoil_odometry(self, drift: Drift) -> None:
        """Let the odometry drift like this from now on; `NO_DRIFT` ends it, the error it made stays."""
        self._drift = drift

    def dock_distance(self) -> float | None:
        """Return how far (m, on the ground) the robot's base is from the charger; None if the world has none."""
        if self._dock is None:
            return None
        away = self._data.site_xpos[self._dock] - self._data.xpos[self._base]
        return math.hypot(float(away[0]), float(away[1]))

    def odometry(self) -> OdometryReading:
        """Pose (odom frame) and twist (base frame) by the wheel encoders, at the last world tick."""
        return self._odometry.reading()

    def scan(self) -> Scan:
        """Scan of the lidar now; asking twice at one time gives the same noise."""
        return self._lidar.scan(self._data, self._seed, self._steps)

    def ground_truth(self) -> GroundTruth:
        """Where the robot really is and how it really moves."""
        rotation = self._data.xmat[self._base]
        velocity = self._data.qvel[self._base_dof : self._base_dof + 6]
        forward = float(np.dot(rotation.reshape(3, 3)[:, 0], velocity[:3]))
        return GroundTruth(self.time, self._robot_pose(), Twist2D(forward, float(velocity[5])))

    def contacts(self) -> frozenset[str]:
        """Names of the bodies that the robot touches now, the floor excepted."""
        return self._contacts.touching(self.time)

    def take_contact_events(self) -> tuple[ContactEvent, ...]:
        """Return the contacts that began since the last call, oldest first, and forget them."""
        return self._contacts.take_events()

    def render_state(self) -> RenderState:
        """Everything, besides the world file and the placement, that a camera needs to draw this moment."""
        return RenderState(self._data.qpos.copy(), self._light, self._steps)

    def ground_map(self, resolution: float = 0.05) -> GroundMap:
        """Occupancy grid of all that stands still, at the lidar's height (resolution in m per cell)."""
        return self._rasteriser(resolution).map()

    def goals(self, group: str = "goals", resolution: float = 0.05) -> tuple[ViewingGoal, ...]:
        """Return the poses from which the robot sees each body of the MJCF tuple `group`, in its order.

        Raises:
            GoalError: an object can't be seen from any pose that the robot can reach.
        """
        start = self._placement.poses.get(self._settings.drive.body, self.ground_truth().pose)
        return viewing_goals(self._scene, self._rasteriser(resolution), group, start)

    def snapshot(self) -> dict[str, Any]:
        """Return everything needed to continue, as plain values and bytes that MessagePack can carry."""
        return {
            "version": SNAPSHOT_VERSION,
            "world": self._scene.fingerprint,
            "seed": self._seed,
            "placement": self._placement.to_plain(),
            "steps": self._steps,
            "light": self._light,
            "physics": self._physics_state().astype("<f8").tobytes(),
            "drive": self._drive.snapshot(),
            "odometry": self._odometry.snapshot(),
            "contacts": self._contacts.snapshot(),
            "visitor": None if self._visitor is None else self._visitor.snapshot(),
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
        self._steps = int(snapshot["steps"])
        self._light = float(snapshot["light"])
        physics = np.frombuffer(snapshot["physics"], dtype="<f8").astype(np.float64)
        mujoco.mj_setState(self._model, self._data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_kinematics(self._model, self._data)
        self._drive.restore(snapshot["drive"])
        self._odometry.restore(snapshot["odometry"])
        self._contacts.restore(snapshot["contacts"])
        if self._visitor is not None and snapshot["visitor"] is not None:
            self._visitor.restore(snapshot["visitor"])

    def digest(self) -> str:
        """Return a SHA-256 over physics, odometry and light: equal for equal runs."""
        reading = self._odometry.reading()
        pose = reading.pose
        values = (pose.x, pose.y, pose.yaw, self._light, float(self._steps))
        return hashlib.sha256(self._physics_state().tobytes() + struct.pack("<5d", *values)).hexdigest()

    def _begin(self) -> None:
        settings = self._settings
        self._model = self._scene.new_model()
        self._timestep = float(self._model.opt.timestep)
        self._data = mujoco.MjData(self._model)
        self._placement.apply(self._scene, self._model, self._data.qpos)
        mujoco.mj_kinematics(self._model, self._data)
        self._steps_per_control = max(1, self._whole_steps(settings.control_period))
        self._steps_per_tick = max(1, self._whole_steps(settings.tick))
        self._drive = DifferentialDrive(self._scene, settings.drive)
        self._base = self._drive.base
        self._base_dof = self._scene.free_joint_dof(settings.drive.body)
        self._dock = self._scene.index("site", DOCK) if DOCK in self._scene.names("site") else None
        start = self._robot_pose()
        self._visitor = None if settings.walk is None else Visitor(self._scene, settings.walk)
        if self._visitor is not None:
            self._visitor.begin(self._data, start)
            mujoco.mj_kinematics(self._model, self._data)
        self._odometry = Odometry(self._drive, settings.odometry, self._seed, start, self._data)
        self._lidar = Lidar(self._scene, self._model, settings.lidar)
        self._contacts = ContactMonitor(self._scene, settings.drive.body)

    def _robot_pose(self) -> Pose2D:
        position = self._data.xpos[self._base]
        return Pose2D(float(position[0]), float(position[1]), yaw_of_matrix(self._data.xmat[self._base]))

    def _rasteriser(self, resolution: float) -> Rasteriser:
        lidar_height = float(self._data.site_xpos[self._lidar.site][2])
        return Rasteriser(self._scene, self._placement, lidar_height, resolution)

    def _whole_steps(self, seconds: float) -> int:
        steps = round(seconds / self._timestep)
        if steps < 0 or abs(steps * self._timestep - seconds) > 1e-9:
            raise ValueError(f"{seconds} s is not a whole number of physics steps of {self._timestep} s")
        return steps

    def _physics_state(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        spec = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(self._model, spec))
        mujoco.mj_getState(self._model, self._data, state, spec)
        return state
