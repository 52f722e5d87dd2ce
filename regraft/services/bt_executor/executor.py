"""The component that runs missions: it ticks a behaviour tree whose leaves ask other components to act."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

from behavior_tree import Blackboard, Clock, ManualClock, Registry, Tree, TreeLibrary
from regraft import (
    Component,
    Input,
    NotActive,
    Output,
    Parameter,
    RefusalCode,
    RequestRefused,
    every,
    service,
)
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import SensorHealth, SystemStatus
from regraft.bus_schema.messages.maps import Goals
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardRequest,
    BreakpointsRequest,
    Command,
    MissionBreakpoints,
    MissionCommand,
    MissionCounts,
    MissionCountsRequest,
    MissionRequest,
    MissionState,
    MissionStatus,
    MissionTransitions,
    WriteBlackboard,
)
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.reflection import ReflectedEntries
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources
from regraft.services.bt_executor.blackboard_feed import REFLECTED, BlackboardFeed, Reflected
from regraft.services.bt_executor.boards import read_board, summary, write_board
from regraft.services.bt_executor.debugging.breakpoint_requests import change_breakpoints, forced_status, listed
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.mission import (
    TAKE_A_TREE,
    UNDER_WAY,
    Illegal,
    Mission,
    check_command,
    commanded_source,
)
from regraft.services.bt_executor.mocks import with_mocks
from regraft.services.bt_executor.node_types import node_types
from regraft.services.bt_executor.observing.observation import Observation
from regraft.services.bt_executor.observing.transitions import TransitionLog
from regraft.services.bt_executor.plain_values import shown_text
from regraft.services.bt_executor.quality.latest_qualities import LatestQualities
from regraft.services.bt_executor.report import mission_status
from regraft.services.bt_executor.source import Source, Unloadable, library_of
from regraft.services.bt_executor.state import kept_source, kept_state, restore_board
from regraft.services.bt_executor.tick_scheduler import TickScheduler
from regraft.services.bt_executor.tree_checks import TreeChecks


class Executor(Component):
    """Runs a mission: a behaviour tree in the XML of BehaviorTree.CPP 4.

    The tree is ticked ``rate`` times a second. It is also ticked when a leaf's answer has come or a timing node is due.
    An exception in a leaf fails the mission, not the component. After a crash the mission starts again from its root,
    with the plain values of its root blackboard.
    """

    resources = Resources(cpu=0.02, memory=25.0)
    removal_forbidden = "it runs the mission, which can be halted, or swapped for another"
    handler_timeout = 3.0  # a tree as large as may be takes that long to load
    state_version = 1
    checkpoint_every = 1.0
    reflected: ClassVar[tuple[Reflected, ...]] = REFLECTED
    """Return the entries that the inputs give the root blackboard; a subclass with further inputs adds to them."""

    mission = Parameter("", "the file with the tree; without one a tree is loaded by command", unit="path", exists=True)
    main = Parameter("", "ID of the tree to run, by default that of the file; without a file, one of the library's")
    trees = Parameter("", "folder or file of a library of trees", unit="path", read_only=True)
    rate = Parameter(10.0, "ticks a second", minimum=0.1, maximum=200.0, unit="Hz")
    autostart = Parameter(True, "whether the mission starts when the component is activated")
    nodes = Parameter(
        "", "further node types, as module:name of a class or a list, separated by blanks", read_only=True
    )

    mocks = Parameter("", "rules by which mocks take nodes' places", unit="path", exists=True, read_only=True)
    counts = Parameter(False, "whether the ticks and results of each node are counted")
    hold_time = Parameter(False, "whether simulated time stands while a tick has stopped at a breakpoint")
    record = Parameter("", "file to which changes of nodes' statuses are recorded", unit="path")

    goals = Input(Goals, latest_only=True, required=False, description="the places to visit")
    battery = Input(BatteryState, latest_only=True, required=False, description="for {@battery_charge}")
    light = Input(LightLevel, latest_only=True, required=False, description="for {@darkness}")
    sensor_health = Input(SensorHealth, latest_only=True, required=False, description="for {@sensor_faults}")
    system_status = Input(SystemStatus, latest_only=True, required=False, description="for {@problems}")
    reflection = Input(
        ReflectedEntries, latest_only=True, required=False, description="for the entries that the stack maps"
    )
    architecture = Input(
        Architecture, topic="/architecture", latest_only=True, required=False, description="for adapt decorators"
    )
    status = Output(MissionStatus, topic="mission", description="the mission, once a second and when its state changes")
    transitions = Output(
        MissionTransitions,
        topic="mission/transitions",
        required=False,
        description="changes of nodes' statuses, by tick",
    )

    def __init__(self) -> None:
        self._log = TransitionLog()
        self._observation = Observation()
        self._mission = Mission(self._tell, (self._log.note,), self._exchange)
        self._source = Source()
        self._reflection = BlackboardFeed(self.kit.inputs, self.reflected, self.kit.event)
        self._registry: Registry | None = None
        self._library = TreeLibrary()
        self._qualities = LatestQualities()
        self._is_active = False
        self._checks = TreeChecks(self.kit)
        self._start_again = False
        self._scheduler = TickScheduler(self.kit, self.tick)

    # --- lifecycle ---

    def on_configure(self) -> None:
        """Learn the node types and load the mission; raises Unloadable with the place of what is wrong."""
        self._mission = Mission(self._tell, (self._log.note,), self._exchange)
        self._observation = Observation()
        self._observe()
        context = LeafContext(self.kit, self._scheduler.soon)
        self._qualities = context.qualities
        registry = node_types(context, self.nodes.split())
        self._registry = with_mocks(registry, Path(self.mocks)) if self.mocks else registry
        self._library = library_of([self.trees] if self.trees else [])
        self._start_again = self.autostart and bool(self.mission or self.main)
        if self.mission or self.main:
            self._load(Source(self.mission, main=self.main))

    def on_activate(self) -> None:
        """Start the mission if it is to start by itself, or was running when the component stopped."""
        self._is_active = True
        self._scheduler.begin()
        if self._start_again and self._mission.state is not MissionState.EMPTY:
            self._start_again = False
            self._mission.start()
            self._scheduler.soon()

    def on_deactivate(self) -> None:
        """Halt the mission, which cancels its goals; it starts again with the next activation."""
        self._start_again = self._start_again or self._mission.state is MissionState.RUNNING
        if self._mission.state in UNDER_WAY:
            self._mission.halt("the component was deactivated")
            self._stream()
        self._is_active = False

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Load another mission, and start it if one was running, or none was there; raises Unloadable."""
        if "hold_time" in changed:
            self._stream()
        if changed & {"mission", "main"} and (self.mission or self.main) and self._registry is not None:
            before = self._mission.state
            self._listen()
            self._load(Source(self.mission, main=self.main))
            if before is MissionState.RUNNING or (before is MissionState.EMPTY and self.autostart):
                self._start_again = not self._is_active
                if self._is_active:
                    self._mission.start()
        if changed & {"counts", "record"}:
            self._observe("record" in changed)

    def _observe(self, again: bool = True) -> None:
        """Count and record as the parameters have it; ``again`` begins another recording."""
        self._observation.count(self._mission.tree, self.counts)
        if again:
            self._observation.record(self.record, lambda why: self.kit.event("mission.recorded", why))

    # --- ticking ---

    @every(hz=rate)
    def tick(self) -> None:
        """Tick the tree."""
        tree = self._mission.tree
        if tree is None or not self._mission.may_tick:
            return
        self._listen()
        self._reflection.update(tree.blackboard)
        self._run(self._mission.tick)

    def _run(self, work: Callable[[], None]) -> None:
        """Do what ticks the tree, and what follows a tick."""
        work()
        self._stream()
        tree = self._mission.tree
        self._scheduler.at(tree.next_wake_up() if tree and self._mission.may_tick else None)

    # --- status, and commands ---

    def _status_now(self) -> MissionStatus:
        return mission_status(self._mission, self._qualities.current(), self.kit.now())

    @every(seconds=1.0)
    def report(self) -> None:
        """Publish the mission's status, if anybody reads it."""
        if self.status.wanted:
            self.status.publish(self._status_now())

    def _listen(self) -> None:
        """Keep the changes of statuses from now on if somebody reads them, or they are recorded."""
        self._log.listening = self._is_active and (self.transitions.wanted or self._observation.recording is not None)

    def _exchange(self, tree: Tree) -> None:
        """Publish the last of the tree that there is, before another takes its place."""
        self._stream()
        self._qualities.follow(tree)
        self._observation.follow(tree)

    def _stream(self) -> None:
        """Publish and record the changes of statuses since the last time; time stands while a tick has stopped."""
        self.kit.hold_time(self.hold_time and self._mission.debugging.stop is not None)
        told = self._log.take(self._mission, self.kit.now())
        if told is not None:
            self._observation.take(self._mission, told)
            if self.transitions.wanted:
                self.transitions.publish(told)

    def _tell(self, kind: str, text: str, **details: Any) -> None:
        text = shown_text(text)
        self.kit.event(kind, text, **details)
        self.kit.set_status_text(f"{self._mission.state.value}: {text}")
        # A mission is also loaded before the component is active, and halted while it shuts down.
        with suppress(NotActive):
            self.report()

    @service("mission/status")
    def mission_status(self, request: MissionRequest) -> MissionStatus:
        """Return the mission's status."""
        return self._status_now()

    @service("mission/counts")
    def mission_counts(self, request: MissionCountsRequest) -> MissionCounts:
        """Return what each node has done since it is counted.

        Raises:
            RequestRefused: there is no tree, or nothing is counted.
        """
        self._loaded_tree()
        return self._observation.counts(self._mission, self.kit.now(), request.reset)

    @service("mission/breakpoints")
    def mission_breakpoints(self, request: BreakpointsRequest) -> MissionBreakpoints:
        """Return the breakpoints, after the change that is asked for.

        Raises:
            RequestRefused: there is no tree, no such node, or no breakpoint to remove; nothing has changed.
        """
        tree = self._loaded_tree()
        change_breakpoints(self._mission.debugging, tree, request)
        return MissionBreakpoints(self.kit.now(), self._mission.structure, listed(self._mission.debugging, tree))

    @service("mission/command")
    async def mission_command(self, command: MissionCommand) -> MissionStatus:
        """Load a tree, check one, start, pause, step or halt it, or have another take over; returns the status then.

        While a mission runs, a tree is checked on another thread first: one that is refused takes the mission no time.

        Raises:
            RequestRefused: the command makes no sense now, or the tree cannot be built; nothing has changed.
        """
        check_command(command)
        self._listen()
        try:
            if command.command in TAKE_A_TREE:
                await self._check(command)
            if command.command is not Command.CHECK:
                self._obey(command)
        except Illegal as error:
            raise RequestRefused(str(error), RefusalCode.CONFLICT) from None
        except Unloadable as error:
            raise RequestRefused(str(error), RefusalCode.INVALID) from None
        self._stream()
        return self._status_now()

    async def _check(self, command: MissionCommand) -> None:
        source = commanded_source(command, self.mission, self.main)
        if command.command is Command.SWAP:
            self._mission.check_swap()
        if command.command is Command.CHECK or self._mission.state is MissionState.RUNNING:
            await self._checks.check(source, *self._bases(ManualClock(self.kit.now())), self._library)

    def _obey(self, command: MissionCommand) -> None:
        if command.command is Command.LOAD:
            self._load(commanded_source(command, self.mission, self.main))
        elif command.command is Command.SWAP:
            self._swap(commanded_source(command, self.mission, self.main))
        elif command.command is Command.START:
            self._mission.start()
            self._scheduler.soon()
        elif command.command is Command.PAUSE:
            self._mission.pause()
        elif command.command is Command.HALT:
            self._run(self._mission.halt)
        else:
            self._debug(command)

    def _debug(self, command: MissionCommand) -> None:
        if self._mission.tree and self._mission.debugging.stop is None:
            self._reflection.update(self._mission.tree.blackboard)
        forced = forced_status(command.result)
        if command.command is Command.STEP:
            self._run(self._mission.step)
        elif command.command is Command.NEXT:
            self._run(lambda: self._mission.go_to_next(forced))
        else:
            self._run(lambda: self._mission.resume(forced))

    def _load(self, source: Source) -> None:
        """Take the tree of a source; raises Unloadable, and the mission then stays as it is."""
        tree = self._made(source)
        self._mission.take(tree)
        self._source = source

    def _swap(self, source: Source) -> None:
        """Have the tree of a source take over; raises Unloadable, and the mission then stays as it is."""
        tree = self._made(source)
        self._mission.swap(tree)
        self._source = source
        self.tick()

    def _bases(self, clock: Clock) -> tuple[Registry, Blackboard]:
        assert self._registry is not None
        board = Blackboard(clock=clock)
        self._reflection.declare(board)
        return self._registry, board

    def _made(self, source: Source) -> Tree:
        registry, board = self._bases(self.kit)
        tree = source.load(registry, board, library=self._library)
        self._reflection.declare_others(board)
        return tree

    # --- blackboard ---

    @service("mission/blackboard")
    def mission_blackboard(self, request: BlackboardRequest) -> BlackboardEntries:
        """Return a blackboard's entries.

        Raises:
            RequestRefused: there is no tree, no such board or no such entry.
        """
        return read_board(self._loaded_tree(), request.board, request.key, self.kit.now())

    @service("mission/write")
    def mission_write(self, request: WriteBlackboard) -> BlackboardEntries:
        """Write entries of a blackboard, all or none; the tree is ticked soon, if it runs.

        Raises:
            RequestRefused: there is no tree or no such board, or a value does not fit; nothing has been written.
        """
        written = write_board(self._loaded_tree(), request.board, request.values, self.kit.now())
        text = (f"{request.board}: " if request.board else "") + summary(request.values)
        self.kit.event("mission.written", text, values=request.values, board=request.board)
        self._scheduler.soon()
        return written

    def _loaded_tree(self) -> Tree:
        if self._mission.tree is None:
            raise RequestRefused("there is no tree, and so no blackboard; load one", RefusalCode.NOT_FOUND)
        return self._mission.tree

    # --- state ---

    def snapshot(self) -> PlainValue:
        """Return where the tree came from, whether it runs, and the plain part of its root blackboard."""
        runs = self._start_again or self._mission.state is MissionState.RUNNING
        return kept_state(self._source, runs, self._mission.tree, self._reflection.snapshot())

    def restore(self, state: PlainValue) -> None:
        """Have the same mission again; it starts again if it was running, else it waits for a command."""
        source = kept_source(state)
        self._start_again = state["runs"]
        self._reflection.restore(state.get("reflected", {}))
        if source != self._source and source.file in ("", self._source.file):
            try:
                self._load(source)
            except Unloadable as error:
                self.kit.event("mission.lost", f"the commanded tree cannot be loaded again: {error}")
        tree = self._mission.tree
        if tree is not None and source == self._source:
            restore_board(tree, state, self.kit.log.warning)
