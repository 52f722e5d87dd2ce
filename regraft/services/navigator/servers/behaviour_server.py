"""The behaviour server: single motions as actions of their own."""

from __future__ import annotations

from regraft import Input, action, service
from regraft.bus_schema.messages import geometry
from regraft.bus_schema.messages.nav2.motions import (
    ASSISTED_TELEOP,
    BACK_UP,
    DRIVE_ON_HEADING,
    SPIN,
    WAIT,
    AssistedTeleop,
    CancelGoals,
    DriveStraight,
    GoalsCancelled,
    MotionDone,
    MotionError,
    MotionProgress,
    Spin,
    Wait,
)
from regraft.bus_schema.model.description import Resources
from regraft.planar import Twist2D
from regraft.services.navigator.conversions import planar_twist
from regraft.services.navigator.driving.local_controller import Manoeuvres
from regraft.services.navigator.servers.behaviours import Behaviour, ByHand, Stand, Straight, Turn
from regraft.services.navigator.servers.motion import Patience
from regraft.services.navigator.servers.motion_server import MotionServer

TELEOP_TIMEOUT = 0.5
"""s: an older twist by hand is none."""
SHORTEST_WAIT = 1e-6

Base = tuple[Manoeuvres, dict[MotionError, int], float, bool, Patience]


class BehaviourServer(MotionServer):
    """Turns, drives straight, waits, and drives by hand; never into anything, unless a goal forbids to look.

    Names and error codes are those of Nav2's behaviour server. A time allowance of 0 is no limit.
    """

    resources = Resources(cpu=0.04, memory=30.0)

    teleop = Input(geometry.Twist, latest_only=True, required=False, description="how somebody drives by hand")

    @action("spin", feedback=MotionProgress)
    async def spin(self, goal: Spin) -> MotionDone:
        """Turn in place."""
        base = self._base(SPIN, goal.time_allowance, not goal.disable_collision_checks)
        return await self._behave("spin", Turn(*base, angle=goal.target_yaw))

    @action("backup", feedback=MotionProgress)
    async def back_up(self, goal: DriveStraight) -> MotionDone:
        """Drive straight back, whichever sign distance and speed have."""
        base = self._base(BACK_UP, goal.time_allowance, not goal.disable_collision_checks)
        return await self._drive("backup", Straight(*base, distance=-abs(goal.distance), speed=-abs(goal.speed)))

    @action("drive_on_heading", feedback=MotionProgress)
    async def drive_on_heading(self, goal: DriveStraight) -> MotionDone:
        """Drive straight on, or back where distance and speed are negative."""
        base = self._base(DRIVE_ON_HEADING, goal.time_allowance, not goal.disable_collision_checks)
        return await self._drive("drive_on_heading", Straight(*base, distance=goal.distance, speed=goal.speed))

    @action("wait", feedback=MotionProgress)
    async def wait(self, goal: Wait) -> MotionDone:
        """Stand for a while."""
        return await self._behave("wait", Stand(*self._base(WAIT, max(abs(goal.time), SHORTEST_WAIT), checks=False)))

    @action("assisted_teleop", feedback=MotionProgress)
    async def assisted_teleop(self, goal: AssistedTeleop) -> MotionDone:
        """Drive by hand, but into nothing."""
        base = self._base(ASSISTED_TELEOP, goal.time_allowance, checks=True)
        return await self._behave("assisted_teleop", ByHand(*base, given=self._by_hand))

    @service("spin/cancel")
    def cancel_spin(self, request: CancelGoals) -> GoalsCancelled:
        """End the turn under way."""
        return self._cancel("spin")

    @service("backup/cancel")
    def cancel_back_up(self, request: CancelGoals) -> GoalsCancelled:
        """End the way back under way."""
        return self._cancel("backup")

    @service("drive_on_heading/cancel")
    def cancel_drive_on_heading(self, request: CancelGoals) -> GoalsCancelled:
        """End the straight way under way."""
        return self._cancel("drive_on_heading")

    @service("wait/cancel")
    def cancel_wait(self, request: CancelGoals) -> GoalsCancelled:
        """End the wait under way."""
        return self._cancel("wait")

    @service("assisted_teleop/cancel")
    def cancel_assisted_teleop(self, request: CancelGoals) -> GoalsCancelled:
        """End driving by hand."""
        return self._cancel("assisted_teleop")

    def _base(self, codes: dict[MotionError, int], allowance: float, checks: bool) -> Base:
        return self._manoeuvres, codes, allowance, checks, Patience(self.blind)

    async def _drive(self, action: str, motion: Straight) -> MotionDone:
        if motion.distance * motion.speed <= 0.0:
            given = f"distance {motion.distance:g} m and speed {motion.speed:g} m/s"
            why = f"{given} must have the same sign, and none be 0"
            return MotionDone(0.0, motion.codes[MotionError.INVALID_INPUT], why)
        return await self._behave(action, motion)

    async def _behave(self, action: str, motion: Behaviour) -> MotionDone:
        await self._get_ready()
        ended = await self._carry_out(action, motion, lambda now: MotionProgress(now.travelled, now.elapsed))
        return MotionDone(motion.elapsed, ended.code, ended.why, ended.cancelled)

    def _by_hand(self) -> Twist2D:
        given, stamp = self.teleop.latest, self.teleop.stamp
        if given is None or stamp is None or self.kit.now() - stamp > TELEOP_TIMEOUT:
            return Twist2D()
        return planar_twist(given)
