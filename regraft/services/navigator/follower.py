"""Brings the robot to one goal: planning, following, recovering, turning to the goal's heading."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from regraft.planar import Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.local_controller import Controller, Decision, Situation
from regraft.services.navigator.driving.recovery import ProgressMonitor, Recovery
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.driving.rollout_controller import RolloutController
from regraft.services.navigator.planning.grid_planner import GridPlanner, Path
from regraft.services.navigator.planning.route import Route
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.senses import (
    LOST_TIMEOUT,
    SCAN_TEXTS,
    SILENT_TIMEOUT,
    Fault,
    MotionWatch,
    ScanFault,
    ScanWatch,
)
from regraft.services.navigator.sensing.sight import Sight

Phase = Literal["idle", "driving", "turning", "recovering", "waiting", "arrived", "failed"]

STATE_VERSION = 5
DEFAULT_PERIOD = 0.05  # s, at the first update, when no other is known
# A drive that takes longer than this and SLOWNESS times the first path's time is given up.
PATIENCE = 60.0  # s
SLOWNESS = 5.0
HOLD = 1.5  # s to stand when commands move nothing, before a recovery tries whether they do again
IMPOSSIBLE_FOR = 5.0  # s without a way on the map until a drive is given up: the next map may correct it


@dataclass(frozen=True, slots=True)
class Tolerances:
    """When a goal counts as reached, and how long to put up with what.

    `position` (m) and `yaw` (rad) around where the robot drives; `goal` (m): how far from a goal at which the robot
    cannot be, it may be sent instead; `replan` (s) between plans; a scan older than `blind` (s) fails the drive.
    """

    position: float = 0.08
    yaw: float = 0.10
    goal: float = 0.5
    replan: float = 1.0
    blind: float = 10.0


@dataclass(frozen=True, slots=True)
class Command:
    """The present action: the twist to command (m/s, rad/s), and the state of the drive.

    `distance_left` (m) along the path and `time_left` (s) are estimates. `recoveries` counts since the start of the
    drive. `reason` states why `phase` is `failed`. `faults` are what is wrong now.
    """

    v: float
    w: float
    phase: Phase
    distance_left: float = 0.0
    time_left: float = 0.0
    recoveries: int = 0
    reason: str = ""
    faults: tuple[Fault, ...] = ()

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

    A scan that is older than `scan_timeout` (s) stops the robot. It and `limits` may be changed at any time, and hold
    from the next update on.
    """

    def __init__(
        self,
        planner: GridPlanner,
        limits: Limits,
        controller: Controller | None = None,
        tolerances: Tolerances | None = None,
    ) -> None:
        """Wait on one map; give a goal with `start`."""
        self.limits = limits
        self.scan_timeout = SILENT_TIMEOUT
        self._planner = planner
        self._controller = controller or RolloutController()
        self._tolerances = tolerances or Tolerances()
        self._sight = Sight(self._controller.manoeuvres.footprint.half_width)
        self._scans = ScanWatch()
        self._motion = MotionWatch()
        self._time: float | None = None
        self._stamp = -math.inf
        self._told = Twist2D()
        self._waiting_since: float | None
        self._held_since: float | None
        self._held_until: float | None
        self._begin("idle", None)

    @property
    def planner(self) -> GridPlanner:
        """The planner with the current map; another one may be set at any time, also under way."""
        return self._planner

    @planner.setter
    def planner(self, planner: GridPlanner) -> None:
        self._planner = planner
        self._route.use(planner)
        self._sight.reconsider(planner)

    @property
    def path(self) -> Path:
        """The path that is being followed, (N, 2) in m; empty before the first plan."""
        return self._route.path

    def start(self, goal: Pose2D) -> None:
        """Drive to `goal` (map frame) from the next update on, instead of to any goal before."""
        self._begin("driving", goal)

    def cancel(self) -> None:
        """Give the goal up; the next updates brake."""
        self._begin("idle", None)

    def update(
        self, time: float, pose: Pose2D, twist: Twist2D, scan: Scan | None, stamp: float | None = None
    ) -> Command:
        """Return the command for now.

        `time` (s) is the component's clock. `pose` is the robot in the map's frame and `twist` its measured motion,
        both at `stamp` (s; now if left out). `scan` is the latest scan, the same one again until there is another.
        """
        elapsed = DEFAULT_PERIOD if self._time is None else time - self._time
        period = min(max(elapsed, 0.01), 0.2)
        self._time = time
        lost = self._perceive(time, time if stamp is None else stamp, pose, twist, scan)
        decision = self._decide(time, Situation(pose, twist, self._sight.obstacles, self.limits, period), lost)
        self._turning = decision.turning
        return self._command(decision.twist, pose, lost)

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as plain data; the map and the limits are not part of it."""
        goal = self._goal
        return {
            "version": STATE_VERSION,
            "time": self._time,
            "goal": None if goal is None else [goal.x, goal.y, goal.yaw],
            "phase": self._phase,
            "reason": self._reason,
            "hindrance": self._hindrance,
            "waiting_since": self._waiting_since,
            "held": [self._held_since, self._held_until],
            "spent": [self._spent, self._speed],
            "turning": self._turning,
            "told": [self._told.v, self._told.w],
            **{name: part.snapshot() for name, part in self._parts().items()},
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a snapshot. Raises ValueError for another version's state."""
        if state.get("version") != STATE_VERSION:
            raise ValueError(f"the state has version {state.get('version')}, not {STATE_VERSION}")
        self._begin(state["phase"], None if state["goal"] is None else Pose2D(*state["goal"]))
        self._time, self._reason, self._hindrance = state["time"], state["reason"], state["hindrance"]
        self._spent, self._speed = state["spent"]
        self._waiting_since = state["waiting_since"]
        self._held_since, self._held_until = state["held"]
        self._turning, self._told = state["turning"], Twist2D(*state["told"])
        for name, part in self._parts().items():
            part.restore(state[name])

    def _parts(self) -> dict[str, Any]:
        """Return what keeps a state of its own."""
        return {
            "route": self._route,
            "sight": self._sight,
            "scans": self._scans,
            "motion": self._motion,
            "monitor": self._monitor,
            "recovery": self._recovery,
        }

    def _begin(self, phase: Phase, goal: Pose2D | None) -> None:
        self._phase: Phase = phase
        self._goal = goal
        self._reason = ""
        # The reason that a stuck robot can give besides the last plan's error: the obstacle that the controller met.
        self._hindrance = ""
        self._waiting_since = None
        self._held_since = None
        self._held_until = None
        self._spent, self._speed = 0.0, 0.0  # s, at this greatest speed (m/s)
        self._turning = False
        half_width = self._controller.manoeuvres.footprint.half_width
        self._route = Route(self._tolerances.replan, self._tolerances.goal, half_width)
        self._monitor = ProgressMonitor()
        self._recovery = Recovery()
        self._motion.reset()

    def _perceive(self, time: float, stamp: float, pose: Pose2D, twist: Twist2D, scan: Scan | None) -> Fault | None:
        """Take in what the sensors report; return their fault, with which the robot cannot drive."""
        self._stamp = stamp
        if scan is not None and self._scans.is_new(scan):
            self._scans.look(self._sight.pose, scan, pose, self._planner)
        self._scans.check(time, self.scan_timeout)
        self._sight.absorb(stamp, pose, twist, None if self._scans.text else scan, self._planner)
        if time - stamp > LOST_TIMEOUT:
            return Fault("odometry", "no odometry comes")
        return Fault("scan", self._scans.text) if self._scans.text else None

    def _decide(self, time: float, now: Situation, lost: Fault | None) -> Decision:
        stop = self._controller.manoeuvres.stop(now)
        if self._goal is None or self._phase in ("arrived", "failed"):
            return stop
        # Without a trustworthy odometry, braking starts from the latest command.
        brake = Decision(now.limits.approach(self._told, Twist2D(), now.period))
        if lost is not None or self._sight.stamp == -math.inf:
            self._wait(time, lost.text if lost else SCAN_TEXTS[ScanFault.SILENT])
            return brake
        self._resume()
        if not self._keep_planned(time, now.pose, self._goal) or self._held(time, now):
            return brake
        self._recovery.watch(now.pose)
        if self._recovery.active:
            return self._recover(time, now) or stop
        if self._allowed_to_drive() and self._in_trouble(time, now):
            return stop
        return self._drive(now, self._goal)

    def _wait(self, time: float, why: str) -> None:
        """Stand, as the robot can't know what it would do; give up after a while."""
        self._monitor.reset()
        self._motion.reset()
        self._phase = "waiting"
        if self._waiting_since is None:
            self._waiting_since = time
        if time - self._waiting_since > self._tolerances.blind:
            self._fail(f"{why}, for {self._tolerances.blind:.0f} s")

    def _resume(self) -> None:
        if self._waiting_since is not None:
            self._waiting_since = None
            self._phase = "recovering" if self._recovery.active else "driving"

    def _keep_planned(self, time: float, pose: Pose2D, goal: Pose2D) -> bool:
        """Plan where that is due; return whether there is a path to follow."""
        if self._recovery.active:
            return True
        route = self._route
        has_path = route.keep(time, pose, goal, self._planner, self._sight.unmapped)
        since = route.impossible_since
        if since is not None and (not has_path or time - since > IMPOSSIBLE_FOR):
            self._fail(route.no_path)
            return False
        return has_path

    def _held(self, time: float, now: Situation) -> bool:
        """Stand for a while when motion is not what it should be, then try again; return whether to stand."""
        if self._motion.check(self._stamp, now.pose, now.twist, self._told):
            self._motion.reset()
            self._held_since = time if self._held_since is None else self._held_since
            self._held_until = time + HOLD
        fault = self._motion.fault
        if self._held_since is None or self._held_until is None or fault is None:
            return False
        self._phase = "waiting"
        if time - self._held_since > self._tolerances.blind:
            self._fail(f"{fault.text}, for {self._tolerances.blind:.0f} s")
        elif time >= self._held_until:
            self._held_since = self._held_until = None
            self._motion.reset()
            self._try_recovery(time, now, fault.text)
        return True

    def _drive(self, now: Situation, goal: Pose2D) -> Decision:
        end = self._route.path[-1]
        # Turning in place may shift the robot a little: that need not be driven back.
        slack = 2.0 if self._phase == "turning" else 1.0
        if math.hypot(now.pose.x - end[0], now.pose.y - end[1]) > slack * self._tolerances.position:
            self._phase = "driving"
            decision = self._controller.follow(now, self._route.path, self._turning)
            self._hindrance = "obstacles block the path" if decision.blocked else ""
            return decision
        self._phase = "turning"
        if abs(wrap_angle(goal.yaw - now.pose.yaw)) <= self._tolerances.yaw:
            self._phase = "arrived"
            return self._controller.manoeuvres.stop(now)
        decision = self._controller.manoeuvres.turn(now, goal.yaw)
        self._hindrance = "obstacles leave no room to turn to the goal's heading" if decision.blocked else ""
        return decision

    def _allowed_to_drive(self) -> bool:
        """Return whether the robot can make progress at all; standing is no trouble otherwise."""
        if self.limits.max_velocity == 0.0:
            self._monitor.reset()
        return self.limits.max_velocity > 0.0

    def _in_trouble(self, time: float, now: Situation) -> bool:
        """Start a recovery or give up where the robot is stuck or too slow; return whether that is so."""
        allowed = self._allowed(self.limits.max_velocity)
        if self._speed not in (0.0, self.limits.max_velocity):
            # Time that was spent at another speed stays as large a share as it was then.
            self._spent *= allowed / self._allowed(self._speed)
        self._spent, self._speed = self._spent + now.period, self.limits.max_velocity
        why = self._route.no_path or self._hindrance
        if self._spent > allowed:
            self._fail(f"the drive took longer than {allowed:.0f} s: {why or 'no steady progress'}")
            return True
        # In the track's frame, where a corrected pose is no progress.
        if not self._monitor.stuck(time, self._sight.pose, self.limits.max_velocity):
            return False
        self._try_recovery(time, now, why or "something keeps the robot from moving")
        return True

    def _allowed(self, speed: float) -> float:
        """Return how long (s) a drive may take at a greatest speed (m/s)."""
        return PATIENCE + SLOWNESS * self._route.first_length / speed

    def _try_recovery(self, time: float, now: Situation, why: str) -> None:
        if self._recovery.exhausted:
            where = f"({now.pose.x:.2f}, {now.pose.y:.2f})"
            self._fail(f"stuck at {where} after {self._recovery.attempts} recoveries: {why}")
        else:
            self._recovery.begin(time, now, self._controller.manoeuvres)
            self._phase = "recovering"

    def _recover(self, time: float, now: Situation) -> Decision | None:
        decision = self._recovery.step(time, now, self._controller.manoeuvres)
        if decision is None:
            self._monitor.reset()
            self._route.renew()
            self._phase = "driving"
        return decision

    def _fail(self, reason: str) -> None:
        self._phase, self._reason = "failed", reason

    def _command(self, twist: Twist2D, pose: Pose2D, lost: Fault | None) -> Command:
        faults = [] if lost is None else [lost]
        if self._motion.fault is not None:
            faults.append(self._motion.fault)
        self._told = twist
        if self._goal is None or self._phase in ("arrived", "failed"):
            # Exactly standing, for callers who stop asking now.
            self._told = Twist2D()
            return Command(0.0, 0.0, self._phase, 0.0, 0.0, self._recovery.total, self._reason, tuple(faults))
        distance, time_left = self._left(pose)
        return Command(twist.v, twist.w, self._phase, distance, time_left, self._recovery.total, faults=tuple(faults))

    def _left(self, pose: Pose2D) -> tuple[float, float]:
        """Return how far (m) and for how long (s) it still is; 0 before there is a path."""
        if self._goal is None or not len(self._route.path):
            return 0.0, 0.0
        distance = self._route.distance_left(pose)
        turn = abs(wrap_angle(self._goal.yaw - pose.yaw)) / self.limits.max_turn_rate
        speed = self.limits.max_velocity
        return distance, distance / speed + turn if speed > 0.0 else math.inf
