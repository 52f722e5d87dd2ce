"""The leaves that have the behaviour server move the robot without a path, and those that end such a motion."""

from __future__ import annotations

from typing import Any, ClassVar

from behavior_tree import SUCCESS, Input, Status
from regraft.bus_schema.messages.nav2.motions import (
    AssistedTeleop,
    CancelGoals,
    DriveStraight,
    GoalsCancelled,
    MotionDone,
    MotionProgress,
    Spin,
    Wait,
)
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.recoveries import count_recovery
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerAction, ServerLeaf

ALLOWANCE = "seconds until it counts as failed; 0 is no limit"
CHECKS = "whether it may run into things"


class _Behaviour(ServerAction):
    """The base: a motion that ends by itself."""

    def answered(self, answer: MotionDone) -> Status:
        """Succeed if it was done, or cancelled by another."""
        return self.ended(answer)


class SpinLeaf(_Behaviour):
    """Turns the robot in place."""

    server, unknown = "spin", 700

    spin_dist = Input(float, default=1.57, description="radians, to the left where positive")
    time_allowance = Input(float, default=10.0, description=ALLOWANCE)
    is_recovery = Input(bool, default=True, description="whether it counts as a recovery")
    disable_collision_checks = Input(bool, default=False, description=CHECKS)

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        if self.is_recovery:
            count_recovery(self)
        goal = Spin(self.spin_dist, self.time_allowance, self.disable_collision_checks)
        return self.give(goal, MotionDone, MotionProgress)


class BackUpLeaf(_Behaviour):
    """Drives the robot straight back."""

    server, unknown = "backup", 710

    backup_dist = Input(float, default=0.15, description="metres")
    backup_speed = Input(float, default=0.025, description="metres a second")
    time_allowance = Input(float, default=10.0, description=ALLOWANCE)
    disable_collision_checks = Input(bool, default=False, description=CHECKS)

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        count_recovery(self)
        goal = DriveStraight(self.backup_dist, self.backup_speed, self.time_allowance, self.disable_collision_checks)
        return self.give(goal, MotionDone, MotionProgress)


class DriveOnHeadingLeaf(_Behaviour):
    """Drives the robot straight on, or back where distance and speed are negative."""

    server, unknown = "drive_on_heading", 720

    dist_to_travel = Input(float, default=0.15, description="metres")
    speed = Input(float, default=0.025, description="metres a second")
    time_allowance = Input(float, default=10.0, description=ALLOWANCE)
    disable_collision_checks = Input(bool, default=False, description=CHECKS)

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        goal = DriveStraight(self.dist_to_travel, self.speed, self.time_allowance, self.disable_collision_checks)
        return self.give(goal, MotionDone, MotionProgress)


class WaitLeaf(_Behaviour):
    """Has the robot stand for a while; a negative time counts as positive."""

    server, unknown = "wait", 740

    wait_duration = Input(float, default=1.0, description="seconds")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        count_recovery(self)
        return self.give(Wait(self.wait_duration), MotionDone, MotionProgress)


class AssistedTeleopLeaf(_Behaviour):
    """Lets somebody drive by hand, but into nothing; fails when the time is over, succeeds when it is cancelled."""

    server, unknown = "assisted_teleop", 730

    is_recovery = Input(bool, default=False, description="whether it counts as a recovery")
    time_allowance = Input(float, default=10.0, description=ALLOWANCE)

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        if self.is_recovery:
            count_recovery(self)
        return self.give(AssistedTeleop(self.time_allowance), MotionDone, MotionProgress)


class _CancelLeaf(ServerLeaf):
    """Ends the goal that an action pursues, of any client; succeeds also where it pursues none."""

    server: ClassVar[str]

    server_name = Input(str, default="", description="the action; by default that of Nav2's name")

    def ask(self) -> Asked[Any]:
        """Call the action's service that cancels."""
        service = f"{self.server_name or self.server}/cancel"
        return self.context.call(service, CancelGoals(), GoalsCancelled, timeout=self.patience)

    def answered(self, answer: GoalsCancelled) -> Status:
        """Succeed."""
        return SUCCESS


class CancelControl(_CancelLeaf):
    """Ends FollowPath."""

    server = "follow_path"


class CancelSpin(_CancelLeaf):
    """Ends Spin."""

    server = "spin"


class CancelBackUp(_CancelLeaf):
    """Ends BackUp."""

    server = "backup"


class CancelDriveOnHeading(_CancelLeaf):
    """Ends DriveOnHeading."""

    server = "drive_on_heading"


class CancelWait(_CancelLeaf):
    """Ends Wait."""

    server = "wait"


class CancelAssistedTeleop(_CancelLeaf):
    """Ends AssistedTeleop, which then succeeds."""

    server = "assisted_teleop"
