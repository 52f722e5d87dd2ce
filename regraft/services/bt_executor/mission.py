"""A mission: a behaviour tree and what is being done with it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from behavior_tree import FAILURE, RUNNING, SUCCESS, NodeError, Status, Stop, TransitionHook, Tree
from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionNode, MissionState
from regraft.services.bt_executor.boards import carry_over
from regraft.services.bt_executor.debugging.stopped_tick import Debugging
from regraft.services.bt_executor.source import Source, warnings_of
from regraft.services.bt_executor.structure import Structure

MAX_TICKS_AT_ONCE = 100
"""Root ticks in a row that the tree's own wake-ups may cause; an endless loop of leaves that complete at once
then waits for the next tick."""

MAX_NAMED = 8
"""Blackboard entries that an event names in its text; its details have all."""

UNDER_WAY = (MissionState.RUNNING, MissionState.PAUSED)
TAKE_A_TREE = (Command.LOAD, Command.SWAP, Command.CHECK)
TAKE_A_RESULT = (Command.CONTINUE, Command.NEXT)


class Illegal(Exception):
    """A command that makes no sense in the mission's state; the text states what would be right."""


def check_command(command: MissionCommand) -> None:
    """Make sure that a command has nothing that it does not take; raises RequestRefused."""
    verb = command.command.value
    if command.command not in TAKE_A_TREE and (command.tree or command.main):
        raise RequestRefused(f"{verb} takes no tree; load it, then {verb}", RefusalCode.MALFORMED)
    if command.command not in TAKE_A_RESULT and command.result is not None:
        raise RequestRefused(f"{verb} forces no result; continue and next do", RefusalCode.MALFORMED)


def commanded_source(command: MissionCommand, mission: str, main: str) -> Source:
    """Return the tree that a command is about: its own, else that of the executor's parameters or library.

    Raises:
        Illegal: there is none.
    """
    if command.tree:
        folder = str(Path(mission).parent) if mission else ""
        return Source(text=command.tree, main=command.main, folder=folder)
    if mission or command.main or main:
        return Source(mission, main=command.main or main)
    raise Illegal("there is no tree to load: give its XML or ID, or set the parameter 'mission' to a file")


class EventReporter(Protocol):
    """The listener for events of a mission."""

    def __call__(self, kind: str, text: str, **details: Any) -> None:
        """Something happened; ``kind`` is an event's kind such as ``mission.started``."""


class Mission:
    """Ticks a tree, and keeps what became of it.

    The blackboard outlives a run: a tree that is started again finds the values of the last run, as in
    BehaviorTree.CPP.

    Attributes:
        state: The state of the mission.
        tree: The tree, None while there is none.
        ticks: Ticks since the last start.
        error: Why the last run failed, empty if it did not.
        debugging: The breakpoints, and where a tick has stopped.
    """

    def __init__(
        self,
        tell: EventReporter,
        hooks: tuple[TransitionHook, ...] = (),
        exchange: Callable[[Tree], None] = lambda tree: None,
    ) -> None:
        """Begin without a tree.

        Args:
            ``tell``: called with each event.
            hooks: called with every change of a node's status, of any tree.
            exchange: called with a tree that is about to take the place of the present one, which is halted.
        """
        self.state = MissionState.EMPTY
        self.tree: Tree | None = None
        self.ticks = 0
        self.error = ""
        self.debugging = Debugging(self._note_stop)
        self._hooks = hooks
        self._exchange = exchange
        self._tell = tell
        self._failed_leaf = ""
        self._structure: Structure | None = None

    def take(self, tree: Tree) -> None:
        """Take another tree in place of the one there is, which is halted if it is under way."""
        if self.state in UNDER_WAY:
            self.halt("another tree was loaded")
        self._adopt(tree, MissionState.LOADED)
        self._tell("mission.loaded", f"{tree.tree_id}, {len(tree.nodes)} nodes", warnings=list(warnings_of(tree)))

    def check_swap(self) -> None:
        """Make sure that something is under way from which another tree can take over; raises Illegal."""
        tree = self._tree("take over from")
        if self.state not in UNDER_WAY:
            raise Illegal(f"'{tree.tree_id}' is {self.state.value}; nothing to take over from; load, then start")

    def swap(self, tree: Tree) -> None:
        """Have another tree take over from the present one, as if it had been started, or paused at its root.

        The old tree is halted, which cancels its goals. The entries of its root blackboard that have a value are
        carried over; those that do not fit the new tree's types are reported, and keep the new tree's value.

        Raises:
            Illegal: no tree is running or paused.
        """
        self.check_swap()
        old = self._tree("take over from")
        wrong = self._halted(old)
        carried = carry_over(old.blackboard, tree.blackboard)
        self._adopt(tree, self.state)
        keys = f"{len(carried.keys)} entries" if len(carried.keys) > MAX_NAMED else ", ".join(carried.keys)
        text = f"{tree.tree_id} takes over from {old.tree_id}; carried over: {keys or 'nothing'}"
        for clash in carried.clashes.values():
            text += f"; not carried over: {clash}"
        if wrong:
            text += f"; halting {old.tree_id}: {wrong}"
        self._tell(
            "mission.swapped",
            text,
            before=old.tree_id,
            after=tree.tree_id,
            carried=list(carried.keys),
            clashes=carried.clashes,
            warnings=list(warnings_of(tree)),
        )

    def start(self) -> None:
        """Run the tree from its root, or continue if it is paused.

        Raises:
            Illegal: there is no tree, or it is running.
        """
        tree = self._tree("start")
        if self.state is MissionState.RUNNING:
            raise Illegal(f"'{tree.tree_id}' is running already; pause or halt it")
        if self.state is MissionState.PAUSED:
            self.state = MissionState.RUNNING
            self._tell("mission.resumed", tree.tree_id)
            return
        self._begin(MissionState.RUNNING)

    def pause(self) -> None:
        """Tick no more; goals that were given continue, their outcome is seen later.

        Raises:
            Illegal: the tree is not running.
        """
        tree = self._tree("pause")
        if self.state is not MissionState.RUNNING:
            raise Illegal(f"'{tree.tree_id}' is {self.state.value}; only a running mission can be paused")
        self.state = MissionState.PAUSED
        self._tell("mission.paused", tree.tree_id)

    def step(self) -> None:
        """Tick once; a tree that was not started is started and stays paused.

        Raises:
            Illegal: the tree is running, or there is none.
        """
        tree = self._tree("step")
        if self.state is MissionState.RUNNING:
            raise Illegal(f"'{tree.tree_id}' is running; pause it, then step")
        if self.debugging.stop is not None:
            raise Illegal(f"'{tree.tree_id}' has stopped in the middle of a tick; continue, then step")
        if self.state is not MissionState.PAUSED:
            self._begin(MissionState.PAUSED)
        self._advance(1)

    def resume(self, forced: Status | None = None) -> None:
        """Continue a tick that has stopped at a breakpoint; the node may be given a result.

        Raises:
            Illegal: it has not stopped.
        """
        if self.debugging.stop is None:
            raise Illegal("the tree has not stopped at a breakpoint")
        self.debugging.resume(forced)

    def go_to_next(self, forced: Status | None = None) -> None:
        """Continue, and stop before the next node that runs, in this tick or in one that begins now.

        A tree that was not started is started, and paused.

        Raises:
            Illegal: there is no tree, or a result is given and the tick has not stopped.
        """
        self._tree("debug")
        if self.debugging.stop is not None:
            self.debugging.resume(forced, to_next=True)
        elif forced is not None:
            raise Illegal("the tree has not stopped at a node that could be given a result")
        else:
            self.debugging.stop_at_next()
            if self.state not in UNDER_WAY:
                self._begin(MissionState.PAUSED)
        if self.debugging.stop is None and self.state in UNDER_WAY:
            self._advance(1)

    def halt(self, why: str = "as commanded") -> None:
        """End the run: all running nodes are halted, which cancels their goals.

        Raises:
            Illegal: the tree is neither running nor paused.
        """
        tree = self._tree("halt")
        if self.state not in UNDER_WAY:
            raise Illegal(f"'{tree.tree_id}' is {self.state.value}; there is nothing to halt")
        self.state = MissionState.HALTED
        self.error = self._halted(tree)
        self._tell("mission.halted", f"{tree.tree_id}: {self.error or why}")

    def tick(self) -> None:
        """Tick the tree if it is running, and has not stopped in the middle of a tick."""
        if self.may_tick:
            self._advance(MAX_TICKS_AT_ONCE)

    @property
    def may_tick(self) -> bool:
        """Whether it runs, and has not stopped in the middle of a tick."""
        return self.state is MissionState.RUNNING and self.debugging.stop is None

    def _adopt(self, tree: Tree, state: MissionState) -> None:
        self._exchange(tree)
        self.tree = tree
        self.debugging.follow(tree)
        self._structure = Structure(tree)
        self.state, self.ticks, self.error, self._failed_leaf = state, 0, "", ""
        for hook in (self._note_failed_leaf, *self._hooks):
            tree.add_transition_hook(hook)

    def _tree(self, verb: str) -> Tree:
        if self.tree is None:
            raise Illegal(f"there is no tree to {verb}; load one")
        return self.tree

    def _begin(self, state: MissionState) -> None:
        tree = self._tree("start")
        self.state, self.ticks, self.error, self._failed_leaf = state, 0, "", ""
        self._tell("mission.started", tree.tree_id)

    def _advance(self, most_ticks: int) -> None:
        tree = self._tree("tick")
        self.ticks += 1
        self.debugging.run(lambda: self._tick(tree, most_ticks))

    def _tick(self, tree: Tree, most_ticks: int) -> None:
        try:
            status = tree.tick_once(most_ticks)
        except NodeError as error:
            self._fail(tree, str(error), error.node)
            return
        if status == SUCCESS:
            self.state = MissionState.SUCCEEDED
            self.debugging.abandon()
            self._tell("mission.succeeded", tree.tree_id)
        elif status == FAILURE:
            leaf = self._failed_leaf
            self._fail(tree, f"the tree failed, last at '{leaf}'" if leaf else "the tree failed", leaf)

    def _fail(self, tree: Tree, why: str, node: str) -> None:
        self.state = MissionState.FAILED
        also = self._halted(tree)
        self.error = f"{why}; {also}" if also else why
        self._tell("mission.failed", f"{tree.tree_id}: {self.error}", node=node)

    def _halted(self, tree: Tree) -> str:
        """Halt the tree; return what went wrong with that, empty if nothing did."""
        self.debugging.abandon()
        try:
            tree.halt_tree()
        except NodeError as error:
            return str(error)
        return ""

    def _note_stop(self, stop: Stop) -> None:
        text = f"stopped {stop.position.value} '{stop.node.path}'"
        self._tell("mission.stopped", text, node=stop.node.path, position=stop.position.value)

    def _note_failed_leaf(self, uid: int, previous: Status, status: Status, time: float) -> None:
        node = self.tree.nodes[uid - 1] if self.tree else None
        if status == FAILURE and node is not None and not node.children:
            self._failed_leaf = node.path

    @property
    def structure(self) -> str:
        """The identity of the tree, empty while there is none."""
        return self._structure.digest if self._structure else ""

    def nodes(self) -> tuple[MissionNode, ...]:
        """Return the nodes with their statuses, in the tree's order."""
        return self._structure.nodes() if self._structure else ()

    def running_leaves(self) -> tuple[str, ...]:
        """Return the paths of the leaves that are running, in the tree's order."""
        nodes = self.tree.nodes if self.tree else ()
        return tuple(node.path for node in nodes if node.status == RUNNING and not node.children)
