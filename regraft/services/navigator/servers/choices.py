"""The controllers and checkers that a goal can choose by name, as Nav2's plugins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, TypeVar

from regraft.bus_schema.messages.nav2.paths import FollowPath
from regraft.bus_schema.suggestions import near
from regraft.services.navigator.driving.local_controller import Controller, Manoeuvres
from regraft.services.navigator.driving.pursuit import PursuitController
from regraft.services.navigator.driving.recovery import ProgressMonitor
from regraft.services.navigator.driving.rollout_controller import RolloutController
from regraft.services.navigator.servers.following import Following, GoalCheck
from regraft.services.navigator.servers.motion import Patience

V = TypeVar("V")

CONTROLLERS: Final[dict[str, Callable[[Manoeuvres], Controller]]] = {
    "FollowPath": RolloutController,
    "PurePursuit": PursuitController,
}
"""The controllers by name; the first is the default. ``FollowPath`` leaves the path around what is in the way."""
GOAL_CHECKERS: Final = ("general_goal_checker", "position_goal_checker", "stopped_goal_checker")
"""Position and heading; position alone; position and heading of a robot that stands."""
PROGRESS_CHECKERS: Final = {"progress_checker": math.inf, "pose_progress_checker": 0.5}
"""The turn (rad) that is progress too; only the second counts turns."""
PATH_HANDLERS: Final = {"PathHandler": None}
"""Nav2's name of the only one: all of the path is followed, from the nearest of its poses on."""


class BadChoice(ValueError):
    """A name that nothing has; the text has the names that there are."""


@dataclass(slots=True)
class FollowChoices:
    """Makes the motion of a goal: tolerances in m and rad, and ``progress`` as distance (m) and time (s)."""

    manoeuvres: Manoeuvres
    goal_distance: float = 0.08
    goal_angle: float = 0.10
    progress: tuple[float, float] = (0.1, 8.0)

    def following(
        self, goal: FollowPath, before: Following | None, blocked: Patience, sightless: Patience
    ) -> Following:
        """Return the motion that a goal asks for; raises BadChoice.

        ``before`` is the motion along another path that it replaces. The time without progress continues: a robot
        that is given a path each second can be stuck nevertheless.
        """
        _, controller = _chosen("controller", goal.controller, CONTROLLERS)
        checker, _ = _chosen("goal checker", goal.goal_checker, dict.fromkeys(GOAL_CHECKERS))
        _, turn = _chosen("progress checker", goal.progress_checker, PROGRESS_CHECKERS)
        _chosen("path handler", goal.path_handler, PATH_HANDLERS)
        angle = math.inf if checker == "position_goal_checker" else self.goal_angle
        check = GoalCheck(self.goal_distance, angle, standing=checker == "stopped_goal_checker")
        distance, time = self.progress
        progress = ProgressMonitor(time, distance, turn)
        if before is not None and before.ended is None:
            progress.restore(before.progress.snapshot())
            blocked.since = before.blocked.since
            sightless.since = before.sightless.since
        return Following(goal.path.rows, controller(self.manoeuvres), check, progress, blocked, sightless)


def _chosen(what: str, name: str, known: Mapping[str, V]) -> tuple[str, V]:
    chosen = name or next(iter(known))
    if chosen not in known:
        meant = near(chosen, known)
        hint = f"; did you mean {meant!r}?" if meant else ""
        raise BadChoice(f"there is no {what} {chosen!r}; there is: {', '.join(known)}{hint}")
    return chosen, known[chosen]
