"""Nav2's navigator: whole drives as actions, each by a behaviour tree."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from behavior_tree import RUNNING, SUCCESS, Blackboard, NodeError, Registry, Status, Tree
from regraft import Cancelled, Input, Parameter, ParameterError, RefusalCode, RequestRefused, action
from regraft.bus_schema.messages.nav2.navigate import (
    Navigated,
    NavigateError,
    NavigateThroughPoses,
    NavigateToPose,
    NavigationFeedback,
    WaypointState,
    WaypointStatus,
)
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.reflection import ReflectedEntries
from regraft.bus_schema.model.description import Resources
from regraft.services.bt_executor.blackboard_feed import BlackboardFeed, Reflected
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.leaves.nav2.poses import goals_of
from regraft.services.bt_executor.leaves.nav2.recoveries import ENTRY
from regraft.services.bt_executor.navigation.navigation_inputs import NAVIGATION, NavigationInputs
from regraft.services.bt_executor.node_types import node_types
from regraft.services.bt_executor.source import Source, Unloadable

LOOK_INTERVAL = 0.05
"""s between looks whether odometry has come."""
FEEDBACK_INTERVAL = 0.5
SOON = 0.001
MAX_TICKS_AT_ONCE = 100
THROUGH_POSES = 100
"""By how much the error codes of drives through poses are higher than `NavigateError`."""
FOREVER = 1e6
"""s, for a drive that does not get on: a message carries finite numbers."""
CODE, TEXT = "_error_code", "_error_msg"
"""The endings of entries in which a tree keeps its leaves' errors."""

Entries = dict[str, Any]


@dataclass(slots=True)
class _Drive:
    """A tree that drives, and the file that it is from."""

    file: Path
    tree: Tree
    started: float
    first: tuple[float, float] | None = None
    """When (s) there was a path first, and how long (m) it was."""


Tell = Callable[[_Drive, float], object]
"""Returns the feedback on a drive at a time (s)."""


class BtNavigator(NavigationInputs):
    """Drives to goals by behaviour trees such as Nav2's, which ask other components to plan and to move.

    The action ``navigate_to`` drives by the tree of ``navigate_to_pose`` goals that name none. It serves clients of the
    plain navigator, such as docking. A goal may name another tree of the folder that the default is in.

    A newer goal for the same tree changes its entry ``goal`` or ``goals``, without a stop. One for another tree halts
    it. While a goal is under way, goals of the other actions are refused as busy, as by Nav2's NavigatorMuxer: two
    trees would drive one robot. The result has the lowest error code that the tree has left in entries such as
    ``follow_path_error_code``.
    """

    resources = Resources(cpu=0.03, memory=25.0)
    handler_timeout = 3.0  # a tree as large as may be takes that long to load

    to_pose_tree = Parameter("", "the file with the tree for one pose", unit="path", exists=True)
    through_poses_tree = Parameter("", "the file with the tree for several poses", unit="path", exists=True)
    behavior_tree = Parameter(
        "", "the tree of goals for one pose that name none: a file in that folder; empty: 'to_pose_tree'"
    )
    rate = Parameter(
        20.0, "ticks of a tree a second; an answer is looked at in the next one", minimum=1.0, maximum=200.0, unit="Hz"
    )
    ready_within = Parameter(5.0, "how long a goal waits for the first odometry", minimum=0.0, unit="s")
    nodes = Parameter("", "further node types, as for the executor", read_only=True)

    battery = Input(BatteryState, latest_only=True, required=False, description="for IsBatteryLow")
    reflection = Input(
        ReflectedEntries, latest_only=True, required=False, description="for the entries that the stack maps"
    )

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Refuse a navigator without a tree: it could reach no goal."""
        if not (parameters["to_pose_tree"] or parameters["through_poses_tree"]):
            raise ParameterError([("to_pose_tree", "must name a file, or 'through_poses_tree' must: there is no tree")])

    def on_configure(self) -> None:
        """Learn the node types."""
        self._registry: Registry = node_types(LeafContext(self.kit, lambda: None), self.nodes.split())
        self._feed = BlackboardFeed(self.kit.inputs, _REFLECTED, self.kit.event)
        self._left: _Drive | None = None
        self._running = ""
        self._is_active = False

    def on_activate(self) -> None:
        """Take goals."""
        self._is_active = True

    @action("navigate_to_pose", feedback=NavigationFeedback)
    async def navigate_to_pose(self, goal: NavigateToPose) -> Navigated:
        """Drive to a pose."""
        tree = goal.behavior_tree or self.behavior_tree
        with self._alone("navigate_to_pose"):
            return await self._navigate(self.to_pose_tree, tree, {"goal": goal.pose}, 0)

    @action("navigate_to", feedback=NavigationProgress)
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Drive to a pose, and report whether the robot is there."""
        with self._alone("navigate_to"):
            done = await self._navigate(self.to_pose_tree, self.behavior_tree, {"goal": goal.goal}, 0, _progress)
        odometry = self.odometry.latest
        if odometry is None:
            raise RequestRefused(f"cannot drive: {done.error_msg}", RefusalCode.UNAVAILABLE)
        if done.error_code:
            return Arrival(False, odometry.pose, done.error_msg or f"the tree ended with the error {done.error_code}")
        return Arrival(True, odometry.pose)

    @action("navigate_through_poses", feedback=NavigationFeedback)
    async def navigate_through_poses(self, goal: NavigateThroughPoses) -> Navigated:
        """Drive through poses to the last of them."""
        if not goal.poses:
            raise RequestRefused("must have at least one pose", RefusalCode.INVALID, field="poses")
        statuses = [WaypointStatus(index, pose) for index, pose in enumerate(goal.poses)]
        entries = {"goals": list(goal.poses), "goal": goal.poses[-1], "waypoint_statuses": statuses}
        with self._alone("navigate_through_poses"):
            return await self._navigate(self.through_poses_tree, goal.behavior_tree, entries, THROUGH_POSES)

    @contextmanager
    def _alone(self, action: str) -> Iterator[None]:
        """Keep an action the only one that drives; raises RequestRefused while another one does."""
        # An action's own goal before has ended by now: a newer one replaces it.
        if self._running:
            why = f"{self._running} drives the robot: wait for its end, or cancel its goal"
            raise RequestRefused(why, RefusalCode.BUSY)
        self._running = action
        try:
            yield
        finally:
            self._running = ""

    async def _navigate(
        self, default: str, wanted: str, entries: Entries, offset: int, tell: Tell | None = None
    ) -> Navigated:
        deadline = self.kit.now() + self.ready_within
        while self.odometry.latest is None:
            if self.kit.now() >= deadline:
                why = f"no odometry has come within {self.ready_within:g} s"
                return Navigated(int(NavigateError.NO_POSE) + offset, why)
            await self.kit.sleep(LOOK_INTERVAL)
        try:
            drive = self._drive(self._file(default, wanted), entries)
        except Unloadable as error:
            return Navigated(int(NavigateError.BAD_TREE) + offset, str(error))
        try:
            status = await self._run(drive, tell or _feedback)
        except Cancelled:
            self._leave(drive)
            raise
        except NodeError as error:
            self._halt(drive)
            return Navigated(int(NavigateError.UNKNOWN) + offset, str(error))
        except Exception:
            self._halt(drive)
            raise
        return _result(drive.tree.blackboard, status, offset)

    def _file(self, default: str, wanted: str) -> Path:
        """Return the tree's file; raises Unloadable unless it is in the folder of the default."""
        if not default:
            raise Unloadable("there is no default tree: set the parameter 'to_pose_tree' or 'through_poses_tree'")
        folder = Path(default).resolve().parent
        file = (folder / (wanted or Path(default).name)).resolve()
        if file.parent != folder:
            raise Unloadable(f"behavior_tree: '{wanted}' must be a file in the folder '{folder}'")
        return file

    def _drive(self, file: Path, entries: Entries) -> _Drive:
        """Return the tree with the entries: that of the goal before, or another one. Raises Unloadable."""
        left = self._left
        if left is not None and left.file == file:
            drive = replace(left, first=None)
        else:
            self._left = None
            if left is not None:
                self._halt(left)
            board = Blackboard(clock=self.kit)
            self._feed.declare(board)
            for key in entries:
                board.declare(key)
            drive = _Drive(file, Source(str(file)).load(self._registry, board), self.kit.now())
            board.set(ENTRY, 0)
        for key, value in entries.items():
            _write(drive.tree.blackboard, key, value)
        # Not before it is whole: a tree that nobody has taken over is soon halted.
        self._left = None
        return drive

    async def _run(self, drive: _Drive, tell: Tell) -> Status:
        """Tick the tree until it is done, and report feedback."""
        told = self.kit.now()
        while True:
            self._feed.update(drive.tree.blackboard)
            status = drive.tree.tick_once(MAX_TICKS_AT_ONCE)
            if status != RUNNING:
                return status
            await self.kit.sleep(1.0 / self.rate)
            if self.kit.now() - told >= FEEDBACK_INTERVAL:
                told = self.kit.now()
                self.kit.feedback(tell(drive, told))

    def _leave(self, drive: _Drive) -> None:
        """Keep a tree that still runs for a newer goal, which comes at this moment or not at all."""
        if not self._is_active:
            self._halt(drive)
            return
        self._left = drive
        self.kit.spawn(self._halt_soon(drive), "halt of a tree")

    async def _halt_soon(self, left: _Drive) -> None:
        """Halt a tree whose goal was cancelled, unless a newer goal takes it over."""
        await self.kit.sleep(SOON)
        if self._left is left:
            self._left = None
            self._halt(left)

    def on_deactivate(self) -> None:
        """Halt the tree, which cancels its goals."""
        self._is_active = False
        if self._left is not None:
            self._halt(self._left)
            self._left = None

    def _halt(self, drive: _Drive) -> None:
        """Halt a tree. One that has an error there is halted nevertheless, and keeps no other goal from its drive."""
        try:
            drive.tree.halt_tree()
        except NodeError as error:
            self.kit.event("navigation.halt_failed", f"halting {drive.tree.tree_id}: {error}", tree=str(drive.file))


_REFLECTED: tuple[Reflected, ...] = NAVIGATION


def _feedback(drive: _Drive, now: float) -> NavigationFeedback:
    board = drive.tree.blackboard
    tracking = _value(board, "tracking_feedback")
    left = getattr(tracking, "remaining_path_length", 0.0)
    goals = goals_of(_value(board, "goals"))
    return NavigationFeedback(_value(board, "robot_pose"), now - drive.started, left, _value(board, ENTRY), len(goals))


def _progress(drive: _Drive, now: float) -> NavigationProgress:
    """Return how far it still is. The time left is what the rest takes at the mean speed so far."""
    told = _feedback(drive, now)
    left = told.distance_remaining
    if drive.first is None:
        if left <= 0.0:
            return NavigationProgress(0.0, FOREVER, "planning", told.recoveries)
        drive.first = (now, left)
    began, first_left = drive.first
    got_on = first_left - left
    time_left = min((now - began) * left / got_on, FOREVER) if got_on > 0.0 else FOREVER
    return NavigationProgress(left, time_left, "driving", told.recoveries)


def _result(board: Blackboard, status: Status, offset: int) -> Navigated:
    statuses: list[WaypointStatus] = _value(board, "waypoint_statuses") or []
    if status == SUCCESS:
        done = (replace(each, status=_done(each.status)) for each in statuses)
        return Navigated(waypoint_statuses=tuple(done))
    codes = {}
    for key, code in board.dump().items():
        if key.endswith(CODE) and isinstance(code, int) and code > 0:
            codes[code] = _value(board, key.removesuffix(CODE) + TEXT) or ""
    if not codes:
        return Navigated(int(NavigateError.UNKNOWN) + offset, "the tree has failed", tuple(statuses))
    return Navigated(min(codes), codes[min(codes)], tuple(statuses))


def _done(state: WaypointState) -> WaypointState:
    return WaypointState.COMPLETED if state is WaypointState.PENDING else state


def _write(board: Blackboard, key: str, value: Any) -> None:
    """Write an entry, to which a tree may have given another type, as GoalUpdater does."""
    entry = board.find(key)
    if entry is not None and entry.value is not None and not isinstance(value, type(entry.value)):
        entry.type = None
    board.set(key, value)


def _value(board: Blackboard, key: str) -> Any:
    entry = board.find(key)
    return entry.value if entry else None
