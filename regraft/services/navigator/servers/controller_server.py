"""The controller server: following paths as an action of its own, besides the single motions."""

from __future__ import annotations

import math

from regraft import Parameter, Quality, action, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.nav2.motions import CancelGoals, GoalsCancelled
from regraft.bus_schema.messages.nav2.paths import (
    ClearCostmap,
    CostmapCleared,
    FollowError,
    FollowPath,
    PathFollowed,
    TrackingFeedback,
)
from regraft.bus_schema.model.description import Resources
from regraft.services.navigator.normalized_qualities import RecentWay, safety
from regraft.services.navigator.servers.behaviour_server import BehaviourServer
from regraft.services.navigator.servers.choices import BadChoice, FollowChoices
from regraft.services.navigator.servers.following import Following
from regraft.services.navigator.servers.motion import Patience
from regraft.services.navigator.servers.surroundings import Area, check_frame


class ControllerServer(BehaviourServer):
    """Drives along paths that it is given, and does the behaviour server's motions: a robot has one drive.

    It plans nothing. A newer motion replaces the one before, of whichever action. Names and error codes are those of
    Nav2's controller server and local costmap.
    """

    resources = Resources(cpu=0.05, memory=30.0)
    evaluate_every = 0.5

    goal_distance = Parameter(0.08, "how near to a path's end is there", minimum=0.02, maximum=1.0, unit="m")
    goal_angle = Parameter(0.10, "how near to its heading is there", minimum=0.02, maximum=3.2, unit="rad")
    progress_distance = Parameter(0.1, "how far a robot that follows a path gets on", minimum=0.01, unit="m")
    progress_time = Parameter(8.0, "within which time it gets on so far", minimum=1.0, unit="s")
    failure_tolerance = Parameter(2.0, "for how long obstacles may block every way on", minimum=0.0, unit="s")

    safety = Quality(
        "share of the ample distance that is left when the robot brakes", better="higher", minimum=0.0, maximum=1.0
    )
    performance = Quality(
        "best possible time over the time taken, of the last way", better="higher", minimum=0.0, maximum=1.0
    )
    clearance = Quality("of the robot's rim", unit="m", better="higher", minimum=0.0, estimated=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``performance`` of driving straight on as fast as allowed, and its ``safety``.

        ``context`` may give the ``clearance`` (m) of the way. The safety is left out without it.
        """
        speed = float(parameters.get("max_velocity", cls.max_velocity.default))
        limit = float(parameters.get("velocity_limit", cls.velocity_limit.default))
        braking = float(parameters.get("acceleration", cls.acceleration.default))
        qualities = {"performance": min(speed / limit, 1.0)}
        clearance = context.get("clearance")
        return qualities if clearance is None else qualities | {"safety": safety(float(clearance), speed, braking)}

    def on_configure(self) -> None:
        """Begin without a way."""
        super().on_configure()
        self._way = RecentWay()

    def evaluate(self) -> dict[str, float]:
        """Return the ``clearance`` (m), the ``safety`` at the present speed, and the ``performance`` on a path.

        `normalized_qualities` has the formulas. Without an obstacle anywhere, the clearance is left out.
        """
        seen = self._surroundings
        if seen.missing():
            return {}
        gap = max(seen.room() - self.radius, 0.0)
        measured = {"safety": safety(gap, seen.twist.v, self.acceleration)}
        if math.isfinite(gap):
            measured["clearance"] = gap
        performance = self._way.performance(self.velocity_limit)
        return measured if performance is None else measured | {"performance": performance}

    def _look(self) -> None:
        """Take in what has come, and how far the robot gets: the time of recoveries counts, but not their ways."""
        super()._look()
        seen = self._surroundings
        if self._motion is not None:
            self._way.take(seen.stamp, seen.twist.v if isinstance(self._motion, Following) else 0.0)
        else:
            self._way.rest(seen.stamp)

    @action("follow_path", feedback=TrackingFeedback)
    async def follow_path(self, goal: FollowPath) -> PathFollowed:
        """Drive along a path to its end."""
        await self._get_ready()
        if not len(goal.path.poses):
            return PathFollowed(int(FollowError.INVALID_PATH), "the path has no poses; it needs at least one")
        try:
            check_frame("path", goal.path.frame)
            following = self._following(goal)
        except BadChoice as error:
            return PathFollowed(int(FollowError.INVALID_CONTROLLER), str(error))
        except ValueError as error:
            return PathFollowed(int(FollowError.NO_POSE), str(error))
        ended = await self._carry_out("follow_path", following, self._tracking)
        return PathFollowed(int(ended.code), ended.why, ended.cancelled)

    @service("follow_path/cancel")
    def cancel_follow_path(self, request: CancelGoals) -> GoalsCancelled:
        """End following a path."""
        return self._cancel("follow_path")

    @service("local_costmap/clear_entirely_local_costmap")
    def clear_costmap(self, request: ClearCostmap) -> CostmapCleared:
        """Forget all obstacles that were seen before the latest scan."""
        return self._forget(request, Area.EVERYWHERE)

    @service("local_costmap/clear_except_local_costmap")
    def clear_except(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen outside of a square around the robot."""
        return self._forget(request, Area.OUTSIDE)

    @service("local_costmap/clear_around_local_costmap")
    def clear_around(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen in a square around the robot."""
        return self._forget(request, Area.AROUND_ROBOT)

    @service("local_costmap/clear_around_pose_local_costmap")
    def clear_around_pose(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen in a square around a pose."""
        return self._forget(request, Area.AROUND_POSE)

    def _following(self, goal: FollowPath) -> Following:
        """Return the motion along a path; raises BadChoice."""
        progress = (self.progress_distance, self.progress_time)
        choices = FollowChoices(self._manoeuvres, self.goal_distance, self.goal_angle, progress)
        before = self._replaced()
        tolerances = Patience(self.failure_tolerance), Patience(self.blind)
        return choices.following(goal, before if isinstance(before, Following) else None, *tolerances)

    def _tracking(self, following: Following) -> TrackingFeedback:
        return following.tracking(self._surroundings.pose, abs(self._surroundings.twist.v))
