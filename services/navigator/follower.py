"""Brings the robot to one goal: planning, following, recovering, turning to the goal's heading."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from services.navigator.controller import Decision, LocalController, Situation
from services.navigator.geometry import FloatArray, Point, Pose, Twist, polyline_length, wrap_angle
from services.navigator.planner import NO_POINTS, GridPlanner, NoPath, Path
from services.navigator.recovery import ProgressMonitor, Recovery
from services.navigator.robot import Limits
from services.navigator.scan import Scan
from services.navigator.sight import Sight

Phase = Literal["idle", "driving", "turning", "recovering", "arrived", "failed"]

STATE_VERSION = 1
DEFAULT_PERIOD = 0.05  # s, at the first update, when no other is known
# The path ahead is watched for obstacles this far and this much to each side (half a Waffle and a margin).
WATCHED_AHEAD = 1.5
WATCHED_ASIDE = 0.18
# A new path is taken only if it costs this much less, lest the robot dither between two equally good ones.
CHEAPER = 0.95
OFF_PATH = 0.15  # m
# A drive that takes longer than this and SLOWNESS times the first path's time is given up.
PATIENCE = 60.0  # s
SLOWNESS = 5.0


@dataclass(frozen=True, slots=True)
class Tolerances:
    """When a goal counts as reached, and how long to put up with what.

    `position` (m) and `yaw` (rad) around where the robot drives; `goal` (m): how far from a goal at which
    the robot can't stand it may be sent instead; `replan` (s) between plans; a scan older than `scan` (s)
    stops the robot, and one older than `blind` (s) fails the drive.
    """

    position: float = 0.08
    yaw: float = 0.10
    goal: float = 0.5
    replan: float = 1.0
    scan: float = 1.0
    blind: float = 10.0


@dataclass(frozen=True, slots=True)
class Command:
    """What to do now: the twist to command (m/s, rad/s), and how the drive stands.

    `distance_left` (m) along the path and `time_left` (s) are estimates. `recoveries` counts since the
    start of the drive. `reason` says why, where `phase` is `failed`.
    """

    v: float
    w: float
    phase: Phase
    distance_left: float = 0.0
    time_left: float = 0.0
    recoveries: int = 0
    reason: str = ""

    @property
    def done(self) -> bool:
        """Whether the goal is reached."""
        return self.phase == "arrived"

    @property
    def failed(self) -> bool:
        """Whether the drive was given up."""
        return self.phase == "failed"


class Follower:
    """Drives to one goal at a time. Deterministic: equal calls from equal states give equal commands.

    `limits` may be changed at any time and holds from the next update on.
    """

    def __init__(
        self,
        planner: GridPlanner,
        limits: Limits,
        controller: LocalController | None = None,
        tolerances: Tolerances | None = None,
    ) -> None:
        """Stand ready on one map; give a goal with `start`."""
        self.limits = limits
        self._planner = planner
        self._controller = controller or LocalController()
        self._tolerances = tolerances or Tolerances()
        self._sight = Sight()
        self._time: float | None = None
        self._path: Path
        self._target: Point | None
        self._started_at: float | None
        self._begin("idle", None)

    @property
    def planner(self) -> GridPlanner:
        """The planner with the current map; setting another one replans at the next update."""
        return self._planner

    @planner.setter
    def planner(self, planner: GridPlanner) -> None:
        self._planner = planner
        self._planned_at = -math.inf
        self._target = None
        self._sight.forget()

    @property
    def path(self) -> Path:
        """The path that is being followed, (N, 2) in m; empty before the first plan."""
        return self._path

    def start(self, goal: Pose) -> None:
        """Drive to `goal` (map frame) from the next update on, instead of to any goal before."""
        self._begin("driving", goal)

    def cancel(self) -> None:
        """Give the goal up; the next updates brake."""
        self._begin("idle", None)

    def update(self, time: float, pose: Pose, twist: Twist, scan: Scan | None) -> Command:
        """Return the command for now.

        `time` (s) is the component's clock, `pose` the robot in the map's frame, `twist` its measured
        motion, `scan` the latest scan, the same one again until there is another.
        """
        elapsed = DEFAULT_PERIOD if self._time is None else time - self._time
        period = min(max(elapsed, 0.01), 0.2)
        self._time = time
        self._sight.absorb(time, pose, scan, self._planner)
        decision = self._decide(time, Situation(pose, twist, self._sight.obstacles, self.limits, period))
        self._turning = decision.turning
        return self._command(decision.twist, pose)

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as plain data; the map and the limits are not part of it."""
        goal = self._goal
        return {
            "version": STATE_VERSION,
            "time": self._time,
            "goal": None if goal is None else [goal.x, goal.y, goal.yaw],
            "phase": self._phase,
            "reason": self._reason,
            "no_path": self._no_path,
            "hindrance": self._hindrance,
            "path": self._path.tolist(),
            "target": None if self._target is None else list(self._target),
            "started_at": self._started_at,
            "planned_at": self._planned_at,
            "spent": self._spent,
            "first_length": self._first_length,
            "turning": self._turning,
            "sight": self._sight.snapshot(),
            "monitor": self._monitor.snapshot(),
            "recovery": self._recovery.snapshot(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a snapshot. Raises ValueError for another version's state."""
        if state.get("version") != STATE_VERSION:
            raise ValueError(f"the state has version {state.get('version')}, not {STATE_VERSION}")
        self._begin(state["phase"], None if state["goal"] is None else Pose(*state["goal"]))
        self._time, self._reason = state["time"], state["reason"]
        self._no_path, self._hindrance = state["no_path"], state["hindrance"]
        self._path = np.array(state["path"], dtype=np.float64).reshape(-1, 2)
        self._target = None if state["target"] is None else (state["target"][0], state["target"][1])
        self._started_at, self._planned_at = state["started_at"], state["planned_at"]
        self._spent, self._first_length = state["spent"], state["first_length"]
        self._turning = state["turning"]
        self._sight.restore(state["sight"])
        self._monitor.restore(state["monitor"])
        self._recovery.restore(state["recovery"])

    def _begin(self, phase: Phase, goal: Pose | None) -> None:
        self._phase: Phase = phase
        self._goal = goal
        self._reason = ""
        # What a stuck robot can say: the last plan's error, and what the controller met.
        self._no_path = ""
        self._hindrance = ""
        self._path = NO_POINTS
        self._target = None
        self._started_at = None
        self._planned_at = -math.inf
        self._spent = 0.0
        self._first_length = 0.0
        self._turning = False
        self._monitor = ProgressMonitor()
        self._recovery = Recovery()

    def _decide(self, time: float, now: Situation) -> Decision:
        stop = self._controller.stop(now)
        if self._goal is None or self._phase in ("arrived", "failed"):
            return stop
        if self._started_at is None:
            self._started_at = time
        if time - self._sight.stamp > self._tolerances.scan:
            self._wait_for_sight(time, self._started_at)
            return stop
        if not self._keep_planned(time, now.pose, self._goal):
            return stop
        self._recovery.watch(now.pose)
        if self._recovery.active:
            return self._recover(time, now) or stop
        if self._allowed_to_drive() and self._in_trouble(time, now):
            return stop
        return self._drive(now, self._goal)

    def _wait_for_sight(self, time: float, started_at: float) -> None:
        self._monitor.reset()
        blind_for = time - max(started_at, self._sight.stamp)
        if blind_for > self._tolerances.blind:
            self._fail(f"no laser scan for {blind_for:.0f} s")

    def _drive(self, now: Situation, goal: Pose) -> Decision:
        end = self._path[-1]
        # Turning in place may shift the robot a little: that need not be driven back.
        slack = 2.0 if self._phase == "turning" else 1.0
        if math.hypot(now.pose.x - end[0], now.pose.y - end[1]) > slack * self._tolerances.position:
            self._phase = "driving"
            decision = self._controller.follow(now, self._path, self._turning)
            self._hindrance = "obstacles block the path" if decision.blocked else ""
            return decision
        self._phase = "turning"
        if abs(wrap_angle(goal.yaw - now.pose.yaw)) <= self._tolerances.yaw:
            self._phase = "arrived"
            return self._controller.stop(now)
        decision = self._controller.turn(now, goal.yaw)
        self._hindrance = "obstacles leave no room to turn to the goal's heading" if decision.blocked else ""
        return decision

    def _allowed_to_drive(self) -> bool:
        """Tell whether the robot can make progress at all; standing is no trouble otherwise."""
        if self.limits.max_velocity == 0.0:
            self._monitor.reset()
        return self.limits.max_velocity > 0.0

    def _in_trouble(self, time: float, now: Situation) -> bool:
        """Start a recovery or give up where the robot is stuck or too slow; tell whether that is so."""
        self._spent += now.period
        allowed = PATIENCE + SLOWNESS * self._first_length / self.limits.max_velocity
        if self._spent > allowed:
            why = self._no_path or self._hindrance or "no steady progress"
            self._fail(f"the drive took longer than {allowed:.0f} s: {why}")
            return True
        if not self._monitor.stuck(time, now.pose, self.limits.max_velocity):
            return False
        if self._recovery.exhausted:
            why = self._no_path or self._hindrance or "something keeps the robot from moving"
            where = f"({now.pose.x:.2f}, {now.pose.y:.2f})"
            self._fail(f"stuck at {where} after {self._recovery.attempts} recoveries: {why}")
        else:
            self._recovery.begin(time, now, self._controller)
            self._phase = "recovering"
        return True

    def _recover(self, time: float, now: Situation) -> Decision | None:
        decision = self._recovery.step(time, now, self._controller)
        if decision is None:
            self._monitor.reset()
            self._planned_at = -math.inf
            self._phase = "driving"
        return decision

    def _fail(self, reason: str) -> None:
        self._phase, self._reason = "failed", reason

    def _keep_planned(self, time: float, pose: Pose, goal: Pose) -> bool:
        """Plan where that is due; tell whether there is a path to follow."""
        since = time - self._planned_at
        blocked = since >= 0.3 and self._blocked(pose)
        if not self._recovery.active and (blocked or not 0.0 <= since < self._tolerances.replan):
            self._planned_at = time
            try:
                self._replan(pose, goal, blocked)
            except NoPath as error:
                self._no_path = str(error)
                if not len(self._path):
                    self._fail(str(error))
        return len(self._path) > 0

    def _replan(self, pose: Pose, goal: Pose, blocked: bool) -> None:
        if self._target is None:
            target = self._planner.approach(pose.position, goal.position, self._tolerances.goal)
            self._first_length = polyline_length(self._planner.plan(pose.position, target))
            self._target = target
        try:
            path = self._planner.plan(pose.position, self._target, self._sight.unmapped)
            self._no_path = ""
        except NoPath as error:
            # What blocks the way may be someone who will leave: go as near as the obstacles allow.
            path = self._planner.plan(pose.position, self._target)
            self._no_path = str(error)
        old = self._remaining(pose)
        off = len(old) == 0 or math.hypot(old[0, 0] - pose.x, old[0, 1] - pose.y) > OFF_PATH
        if off or blocked or self._cost(path) < CHEAPER * self._cost(old):
            self._path = path

    def _cost(self, path: Path) -> float:
        return self._planner.cost(path, self._sight.unmapped)

    def _remaining(self, pose: Pose) -> FloatArray:
        if not len(self._path):
            return self._path
        nearest = np.hypot(self._path[:, 0] - pose.x, self._path[:, 1] - pose.y).argmin()
        return self._path[nearest:]

    def _blocked(self, pose: Pose) -> bool:
        """Tell whether something that the map lacks stands on the path ahead."""
        unmapped = self._sight.unmapped
        ahead = self._remaining(pose)[::2]
        if not len(unmapped) or not len(ahead):
            return False
        ahead = ahead[np.hypot(ahead[:, 0] - pose.x, ahead[:, 1] - pose.y) <= WATCHED_AHEAD]
        gaps = np.hypot(ahead[:, None, 0] - unmapped[None, :, 0], ahead[:, None, 1] - unmapped[None, :, 1])
        return bool(gaps.min(initial=math.inf) < WATCHED_ASIDE)

    def _command(self, twist: Twist, pose: Pose) -> Command:
        if self._goal is None or self._phase in ("arrived", "failed"):
            # Exactly standing, for callers who stop asking now.
            return Command(0.0, 0.0, self._phase, 0.0, 0.0, self._recovery.total, self._reason)
        if not len(self._path):
            return Command(twist.v, twist.w, self._phase)
        rest = self._remaining(pose)
        distance = math.hypot(rest[0, 0] - pose.x, rest[0, 1] - pose.y) + polyline_length(rest)
        turn = abs(wrap_angle(self._goal.yaw - pose.yaw)) / self.limits.max_turn_rate
        speed = self.limits.max_velocity
        time_left = distance / speed + turn if speed > 0.0 else math.inf
        return Command(twist.v, twist.w, self._phase, distance, time_left, self._recovery.total)
