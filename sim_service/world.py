"""A simulated robot in its world, as the component that makes simulated time go on."""

from __future__ import annotations

import numpy as np

from bus_schema.annotations import PlainValue
from bus_schema.description import Resources
from bus_schema.messages.geometry import Pose, Quaternion, Twist, Vector3
from bus_schema.messages.sensors import LaserScan, LightLevel, Odometry
from bus_schema.messages.world import GroundTruth, WorldState
from regraft import Input, Output, Parameter
from regraft.stepped.source import TimeSource
from sim_service.identity import world_hash
from sim_service.lidar import LidarSettings
from sim_service.odometry import OdometrySettings
from sim_service.poses import Pose2D, Twist2D
from sim_service.scene import load_scene
from sim_service.simulation import Simulation, SimulationSettings

MAP_FRAME = "map"
ODOMETRY_FRAME = "odom"
BASE_FRAME = "base_link"
LIDAR_FRAME = "lidar"


class World(TimeSource):
    """A MuJoCo world with one differential-drive robot: takes velocities, publishes odometry and scans.

    Where things stand is drawn from the run's seed. The ``odom`` frame begins where the robot really starts,
    so that it coincides with ``map`` but for the drift of the wheels. The robot stops when commands stay away
    for 0.5 s. Cameras are components of their own, fed by ``world_state``.
    """

    state_version = 1
    resources = Resources(cpu=0.3)

    file = Parameter("", "the world's MJCF file", unit="path", read_only=True)
    scan_rate = Parameter(5.0, "turns of the lidar per second", minimum=0.1, unit="Hz", read_only=True)
    lidar_noise = Parameter(0.01, "standard deviation of a range", minimum=0.0, unit="m", read_only=True)
    travel_noise = Parameter(
        0.0,
        "standard deviation of a wheel's measured travel after 1 m",
        minimum=0.0,
        unit="m",
        read_only=True,
    )

    velocity = Input(Twist, text="what the robot shall do now: forward velocity and yaw rate", required=False)
    light = Input(LightLevel, required=False, text="how far the lamps are dimmed")
    odometry = Output(Odometry, text="pose and twist by the wheels, every tick")
    scan = Output(LaserScan, text="turns of the lidar")
    world_state = Output(WorldState, text="what a camera needs to draw a tick, if there is one")
    ground_truth = Output(GroundTruth, text="what really is, every tick; for evaluation and tests only")

    def on_configure(self) -> None:
        """Load the world and place everything; raises SceneError, PlacementError."""
        if not self.file:
            raise ValueError("the parameter 'file' must name the world's MJCF file")
        tick = 1.0 / self.tick_rate
        settings = SimulationSettings(
            odometry=OdometrySettings(travel_noise=self.travel_noise),
            lidar=LidarSettings(noise=self.lidar_noise),
            tick=tick,
            control_period=min(tick, SimulationSettings().control_period),
        )
        self.simulation = Simulation(load_scene(self.file), self.kit.seed, settings)
        self._contacts = 0
        self._ticks_per_scan = max(1, round(self.tick_rate / self.scan_rate))
        self._learn_the_world()

    def _learn_the_world(self) -> None:
        simulation = self.simulation
        self._hash = world_hash(simulation.scene, simulation.placement)
        site = simulation.scene.index("site", simulation.settings.lidar.site)
        x, y, z = (float(part) for part in simulation.scene.model.site_pos[site])
        self._lidar_pose = Pose(Vector3(x, y, z), Quaternion())

    @velocity.handler
    def on_velocity(self, twist: Twist) -> None:
        """Drive on like this until the next command, or 0.5 s."""
        self.simulation.command(twist.forward, twist.turn)

    @light.handler
    def on_light(self, level: LightLevel) -> None:
        """Dim the lamps."""
        self.simulation.set_light(1.0 - level.darkness)

    @property
    def ticks(self) -> int:
        """World ticks since the start of the run; a restarted world goes on counting."""
        return round(self.simulation.time * self.tick_rate)

    def advance(self, tick: int, seconds: float) -> None:
        """Advance the world by ``seconds`` and publish what its sensors see."""
        self.simulation.advance(seconds)
        for contact in self.simulation.take_contact_events():
            self._contacts += 1
            self.kit.event("world.contact", f"the robot touches {contact.body}", body=contact.body)
        now = self.kit.now()
        self._publish_odometry(now)
        if self.ticks % self._ticks_per_scan == 0:
            self._publish_scan(now)
        truth = self._truth(now)
        self.ground_truth.publish(truth)
        if self.world_state.wanted:
            self._publish_state(now, truth.pose)

    def _publish_odometry(self, now: float) -> None:
        reading = self.simulation.odometry()
        self.odometry.publish(Odometry(now, ODOMETRY_FRAME, BASE_FRAME, _pose(reading.pose), _twist(reading.twist)))

    def _publish_scan(self, now: float) -> None:
        scan = self.simulation.scan()
        ranges = scan.ranges.astype(np.float32)
        self.scan.publish(
            LaserScan(
                now,
                LIDAR_FRAME,
                BASE_FRAME,
                self._lidar_pose,
                scan.angle_min,
                scan.angle_increment,
                scan.range_min,
                scan.range_max,
                ranges,
            )
        )

    def _truth(self, now: float) -> GroundTruth:
        truth = self.simulation.ground_truth()
        touching = tuple(sorted(self.simulation.contacts()))
        return GroundTruth(now, self.ticks, _pose(truth.pose), _twist(truth.twist), touching, self._contacts)

    def _publish_state(self, now: float, base: Pose) -> None:
        state = self.simulation.render_state()
        self.world_state.publish(
            WorldState(now, self.ticks, self.simulation.seed, self._hash, state.qpos, state.light, base)
        )

    def evaluate(self) -> dict[str, float]:
        """Return how often the robot has touched something."""
        return {"contacts": float(self._contacts)}

    def snapshot(self) -> PlainValue:
        """Return the whole state of the simulation."""
        return {"simulation": self.simulation.snapshot(), "contacts": self._contacts}

    def restore(self, state: PlainValue) -> None:
        """Continue from a snapshot; raises SnapshotError if it was taken in another world."""
        self.simulation.restore(state["simulation"])
        self._contacts = int(state["contacts"])
        self._learn_the_world()


def _pose(pose: Pose2D) -> Pose:
    return Pose.planar(pose.x, pose.y, pose.yaw)


def _twist(twist: Twist2D) -> Twist:
    return Twist.planar(twist.v, twist.w)
