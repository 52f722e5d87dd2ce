"""The decorator that lets the child start whenever the robot has moved."""

from typing import Any

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, IDLE, RUNNING, SUCCESS, Status
from .geometry import Position, position_of


class DistanceController(Decorator):
    """Lets the child start again only after the robot moved so far since the child's last success.

    Fails while the robot's pose is unknown.
    """

    distance = Input(float, default=1.0, description="in metres, as the crow flies")
    global_frame = Input(str, default="", description="for the pose's source, not used here")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._is_first = True
        self._start: Position = (0.0, 0.0)

    def tick(self) -> Status:
        """Tick the child at the start, while it is running, and when the robot has moved far enough."""
        here = self._position()
        if here is None:
            return FAILURE
        if self.status == IDLE:
            self._is_first = True
            self._start = here
        self.set_running()
        x, y = here[0] - self._start[0], here[1] - self._start[1]
        is_due = (x * x + y * y) ** 0.5 >= self.distance
        if not (self._is_first or is_due or self.child.status == RUNNING):
            return RUNNING
        self._is_first = False
        status = self.child.execute_tick()
        if status == SUCCESS:
            here = self._position()
            if here is None:
                return FAILURE
            self._start = here
        return status

    def _position(self) -> Position | None:
        pose = self.read_port_or("pose")
        return None if pose is None else position_of(pose)
