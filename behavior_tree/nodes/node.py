"""The base of all nodes, and what happens in one tick of any of them.

The rules are those of BehaviorTree.CPP 4.10. A tick checks the pre-conditions, runs the node, runs the
post-conditions and stores the result. SKIPPED is returned to the parent but never stored.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from ..data.blackboard import Blackboard
from ..errors import NodeError, PortError
from ..script import Script
from ..status import COMPLETED, FAILURE, IDLE, RUNNING, SKIPPED, STATUS_NAMES, STORED, SUCCESS, Status
from .manifest import NodeKind, NodeManifest
from .runtime import Runtime
from .text import board_key

PreTickHook = Callable[["Node"], Status | None]
"""Asked before a node runs; SUCCESS or FAILURE is taken instead of running it."""

PostTickHook = Callable[["Node", Status], Status | None]
"""Asked after a node ran, with its result; SUCCESS or FAILURE replaces the result."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """The compiled condition attributes of a node; each is absent by default.

    Attributes:
        failure_if: ``_failureIf``: the node fails without running.
        success_if: ``_successIf``: the node succeeds without running.
        skip_if: ``_skipIf``: the node is skipped.
        while_true: ``_while``: as soon as it is false the node is halted and skipped.
        on_halted: ``_onHalted``: run after the node was halted.
        on_failure: ``_onFailure``: run when it fails.
        on_success: ``_onSuccess``: run when it succeeds.
        post: ``_post``: run when it fails or succeeds, after the other two.
    """

    failure_if: Callable[[], bool] | None = None
    success_if: Callable[[], bool] | None = None
    skip_if: Callable[[], bool] | None = None
    while_true: Callable[[], bool] | None = None
    on_halted: Script | None = None
    on_failure: Script | None = None
    on_success: Script | None = None
    post: Script | None = None


@dataclass(frozen=True, slots=True)
class NodeSetup:
    """All that a node is made from; the loader builds it and a constructor passes it on unread.

    Attributes:
        uid: The number of the node, 1, 2, … in order of creation over the whole tree.
        name: The instance name, by default the type ID.
        path: The instance name behind the path of the enclosing sub-tree; ``Type::uid`` represents a missing name.
        manifest: The node type.
        blackboard: The board of the sub-tree that the node belongs to.
        runtime: The parts that it shares with the whole tree.
        attributes: The ports' texts as the XML gives them, defaults not included.
        other_attributes: Attributes that start with ``_`` and mean nothing here.
        readers: A function for each readable port that gives its value.
        writers: A function for each writable port that takes its value.
        conditions: The condition attributes, None if there are none.
        subtree_id: The tree that a SubTree node represents, empty for others.
        file: The file that the node comes from.
        line: The line in that file.
    """

    uid: int
    name: str
    path: str
    manifest: NodeManifest
    blackboard: Blackboard
    runtime: Runtime
    attributes: dict[str, str] = field(default_factory=dict)
    other_attributes: dict[str, str] = field(default_factory=dict)
    readers: dict[str, Callable[[], Any]] = field(default_factory=dict)
    writers: dict[str, Callable[[Any], None]] = field(default_factory=dict)
    conditions: Conditions | None = None
    subtree_id: str = ""
    file: str = ""
    line: int = 0


class Node:
    """A node of a behaviour tree.

    Subclasses implement `tick`; parents call `execute_tick` on their children, never `tick`.

    Attributes:
        setup: The data that the node was made from.
        uid: The number of the node in its tree.
        name: The instance name.
        path: The full name, see `NodeSetup`.
        type_id: The node type's ID.
        status: The stored status; the result of the last tick unless that was SKIPPED, or IDLE after a reset.
        blackboard: The board that ports and scripts of this node refer to.
        runtime: The parts that the node shares with its tree: clock, timers, wake-ups.
        children: The children in order; none for a leaf.
        pre_tick_hook: May replace running the node, see `set_hooks`.
        post_tick_hook: May replace the result, see `set_hooks`.
    """

    kind: ClassVar[NodeKind]
    results: ClassVar[tuple[Status, ...]] = STORED
    """The possible results of a tick, besides SKIPPED."""

    setup: NodeSetup
    uid: int
    name: str
    path: str
    type_id: str
    status: Status
    blackboard: Blackboard
    runtime: Runtime
    children: "tuple[Node, ...]"
    pre_tick_hook: PreTickHook | None
    post_tick_hook: PostTickHook | None

    def __init__(self, setup: NodeSetup) -> None:
        self.setup = setup
        self.uid = setup.uid
        self.name = setup.name
        self.path = setup.path
        self.type_id = setup.manifest.type_id
        self.status = IDLE
        self.blackboard = setup.blackboard
        self.runtime = setup.runtime
        self.children = ()
        self.pre_tick_hook = None
        self.post_tick_hook = None
        self._conditions = setup.conditions or Conditions()
        self._is_plain = setup.conditions is None
        self._observers = setup.runtime.transition_hooks
        self._resets_plainly = type(self).reset is Node.reset and type(self).set_status is Node.set_status

    def tick(self) -> Status:
        """Do the node's work and return its status; IDLE is not allowed."""
        raise NotImplementedError(f"{type(self).__name__} does not implement tick()")

    def halt(self) -> None:
        """Stop the node's work and make it idle, from any status."""
        self.set_status(IDLE)

    def adopt(self, children: "tuple[Node, ...]") -> None:
        """Take the children, once, when the tree is built.

        Raises:
            ValueError: The number of children or a port's literal is wrong; the loader adds file and line.
        """
        self.children = children

    def set_hooks(self, pre_tick: PreTickHook | None = None, post_tick: PostTickHook | None = None) -> None:
        """Install or, with None, remove the functions that may replace the node's work or its result.

        The first is not asked while the stored status is SUCCESS or FAILURE. Its result passes the
        post-conditions; what the second returns does not.
        """
        self.pre_tick_hook = pre_tick
        self.post_tick_hook = post_tick
        is_watched = pre_tick is not None or post_tick is not None or self.runtime.debugger is not None
        self._is_plain = self.setup.conditions is None and not is_watched

    def read_port(self, name: str) -> Any:
        """Return the value of an input: its literal, its default, or what its blackboard entry holds.

        Raises:
            PortError: There is no such input, the XML leaves it open, or its entry is missing, empty or
            unsuitable.
        """
        reader = self.setup.readers.get(name)
        if reader is None:
            raise PortError(f"input '{name}' is not given and has no default", node=self.path)
        return reader()

    def read_port_or(self, name: str, default: Any = None) -> Any:
        """Return the value of an input, or a default where `read_port` would raise PortError."""
        try:
            return self.read_port(name)
        except PortError:
            return default

    def has_literal(self, name: str) -> bool:
        """Return whether the XML gives a port a literal, whose value is known when the tree is built."""
        text = self.setup.attributes.get(name)
        return text is not None and board_key(text, name) is None

    def write_port(self, name: str, value: Any) -> None:
        """Write the blackboard entry that an output is connected to.

        Raises:
            PortError: There is no such output, the XML connects it to nothing, or its entry is of another
            type.
        """
        writer = self.setup.writers.get(name)
        if writer is None:
            raise PortError(f"output '{name}' is not connected; give it a blackboard key as in {{key}}", node=self.path)
        writer(value)

    def request_wake_up(self) -> None:
        """Ask that the tree be ticked again without delay."""
        self.runtime.wake_requested = True

    def set_status(self, status: Status) -> None:
        """Store a status and announce the change, if it is one."""
        previous = self.status
        if status != previous:
            self.status = status
            if self._observers:
                self.runtime.announce(self.uid, previous, status)

    def set_running(self) -> None:
        """Store RUNNING, as nodes with children do before they tick a child."""
        previous = self.status
        if previous != RUNNING:
            self.status = RUNNING
            if self._observers:
                self.runtime.announce(self.uid, previous, RUNNING)

    def execute_tick(self) -> Status:
        """Tick the node under all rules and return the result.

        Raises:
            NodeError: The node or one of its scripts failed; names the innermost node.
        """
        try:
            status = self.tick() if self._is_plain else self._guarded_tick()
        except NodeError:
            raise
        except Exception as error:
            raise self._failed("ticked", error) from error
        # Storing is spelt out here as well as in `set_status`: calls are what a tick spends its time on.
        previous = self.status
        if status != previous:
            if status in COMPLETED or status in self.results:
                self.status = status
                if self._observers:
                    self.runtime.announce(self.uid, previous, status)
            elif status != SKIPPED:
                raise self._failed("ticked", self._wrong_result(status))
        elif status == IDLE:
            raise self._failed("ticked", self._wrong_result(status))
        return status

    def halt_node(self, *, always_run_script: bool = False) -> None:
        """Halt the node; if it was running, or in any case if asked to, run its ``_onHalted`` afterwards.

        Raises:
            NodeError: Halting or the script failed; names the innermost node.
        """
        try:
            was_running = self.status == RUNNING
            self.halt()
            if (was_running or always_run_script) and self._conditions.on_halted is not None:
                self._conditions.on_halted()
        except NodeError:
            raise
        except Exception as error:
            raise self._failed("halted", error) from error

    def reset(self) -> None:
        """Halt the node if it is running; make it idle."""
        if self.status == RUNNING:
            self.halt_node()
        if self._observers or not self._resets_plainly:
            self.set_status(IDLE)
        else:
            self.status = IDLE

    def reset_each(self, nodes: "tuple[Node, ...]") -> None:
        """Reset nodes, mostly children of this one; see `reset`."""
        is_observed = bool(self._observers)
        for node in nodes:
            status = node.status
            if status == IDLE:
                continue
            if status == RUNNING or is_observed or not node._resets_plainly:
                node.reset()
            else:
                node.status = IDLE  # This does what `reset` would do, without the calls; nearly all nodes end up here.

    def _guarded_tick(self) -> Status:
        status = self._decided_by_precondition()
        if status is None and self.status not in COMPLETED:
            status = self._replaced()
        if status is None:
            status = self.tick()
        if status in COMPLETED:
            self._run_postconditions(status)
        if self.runtime.debugger is not None:
            forced = self.runtime.debugger.after(self.uid, status)
            if forced in COMPLETED:
                if status == RUNNING:
                    self.set_running()  # at a leaf's first tick that is not stored yet, and only then it gives up
                    self.halt_node()
                status = forced
        if self.post_tick_hook is not None:
            replaced = self.post_tick_hook(self, status)
            if replaced in COMPLETED:
                return replaced
        return status

    def _decided_by_precondition(self) -> Status | None:
        conditions = self._conditions
        if self.status == IDLE:
            if conditions.failure_if is not None and conditions.failure_if():
                return FAILURE
            if conditions.success_if is not None and conditions.success_if():
                return SUCCESS
            if conditions.skip_if is not None and conditions.skip_if():
                return SKIPPED
            if conditions.while_true is not None and not conditions.while_true():
                return SKIPPED
        elif self.status == RUNNING and conditions.while_true is not None and not conditions.while_true():
            self.halt_node()
            return SKIPPED
        return None

    def _replaced(self) -> Status | None:
        """Return the result that is taken instead of running the node, None if it is to run."""
        if self.pre_tick_hook is not None:
            replaced = self.pre_tick_hook(self)
            if replaced in COMPLETED:
                return replaced
        if self.runtime.debugger is not None:
            forced = self.runtime.debugger.before(self.uid)
            if forced in COMPLETED:
                if self.status == RUNNING:
                    self.halt_node()
                return forced
        return None

    def _run_postconditions(self, status: Status) -> None:
        conditions = self._conditions
        specific = conditions.on_success if status == SUCCESS else conditions.on_failure
        if specific is not None:
            specific()
        if conditions.post is not None:
            conditions.post()

    def _wrong_result(self, status: Status) -> Exception:
        shown = "IDLE" if status == IDLE else repr(status)
        return ValueError(f"it returned {shown}; a tick returns one of {', '.join(STATUS_NAMES[1:])}")

    def _failed(self, verb: str, error: Exception) -> NodeError:
        reason = str(error) or type(error).__name__
        message = f"node '{self.path}' of type {self.type_id} failed while it was {verb}: {reason}"
        return NodeError(message, file=self.setup.file, line=self.setup.line, node=self.path)
