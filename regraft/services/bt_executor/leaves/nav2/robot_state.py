"""Leaves about the robot itself: its pose, its motion, its battery, its frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from behavior_tree import FAILURE, RUNNING, SUCCESS, Condition, Input, Node, NodeSetup, Output, Status, SyncAction
from behavior_tree.nodes.leaf import Leaf
from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.messages.sensors import Odometry
from regraft.services.bt_executor.leaves.context import LeafContext, NoSuchInput
from regraft.services.bt_executor.leaves.nav2.poses import pose_at_or_none

SAME = {"odom": "map"}
"""Frames that coincide: the odometry's pose is that in the map."""
ROS_BATTERY_TOPICS = ("/battery_status", "battery_status")
BRAKING = 10.0


class _Condition(Condition):
    """The base of conditions that look at the executor's inputs."""

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self.context = context

    def latest(self, name: str) -> Any:
        """Return the newest message of an input, None before the first, or without such an input."""
        try:
            return self.context.latest(name)
        except NoSuchInput:
            return None


class GetCurrentPose(SyncAction):
    """Writes where the robot is; fails while that is unknown."""

    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    global_frame = Input(str, default="map", description="the frame of the pose")
    current_pose = Output[FramedPose](description="where the robot is")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def tick(self) -> Status:
        """Write the pose."""
        here = pose_at_or_none(self, "pose")
        if here is None:
            return FAILURE
        self.current_pose = FramedPose(self.global_frame, here.pose)
        return SUCCESS


class IsStuck(_Condition):
    """Holds while the latest odometry shows that the robot was stopped harder than it brakes.

    That is Nav2's test: the change of speed between the last two messages of the executor's input ``odometry``. Its
    limit is that of a faster robot, so ``brake_limit`` can be lowered.
    """

    brake_limit = Input(float, default=BRAKING, description="the deceleration from which on it holds, in m/s2")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup, context)
        self._last: Odometry | None = None
        self._deceleration = 0.0

    def holds(self) -> bool:
        """Compare the last two messages."""
        now: Odometry | None = self.latest("odometry")
        last = self._last
        if now is not None and now is not last:
            self._last = now
            if last is not None and now.stamp > last.stamp:
                self._deceleration = (last.twist.forward - now.twist.forward) / (now.stamp - last.stamp)
        return self._deceleration > self.brake_limit


class IsBatteryLow(_Condition):
    """Holds while the battery's charge, as a ratio, is at most ``min_battery``; not while it is unknown."""

    min_battery = Input(float, description="the charge as a ratio, from 0 to 1")
    battery_topic = Input(str, default="battery", description="the executor's input with the battery's state")
    is_voltage = Input(bool, default=False, description="not possible: the battery reports no voltage")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Refuse a voltage; see `Node.adopt`."""
        super().adopt(children)
        if self.has_literal("is_voltage") and self.is_voltage:
            raise ValueError("port 'is_voltage' must be false: the battery reports its charge, not its voltage")

    def holds(self) -> bool:
        """Return whether the charge is low."""
        battery = self.latest(_battery_input(self.battery_topic))
        return isinstance(battery, BatteryState) and battery.charge <= self.min_battery


class IsBatteryCharging(_Condition):
    """Holds while the robot stands on a charger that gives power; not while that is unknown."""

    battery_topic = Input(str, default="charger", description="the executor's input with the charger's state")

    def holds(self) -> bool:
        """Return whether the charger gives power."""
        name = self.battery_topic
        charger = self.latest("charger" if name in ROS_BATTERY_TOPICS else name)
        return isinstance(charger, ChargerState) and charger.connected and charger.power > 0.0


class TransformAvailable(_Condition):
    """Holds once messages of the executor's inputs have shown how two frames lie to each other.

    Frames of odometry and of sensors are known from the first message on. As in Nav2, a way that was found stays.
    """

    child_frame = Input(str, name="child", description="one frame")
    parent_frame = Input(str, name="parent", description="the other one")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup, context)
        self._found = False

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Refuse empty frames; see `Node.adopt`."""
        super().adopt(children)
        for port in ("child", "parent"):
            if not self.setup.attributes.get(port):
                raise ValueError(f"{self.type_id} needs the port {port}")

    def holds(self) -> bool:
        """Return whether there is a way from one frame to the other."""
        self._found = self._found or self._reaches(self.child_frame, self.parent_frame)
        return self._found

    def _reaches(self, first: str, last: str) -> bool:
        links = list(self._links())
        known = {frame for link in links for frame in link}
        first, last = SAME.get(first, first), SAME.get(last, last)
        if not {first, last} <= known:
            return False
        reached, ahead = {first}, [first]
        while ahead:
            here = ahead.pop()
            for link in links:
                if here in link:
                    new = set(link) - reached
                    reached |= new
                    ahead += new
        return last in reached

    def _links(self) -> Iterator[tuple[str, str]]:
        for name in self.context.kit.inputs:
            message = self.latest(name)
            frame = getattr(message, "frame", None)
            for other in ("child_frame", "base_frame", "pose_frame"):
                outer = getattr(message, other, None)
                if isinstance(frame, str) and isinstance(outer, str):
                    yield SAME.get(frame, frame), SAME.get(outer, outer)


class CheckStopStatus(Leaf):
    """Succeeds when the robot has stood for a time, is RUNNING until then, and fails while it moves."""

    velocity_threshold = Input(float, default=0.01, description="m/s and rad/s below which it stands")
    duration_stopped = Input(float, default=1000.0, description="milliseconds")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self._context = context
        self._since: float | None = None

    def tick(self) -> Status:
        """Look at the latest odometry."""
        now, odometry = self.runtime.clock.now(), self._odometry()
        limit = self.velocity_threshold
        moves = odometry is not None and max(abs(odometry.twist.forward), abs(odometry.twist.turn)) >= limit
        if odometry is None or moves:
            self._since = None
            return FAILURE
        self._since = odometry.stamp if self._since is None else self._since
        if now - self._since > self.duration_stopped / 1000.0:
            self._since = None
            return SUCCESS
        return RUNNING

    def _odometry(self) -> Odometry | None:
        try:
            latest: Odometry | None = self._context.latest("odometry")
        except NoSuchInput:
            return None
        return latest


def _battery_input(name: str) -> str:
    return "battery" if name in ROS_BATTERY_TOPICS else name
