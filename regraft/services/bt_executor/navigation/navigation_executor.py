"""The executor of missions that navigate by trees such as Nav2's: it knows the robot's pose, and what is selected."""

from __future__ import annotations

from typing import ClassVar

from regraft import Input
from regraft.bus_schema.messages.sensors import Odometry
from regraft.services.bt_executor.blackboard_feed import REFLECTED, Reflected
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.navigation.navigation_inputs import NAVIGATION, NavigationInputs


class NavigationExecutor(NavigationInputs, Executor):
    """Runs missions that decide by where the robot is.

    Its root blackboard has ``robot_pose``, ``robot_speed`` and ``initial_pose_received`` besides the executor's
    entries, and what GoalUpdater takes. Nav2's selectors read the inputs named after them. A mission continues while
    nobody knows the pose.
    """

    odometry = Input(
        Odometry, latest_only=True, required=False, description="for {@robot_pose} and {@robot_speed}, where it comes"
    )

    reflected: ClassVar[tuple[Reflected, ...]] = (*REFLECTED, *NAVIGATION)
