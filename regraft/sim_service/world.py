"""A simulated robot in its world, as the component that makes simulated time go on."""

from __future__ import annotations

import numpy as np

from regraft import Input, Output, Parameter, Records
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Pose, Quaternion, Twist, Vector3
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.messages.sensors import LaserScan, LightLevel, Odometry
from regraft.bus_schema.messages.world import GroundTruth, WorldState
from regraft.bus_schema.model.description import Resources
from regraft.lockstep.source import TimeSource
from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.layout.identity import world_hash
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.layout.visitor import DEFAULT_SPEED, Walk, Waypoint
from regraft.sim_service.robot.failures import (
    DRIFT,
    DROPOUT,
    FROZEN,
    NONE,
    ODOMETRY_FAILURES,
    SCAN_FAILURES,
    SILENT,
    OdometryFails,
    ScanFails,
    Schedule,
    drop_rays,
)
from regraft.sim_service.robot.lidar import LidarSettings
from regraft.sim_service.robot.odometry import NO_DRIFT, Drift, OdometryReading, OdometrySettings
from regraft.sim_service.simulation import Simulation, SimulationSettings

MAP_FRAME = "map"
ODOMETRY_FRAME = "odom"
BASE_FRAME = "base_link"
LIDAR_FRAME = "lidar"
CHARGER_RATE = 2.0


class World(TimeSource):
    """A MuJoCo world with one differential-drive robot: takes velocities, publishes odometry and scans.

    Where things stand is drawn from the run's seed. The ``odom`` frame begins where the robot really starts,
    so that it coincides with ``map`` but for the drift of the wheels. The robot stops when commands stay away
    for 0.5 s, and does not move with an empty battery. Cameras are components of their own, fed by
    ``world_state``.

    Sensors can be made to fail: at once, by the parameters ``scan_failure`` and ``odometry_failure``, and by
    the clock, by the schedules ``scan_failures`` and ``odometry_failures``, which count while the parameter says none.
    """

    state_version = 2
    resources = Resources(cpu=0.1, memory=65.0)

    file = Parameter("", "the world's MJCF file", unit="path", exists=True, read_only=True)
    scan_rate = Parameter(5.0, "turns of the lidar per second", minimum=0.1, unit="Hz", read_only=True)
    lidar_noise = Parameter(0.01, "standard deviation of a range", minimum=0.0, unit="m", read_only=True)
    travel_noise = Parameter(
        0.0,
        "standard deviation of a wheel's measured travel after 1 m",
        minimum=0.0,
        unit="m",
        read_only=True,
    )
    radius_error = Parameter(
        0.0, "share by which both wheels are taken for too large", minimum=-0.5, maximum=0.5, read_only=True
    )
    radius_difference = Parameter(
        0.0,
        "share by which the right wheel is taken for larger than the left",
        minimum=-0.5,
        maximum=0.5,
        read_only=True,
    )
    track_error = Parameter(
        0.0, "share by which the wheels are taken for too far apart", minimum=-0.5, maximum=0.5, read_only=True
    )
    charger_power = Parameter(20.0, "what the dock gives", minimum=0.0, unit="W")
    charger_reach = Parameter(0.15, "how near to the dock the robot is charged", minimum=0.01, unit="m")
    visitor = Records(Waypoint, "where somebody walks to and fro, in a world that has a visitor")
    visitor_speed = Parameter(
        DEFAULT_SPEED, "how fast the visitor walks", minimum=0.01, maximum=3.0, unit="m/s", read_only=True
    )
    scan_failure = Parameter(NONE, "how the lidar fails now", choices=SCAN_FAILURES)
    scan_dropout = Parameter(0.5, "share of the rays that a dropout loses", minimum=0.0, maximum=1.0)
    odometry_failure = Parameter(NONE, "how the odometry fails now", choices=ODOMETRY_FAILURES)
    odometry_drift_yaw = Parameter(
        0.2, "what a drift adds to the yaw with each metre", minimum=-10.0, maximum=10.0, unit="rad/m"
    )
    odometry_drift_scale = Parameter(0.1, "share that a drift adds to the way", minimum=-1.0, maximum=1.0)
    scan_failures = Records(ScanFails, "when the lidar fails and works again, in order")
    odometry_failures = Records(OdometryFails, "when the odometry fails and works again, in order")

    velocity = Input(Twist, description="what the robot shall do now: forward velocity and yaw rate", required=False)
    light = Input(LightLevel, required=False, description="how far the lamps are dimmed")
    battery = Input(BatteryState, latest_only=True, required=False, description="whether there is power to drive")
    odometry = Output(Odometry, description="pose and twist by the wheels, every tick")
    scan = Output(LaserScan, description="turns of the lidar")
    charger = Output(ChargerState, description="whether the robot stands on the dock; nothing in worlds without one")
    world_state = Output(WorldState, description="what a camera needs to draw a tick, if there is one")
    ground_truth = Output(GroundTruth, description="what really is, every tick; for evaluation and tests only")

    def on_configure(self) -> None:
        """Load the world and place everything; raises SceneError, PlacementError, ScheduleError, WalkError."""
        if not self.file:
            raise ValueError("the parameter 'file' must name the world's MJCF file")
        tick = 1.0 / self.tick_rate
        self._schedules = {
            "scan": Schedule(self.scan_failures, "scan_failures"),
            "odometry": Schedule(self.odometry_failures, "odometry_failures"),
        }
        settings = SimulationSettings(
            odometry=OdometrySettings(self.travel_noise, self.radius_error, self.radius_difference, self.track_error),
            lidar=LidarSettings(noise=self.lidar_noise),
            tick=tick,
            control_period=min(tick, SimulationSettings().control_period),
            walk=Walk(tuple((at.x, at.y) for at in self.visitor), self.visitor_speed) if self.visitor else None,
        )
        self.simulation = Simulation(load_scene(self.file), self.kit.seed, settings)
        self._contacts = 0
        self._failing = dict.fromkeys(self._schedules, NONE)
        self._powered = True
        self._shown: OdometryReading | None = None
        self._shown_ranges: bytes | None = None
        self._ticks_per_charger = max(1, round(self.tick_rate / CHARGER_RATE))
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
        """Drive on like this until the next command, or 0.5 s; an empty battery turns no wheel."""
        battery = self.battery.latest
        powered = battery is None or battery.energy > 0.0
        if powered != self._powered:
            self._powered = powered
            text = "the battery is empty: the robot stands still" if not powered else "there is power to drive again"
            self.kit.event("world.power", text, powered=powered)
        if not powered:
            return
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
        now = self.kit.now()
        self._note_failures(now)
        self.simulation.advance(seconds)
        for contact in self.simulation.take_contact_events():
            self._contacts += 1
            self.kit.event("world.contact", f"the robot touches {contact.body}", body=contact.body)
        self._publish_odometry(now)
        if self.ticks % self._ticks_per_scan == 0:
            self._publish_scan(now)
        if self.ticks % self._ticks_per_charger == 0:
            self._publish_charger(now)
        truth = self._truth(now)
        self.ground_truth.publish_deferred(lambda: truth)
        if self.world_state.wanted:
            self._publish_state(now, truth.pose)

    def _note_failures(self, now: float) -> None:
        """Let the sensors fail as parameters and schedule say for this moment."""
        given = {"scan": self.scan_failure, "odometry": self.odometry_failure}
        for sensor, failing in given.items():
            failure = failing if failing != NONE else self._schedules[sensor].at(now)
            if failure != self._failing[sensor]:
                self._failing[sensor] = failure
                self.kit.event("world.failure", f"{sensor}: {failure}", sensor=sensor, failure=failure)
        drifts = self._failing["odometry"] == DRIFT
        drift = Drift(self.odometry_drift_yaw, self.odometry_drift_scale) if drifts else NO_DRIFT
        self.simulation.spoil_odometry(drift)

    def _publish_charger(self, now: float) -> None:
        distance = self.simulation.dock_distance()
        if distance is not None:
            connected = distance <= self.charger_reach
            self.charger.publish(ChargerState(now, connected, self.charger_power if connected else 0.0))

    def _publish_odometry(self, now: float) -> None:
        failure = self._failing["odometry"]
        if failure == SILENT:
            return
        if failure != FROZEN or self._shown is None:
            self._shown = self.simulation.odometry()
        reading = self._shown
        self.odometry.publish(Odometry(now, ODOMETRY_FRAME, BASE_FRAME, _pose(reading.pose), _twist(reading.twist)))

    def _publish_scan(self, now: float) -> None:
        failure = self._failing["scan"]
        if failure == SILENT:
            return
        scan = self.simulation.scan()
        if failure == FROZEN and self._shown_ranges is not None:
            ranges = np.frombuffer(self._shown_ranges, np.float32)
        else:
            lost = self.scan_dropout if failure == DROPOUT else 0.0
            measured = drop_rays(scan.ranges, lost, self.kit.seed, self.ticks) if lost else scan.ranges
            ranges = measured.astype(np.float32)
            self._shown_ranges = ranges.tobytes()
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
        told = WorldState(now, self.ticks, self.simulation.seed, self._hash, state.qpos, state.light, base)
        self.world_state.publish_deferred(lambda: told)

    def evaluate(self) -> dict[str, float]:
        """Return how often the robot has touched something, as ``contacts``."""
        return {"contacts": float(self._contacts)}

    def snapshot(self) -> PlainValue:
        """Return the whole state of the simulation."""
        shown = None if self._shown is None else self._shown.to_plain()
        return {
            "simulation": self.simulation.snapshot(),
            "contacts": self._contacts,
            "shown": {"odometry": shown, "ranges": self._shown_ranges},
        }

    def restore(self, state: PlainValue) -> None:
        """Continue from a snapshot; raises SnapshotError if it was taken in another world."""
        self.simulation.restore(state["simulation"])
        self._contacts = int(state["contacts"])
        shown = state["shown"]
        self._shown = None if shown["odometry"] is None else OdometryReading.from_plain(shown["odometry"])
        self._shown_ranges = shown["ranges"]
        self._learn_the_world()


def _pose(pose: Pose2D) -> Pose:
    return Pose.planar(pose.x, pose.y, pose.yaw)


def _twist(twist: Twist2D) -> Twist:
    return Twist.planar(twist.v, twist.w)
