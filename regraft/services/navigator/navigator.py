"""The navigator: the action ``navigate_to`` as a component."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

from regraft import Component, Input, Output, Parameter, Quality, RefusalCode, RequestRefused, action, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.navigator.conversions import grid_of, planar_pose, planar_twist, same_map, scan_of
from regraft.services.navigator.driving.local_controller import Controller, Manoeuvres
from regraft.services.navigator.driving.robot import Footprint, Limits
from regraft.services.navigator.driving.rollout_controller import RolloutController
from regraft.services.navigator.follower import STATE_VERSION, Command, Follower, Tolerances
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.planning.terrain import Inflation
from regraft.services.navigator.qualities import (
    NEAR,
    ROLLOUTS,
    SLOW,
    Caution,
    drive_energy,
    drive_time,
    driving_qualities,
    is_safe,
    near_of,
)
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.senses import SILENT_TIMEOUT, Fault
from regraft.services.power_model import motion_power

FRAMES = ("map", "odom")
FEEDBACK_INTERVAL = 0.5
LOOK_INTERVAL = 0.05


class Navigator(Component):
    """Drives the robot to goal poses on collision-free paths.

    It plans on the map, which may grow under way, and follows the path around what the lidar sees. It takes the
    odometry for the robot's pose in the map. A stack with a mapper connects that port to ``localization``, whose jumps
    it bears. A new goal replaces the previous one. The speed never exceeds ``max_velocity``. When a sense that it needs
    fails, the robot stops, with a diagnostic, and later gives up.
    """

    state_version = STATE_VERSION
    checkpoint_every = 2.0
    handler_timeout = 2.0  # the first plan of a drive is two, and a map may be large
    resources = Resources(cpu=0.05, memory=30.0)
    controller: ClassVar[Callable[[Manoeuvres], Controller]] = RolloutController
    """Makes what chooses the twists; a sibling of this class differs in nothing else."""
    caution: ClassVar[Caution] = ROLLOUTS
    """How safe that is expected to be."""

    max_velocity = Parameter(
        robot_parameters.MAX_VELOCITY,
        "how fast the robot may drive",
        minimum=0.0,
        unit="m/s",
        limit="velocity_limit",
        from_robot="max_velocity",
    )
    max_turn_rate = Parameter(1.0, "how fast the robot may turn", minimum=0.05, unit="rad/s", limit="turn_rate_limit")
    goal_distance = Parameter(0.08, "how near to a goal is there", minimum=0.02, maximum=1.0, unit="m", read_only=True)
    goal_angle = Parameter(
        0.10, "how near to a goal's heading is there", minimum=0.02, maximum=3.2, unit="rad", read_only=True
    )
    ready_within = Parameter(5.0, "how long a goal waits for the first map and odometry", minimum=0.0, unit="s")
    scan_timeout = Parameter(
        SILENT_TIMEOUT, "how old the last scan may be until the robot stops", minimum=0.1, maximum=60.0, unit="s"
    )

    slow = Parameter(SLOW, "speed below which it is safe to drive near things", minimum=0.0, unit="m/s")

    radius = robot_parameters.radius(read_only=True)
    turning_room = robot_parameters.turning_room(read_only=True)
    outline = robot_parameters.outline()
    velocity_limit = robot_parameters.velocity_limit()
    turn_rate_limit = robot_parameters.turn_rate_limit()
    acceleration = robot_parameters.acceleration()
    turn_acceleration = robot_parameters.turn_acceleration()
    wheel_speed = robot_parameters.wheel_speed()
    wheel_separation = robot_parameters.wheel_separation()
    motion_power = robot_parameters.motion_power()

    speed = Quality("of driving on", unit="m/s", better="higher", minimum=0.0, functional=True)
    power = Quality("of the wheels", unit="W", better="lower", minimum=0.0)
    safety = Quality(
        "share of the time in which nothing is near or the robot slow", better="higher", minimum=0.0, maximum=1.0
    )
    energy_per_metre = Quality("of driving on", unit="J/m", better="lower", minimum=0.0, measured=False)
    drive_time = Quality("of a whole drive", unit="s", better="lower", minimum=0.0, functional=True, measured=False)
    drive_energy = Quality("of a whole drive", unit="J", better="lower", minimum=0.0, measured=False)
    clearance = Quality("range of the nearest echo", unit="m", better="higher", minimum=0.0, estimated=False)

    odometry = Input(sensors.Odometry, latest_only=True, description="where the robot is and how it moves")
    scan = Input(sensors.LaserScan, latest_only=True, description="what is around")
    map = Input(maps.OccupancyGrid, latest_only=True, description="what stands still")
    velocity = Output(geometry.Twist, description="what the robot shall do; nothing while there is no goal")

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Add none; raises ParameterError if the outline is none."""
        robot_parameters.check_outline(parameters["outline"])
        return ()

    def on_configure(self) -> None:
        """Begin without a map and without a goal."""
        self._follower: Follower | None = None
        self._known_map: maps.OccupancyGrid | None = None
        self._latest_scan: tuple[sensors.LaserScan, Scan] | None = None
        self._restored: PlainValue = None
        self._goal: NavigateTo | None = None
        self._command = Command(0.0, 0.0, "idle")
        self._moving = False
        self._place: sensors.Odometry | None = None
        self._faults: dict[str, str] = {}

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the qualities of driving straight on as fast as allowed, and of a whole drive.

        ``context`` may give ``near``, the share of the time that something is within a tenth of the lidar's range. It
        may give the ``distance`` (m) of a drive from pose to pose.

        Returns:
            ``speed`` (m/s), ``power`` of the wheels (W), and ``energy_per_metre`` (J/m). ``safety`` is the
            share of the time in which nothing is near or the robot slow. With a ``distance`` also
            ``drive_time`` (s) and ``drive_energy`` (J) of the wheels, turning at both ends included.
        """
        speed = float(parameters.get("max_velocity", cls.max_velocity.default))
        near, distance = context.get("near"), context.get("distance")
        powers = parameters.get("motion_power", cls.motion_power.default)
        slow = float(parameters.get("slow", cls.slow.default))
        qualities = driving_qualities(speed, cls.caution, None if near is None else float(near), powers, slow)
        if distance is None or speed <= 0.0:
            return qualities
        way = float(distance)
        return qualities | {"drive_time": drive_time(way, speed), "drive_energy": drive_energy(way, speed, powers)}

    def evaluate(self) -> dict[str, float]:
        """Return what holds now: ``speed`` (m/s), ``power`` of the wheels (W), ``safety`` (1 or 0), ``clearance`` (m).

        The clearance is the range of the nearest echo, left out as long as there is none.
        """
        odometry = self.odometry.latest
        speed = 0.0 if odometry is None else abs(odometry.twist.forward)
        scan = self._scan()
        clearance = math.inf if scan is None else scan.nearest()
        near = NEAR if scan is None else near_of(scan.range_min, scan.range_max)
        power = motion_power(speed, self.motion_power)
        qualities = {"speed": speed, "power": power, "safety": float(is_safe(clearance, speed, near, self.slow))}
        return qualities | ({"clearance": clearance} if math.isfinite(clearance) else {})

    @action("navigate_to", feedback=NavigationProgress)
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Drive to a pose in the map, and report whether the robot is there."""
        if goal.goal.frame not in FRAMES:
            why = f"must be {' or '.join(FRAMES)}, is {goal.goal.frame!r}"
            raise RequestRefused(why, RefusalCode.INVALID, field="goal.frame")
        await self._get_ready()
        assert self._follower is not None
        self._follower.start(planar_pose(goal.goal.pose))
        self._goal = goal
        self._command = Command(0.0, 0.0, "driving")
        try:
            return await self._arrive()
        finally:
            if self._goal is goal:
                self._goal = None
                self._follower.cancel()

    async def _get_ready(self) -> None:
        """Wait for what driving needs; raises RequestRefused if it does not come."""
        deadline = self.kit.now() + self.ready_within
        while missing := self._missing():
            if self.kit.now() >= deadline:
                raise RequestRefused(f"cannot drive: {missing} within {self.ready_within:g} s", RefusalCode.UNAVAILABLE)
            await self.kit.sleep(LOOK_INTERVAL)

    def _missing(self) -> str:
        missing = []
        if self.odometry.latest is None:
            missing.append("no odometry has come")
        if not self._take_map():
            missing.append("no usable map has come")
        return " and ".join(missing)

    async def _arrive(self) -> Arrival:
        """Wait for the end of the drive, reporting progress."""
        told = self.kit.now()
        while not (self._command.done or self._command.failed):
            await self.kit.sleep(LOOK_INTERVAL)
            if self.kit.now() - told >= FEEDBACK_INTERVAL:
                told = self.kit.now()
                self._tell()
        odometry = self.odometry.latest
        pose = geometry.Pose() if odometry is None else odometry.pose
        return Arrival(self._command.done, pose, self._command.reason)

    def _tell(self) -> None:
        now = self._command
        # The time left is infinite for a robot that may not drive; a message takes finite numbers only.
        time_left = min(now.time_left, 1e6)
        self.kit.feedback(NavigationProgress(now.distance_left, time_left, now.phase, now.recoveries))

    @every(hz=20.0)
    def drive(self) -> None:
        """Command what the goal asks for now; stop once when there is none."""
        self._place = self.odometry.latest or self._place
        if self._goal is None:
            self._stop()
            if self._faults:
                self._update()  # so that their end is reported
        elif self._update():
            self._moving = True
            self.velocity.publish(geometry.Twist.planar(self._command.v, self._command.w))
        else:
            self._stop()

    def _update(self) -> bool:
        """Take in what has come, and decide what to do now; return whether that was possible."""
        self._take_map()
        place = self._place
        if self._follower is None or place is None:
            return False
        self._follower.limits = self._limits()
        self._follower.scan_timeout = self.scan_timeout
        self._command = self._follower.update(
            self.kit.now(), planar_pose(place.pose), planar_twist(place.twist), self._scan(), place.stamp
        )
        self._tell_faults(self._command.faults)
        return True

    def _tell_faults(self, faults: tuple[Fault, ...]) -> None:
        """Diagnose what is newly wrong with the senses, and what is no longer."""
        now: dict[str, str] = {fault.subject: fault.text for fault in faults}
        for subject, text in now.items():
            if self._faults.get(subject) != text:
                self.kit.diagnose(subject, Level.ERROR, f"the robot stops: {text}")
        for subject in self._faults:
            if subject not in now:
                self.kit.diagnose(subject, Level.OK, "as it should be again")
        self._faults = now

    def _stop(self) -> None:
        if self._moving:
            self._moving = False
            self.velocity.publish(geometry.Twist())

    def _limits(self) -> Limits:
        return Limits(
            self.max_velocity,
            self.max_turn_rate,
            self.acceleration,
            self.turn_acceleration,
            self.wheel_speed,
            self.wheel_separation,
        )

    def _scan(self) -> Scan | None:
        """Return the latest scan, converted once."""
        message = self.scan.latest
        if message is None:
            return None
        if self._latest_scan is None or self._latest_scan[0] is not message:
            self._latest_scan = (message, scan_of(message))
        return self._latest_scan[1]

    def _take_map(self) -> bool:
        """Take in the latest map where it is new; return whether there is one to drive on."""
        message = self.map.latest
        if message is None or message is self._known_map:
            return self._follower is not None
        if self._known_map is None or not same_map(message, self._known_map):
            self._use_map(message)
        self._known_map = message
        return self._follower is not None

    def _use_map(self, message: maps.OccupancyGrid) -> None:
        try:
            planner = GridPlanner(grid_of(message), Inflation.of(self.radius, self.turning_room))
        except ValueError as error:
            self.kit.diagnose("map", Level.ERROR, f"the map is of no use: {error}")
            return
        if self._follower is not None:
            self._follower.planner = planner
            return
        tolerances = Tolerances(position=self.goal_distance, yaw=self.goal_angle)
        outline = Footprint(*self.outline) if self.outline else Footprint.disc(self.radius)
        controller = type(self).controller(Manoeuvres(outline))
        self._follower = Follower(planner, self._limits(), controller, tolerances)
        if self._restored is not None:
            self._follower.restore(self._restored)
            self._restored = None

    def on_deactivate(self) -> None:
        """Stand still."""
        self._stop()

    def snapshot(self) -> PlainValue:
        """Return the state of the drive and the remembered obstacles."""
        return self._restored if self._follower is None else self._follower.snapshot()

    def restore(self, state: PlainValue) -> None:
        """Remember the obstacles; a goal has to be given again, because its client waits for an answer."""
        if self._follower is not None and state is not None:
            self._follower.restore(state)
        else:
            self._restored = state
