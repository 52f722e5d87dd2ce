"""The inputs of trees that navigate: where the robot is, what is selected, and newer goals."""

from __future__ import annotations

from regraft import Component, Input
from regraft.bus_schema.messages.geometry import FramedPose, StampedPose
from regraft.bus_schema.messages.maps import Goals
from regraft.bus_schema.messages.nav2.motions import Selection
from regraft.bus_schema.messages.power import ChargerState
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.services.bt_executor.blackboard_feed import Reflected


def _pose(odometry: Odometry) -> FramedPose:
    return FramedPose("map", odometry.pose)


def _speed(odometry: Odometry) -> float:
    return abs(odometry.twist.forward)


def _received(odometry: Odometry) -> bool:
    return True


def _same(message: object) -> object:
    return message


NAVIGATION: tuple[Reflected, ...] = (
    Reflected("odometry", "robot_pose", FramedPose, _pose),
    Reflected("odometry", "robot_speed", float, _speed),
    Reflected("odometry", "initial_pose_received", bool, _received),
    Reflected("goal_update", "goal_update", StampedPose, _same),
    Reflected("goals_update", "goals_update", Goals, _same),
)
"""Pose in the map, speed in m/s, whether the pose is known, and goals that replace a mission's."""


class NavigationInputs(Component):
    """The inputs, for a component that ticks such trees."""

    odometry = Input(Odometry, latest_only=True, description="for {@robot_pose} and {@robot_speed}")
    scan = Input(LaserScan, latest_only=True, required=False, description="for TransformAvailable: its frames")
    charger = Input(ChargerState, latest_only=True, required=False, description="for IsBatteryCharging")
    goal_update = Input(StampedPose, latest_only=True, required=False, description="for GoalUpdater: a newer goal")
    goals_update = Input(Goals, latest_only=True, required=False, description="for GoalUpdater: newer goals")
    planner_selector = Input(Selection, latest_only=True, required=False, description="the planner to use")
    controller_selector = Input(Selection, latest_only=True, required=False, description="the controller to use")
    smoother_selector = Input(Selection, latest_only=True, required=False, description="the smoother to use")
    goal_checker_selector = Input(Selection, latest_only=True, required=False, description="the goal checker to use")
    progress_checker_selector = Input(
        Selection, latest_only=True, required=False, description="the progress checker to use"
    )
    path_handler_selector = Input(Selection, latest_only=True, required=False, description="the path handler to use")
