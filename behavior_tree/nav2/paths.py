"""The decorator that looks at the path."""

from collections.abc import Sequence
from typing import Any

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import COMPLETED, SUCCESS, Status
from .geometry import length_of, poses_of, same_pose


class PathLongerOnApproach(Decorator):
    """Ticks the child when, close to the goal, a new path to it is much longer than the old one; succeeds otherwise.

    Nav2 leaves a child running that is no longer wanted; here it is halted.
    """

    followed = Input[Any](name="path", description="the path that is followed")
    prox_len = Input(float, default=3.0, description="the old path must be shorter than this, in metres")
    length_factor = Input(float, default=2.0, description="how many times as long the new path must be")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._old: Sequence[Any] = ()

    def tick(self) -> Status:
        """Compare the path with the last one; tick the child if it got too long."""
        new = poses_of(self.read_port_or("path"))
        self.set_running()
        if not self._is_too_long(new):
            self.child.reset()
            self._old = new
            return SUCCESS
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._old = new
        return status

    def _is_too_long(self, new: Sequence[Any]) -> bool:
        old = self._old
        if not len(old) or not len(new) or len(new) == len(old):
            return False
        if not same_pose(old[-1], new[-1]):
            return False
        length = length_of(old)
        return length < self.prox_len and length_of(new) > self.length_factor * length
