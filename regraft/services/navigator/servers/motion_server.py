"""Carrying out one motion at a time: what the servers that drive have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from regraft import Output, Parameter, every
from regraft.bus_schema.messages import geometry
from regraft.bus_schema.messages.nav2.motions import GoalsCancelled
from regraft.planar import Twist2D
from regraft.services import robot_parameters
from regraft.services.navigator.driving.local_controller import Manoeuvres, Situation
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.sensing.senses import SILENT_TIMEOUT
from regraft.services.navigator.servers.map_user import LOOK_INTERVAL, MapUser
from regraft.services.navigator.servers.motion import Ended, Motion

FEEDBACK_INTERVAL = 0.5
REPLACED_WITHIN = 0.01
"""s: a real clock moves by less from the end of a goal to the start of the next one."""

M = TypeVar("M", bound=Motion)


class MotionServer(MapUser):
    """Drives the robot as one motion asks for; a newer motion replaces the one before."""

    max_velocity = Parameter(
        robot_parameters.MAX_VELOCITY,
        "how fast the robot may drive",
        minimum=0.0,
        unit="m/s",
        limit="velocity_limit",
        from_robot="max_velocity",
    )
    max_turn_rate = Parameter(1.0, "how fast the robot may turn", minimum=0.05, unit="rad/s", limit="turn_rate_limit")
    controller_frequency = Parameter(
        20.0, "how often the robot is told how to move", minimum=1.0, maximum=100.0, unit="Hz", read_only=True
    )
    blind = Parameter(10.0, "for how long odometry or scans may be missing", minimum=0.5, unit="s")
    scan_timeout = Parameter(
        SILENT_TIMEOUT, "how old the last scan may be until the robot stops", minimum=0.1, maximum=60.0, unit="s"
    )

    velocity_limit = robot_parameters.velocity_limit()
    turn_rate_limit = robot_parameters.turn_rate_limit()
    acceleration = robot_parameters.acceleration()
    turn_acceleration = robot_parameters.turn_acceleration()
    wheel_speed = robot_parameters.wheel_speed()
    wheel_separation = robot_parameters.wheel_separation()

    velocity = Output(geometry.Twist, description="what the robot shall do; nothing while there is no motion")

    def on_configure(self) -> None:
        """Begin standing."""
        super().on_configure()
        self._manoeuvres = Manoeuvres(self._footprint)
        self._motion: Motion | None = None
        self._action = ""
        self._left_off: tuple[Motion, float] | None = None
        self._told = Twist2D()
        self._moving = False

    @every(hz=controller_frequency)
    def drive(self) -> None:
        """Command what the motion asks for now; stop once when there is none."""
        self._look()
        motion = self._motion
        if motion is None or _has_ended(motion):
            self._stop()
            return
        time, limits, seen = self.kit.now(), self._limits(), self._surroundings
        period = 1.0 / self.controller_frequency
        fault = seen.fault(time)
        if fault:
            motion.blind(time, fault)
            twist = limits.approach(self._told, Twist2D(), period)
        else:
            twist = motion.step(time, Situation(seen.pose, seen.twist, seen.sight.obstacles, limits, period))
        if _has_ended(motion):
            self._stop()
        else:
            self._command(twist)

    async def _carry_out(self, action: str, motion: M, progress: Callable[[M], object]) -> Ended:
        """Have the robot move until the motion of an action has ended, and report feedback."""
        if self._motion is not None:
            self._motion.end(Ended(self._motion.unknown, "replaced by another motion", cancelled=True))
        self._motion, self._action = motion, action
        told = self.kit.now()
        try:
            while motion.ended is None:
                await self.kit.sleep(LOOK_INTERVAL)
                if self.kit.now() - told >= FEEDBACK_INTERVAL - 1e-9:
                    told = self.kit.now()
                    self.kit.feedback(progress(motion))
        finally:
            self._left_off = (motion, self.kit.now())
            if self._motion is motion:
                self._motion = None
        assert motion.ended is not None
        return motion.ended

    def _replaced(self) -> Motion | None:
        """Return the motion that a goal replaces at this moment, None if the robot had none."""
        if self._motion is not None:
            return self._motion
        # The goal before is ended first, at the same time.
        longest = 0.0 if self.kit.simulated else REPLACED_WITHIN
        if self._left_off is not None and self.kit.now() - self._left_off[1] <= longest:
            return self._left_off[0]
        return None

    def _cancel(self, action: str) -> GoalsCancelled:
        """End the motion of an action, if it is under way."""
        motion = self._motion
        if motion is None or motion.ended is not None or self._action != action:
            return GoalsCancelled(0)
        motion.end(Ended(cancelled=True, why="cancelled on request"))
        return GoalsCancelled(1)

    def _oldest_scan(self) -> float:
        return self.scan_timeout

    def _command(self, twist: Twist2D) -> None:
        self._told, self._moving = twist, True
        self.velocity.publish(geometry.Twist.planar(twist.v, twist.w))

    def _stop(self) -> None:
        self._told = Twist2D()
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

    def on_deactivate(self) -> None:
        """Stand still."""
        self._stop()


def _has_ended(motion: Motion) -> bool:
    return motion.ended is not None
