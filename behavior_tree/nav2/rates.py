"""Decorators that let the child start at a rate."""

from typing import Any

from ..nodes.decorator import Decorator
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..status import IDLE, RUNNING, SUCCESS, Status
from .geometry import same


def _period(name: str, rate_hz: float) -> float:
    if rate_hz <= 0.0:
        raise ValueError(f"{name} is {rate_hz} Hz; it must be greater than 0")
    return 1.0 / rate_hz


class RateController(Decorator):
    """Lets the child start again only after a time since its last success; is running meanwhile."""

    hz = Input(float, default=10.0, description="how often a second")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._is_first = True
        self._due = 0.0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check a rate that is given as a literal."""
        super().adopt(children)
        if self.has_literal("hz"):
            _period("hz", self.hz)

    def tick(self) -> Status:
        """Tick the child at the start, while it is running, and when its time has come."""
        if self.status == IDLE:
            self._is_first = True
            self._wait()
        self.set_running()
        is_due = self.runtime.clock.now() >= self._due
        if not (self._is_first or is_due or self.child.status == RUNNING):
            return RUNNING
        self._is_first = False
        status = self.child.execute_tick()
        if status == SUCCESS:
            self._wait()
        return status

    def halt(self) -> None:
        """Reset the child and stop the timer."""
        self.runtime.timers.cancel(self.uid)
        super().halt()

    def _wait(self) -> None:
        self._due = self.runtime.timers.start(self.uid, _period("hz", self.hz))


class SpeedController(Decorator):
    """Lets the child start at a rate that grows with the robot's speed, and whenever the goal changes.

    The rate is min_rate up to min_speed, max_rate from max_speed on, and between them in proportion.
    """

    min_rate = Input(float, default=0.1, description="in hertz")
    max_rate = Input(float, default=1.0, description="in hertz")
    min_speed = Input(float, default=0.0, description="in metres a second")
    max_speed = Input(float, default=0.5, description="in metres a second")
    filter_duration = Input(float, default=0.3, description="in seconds; for the speed's source, not used here")
    goal = Input[Any](default="{goal}", description="the goal")
    goals = Input[Any](default="{goals}", description="the goals")
    speed = Input(float, default="{@robot_speed}", description="the robot's smoothed speed; 0 while unknown")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._is_first = True
        self._goals: tuple[Any, Any] = (None, None)
        self._due = 0.0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check rates that are given as literals."""
        super().adopt(children)
        for name in ("min_rate", "max_rate"):
            if self.has_literal(name):
                _period(name, self.read_port(name))

    def tick(self) -> Status:
        """Tick the child at the start, while it is running, when its time has come, and for a new goal."""
        goals = self.read_port_or("goal"), self.read_port_or("goals")
        if self.status == IDLE or not all(map(same, goals, self._goals)):
            self._goals = goals
            self._is_first = True
            _period("min_rate", self.min_rate)
            self._wait(_period("max_rate", self.max_rate))
        self.set_running()
        is_due = self.runtime.clock.now() >= self._due
        if not (self._is_first or is_due or self.child.status == RUNNING):
            return RUNNING
        self._is_first = False
        if is_due:
            self._wait(1.0 / self._rate())
        return self.child.execute_tick()

    def halt(self) -> None:
        """Reset the child and stop the timer."""
        self.runtime.timers.cancel(self.uid)
        super().halt()

    def _wait(self, period_s: float) -> None:
        self._due = self.runtime.timers.start(self.uid, period_s)

    def _rate(self) -> float:
        slowest, fastest = self.min_rate, self.max_rate
        _period("min_rate", slowest)
        _period("max_rate", fastest)
        low, high = self.min_speed, self.max_speed
        speed: float = abs(self.read_port_or("speed", 0.0))
        if high <= low:
            return fastest if speed >= high else slowest
        share = (speed - low) / (high - low)
        return max(min(slowest + share * (fastest - slowest), fastest), slowest)
