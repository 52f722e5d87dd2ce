"""A tree that is ready to run."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .data.blackboard import Blackboard
from .errors import NodeError
from .nodes.node import Node
from .nodes.runtime import Debugger, Runtime, TransitionHook
from .status import COMPLETED, IDLE, RUNNING, Status, status_name


class Tree:
    """A behaviour tree; make one with `load_text` or `load_file`.

    Nothing here waits or starts threads: the caller ticks, and may sleep until `next_wake_up` in between. A
    tree is used from one thread.

    Attributes:
        tree_id: The ID of the tree that is executed.
        root: Its root.
        nodes: All nodes in order of their uid, which starts at 1.
        blackboard: The top blackboard; may be read and written between ticks.
        blackboards: All blackboards, those of sub-trees by their path. The top one is there by the tree's ID,
            unless a sub-tree has that path.
        warnings: The doubts of the loader.
    """

    def __init__(
        self,
        tree_id: str,
        *,
        nodes: tuple[Node, ...],
        blackboards: Mapping[str, Blackboard],
        runtime: Runtime,
        warnings: tuple[str, ...] = (),
    ) -> None:
        self.tree_id = tree_id
        self.root = nodes[0]
        self.nodes = nodes
        self.blackboard = self.root.blackboard
        self.blackboards = blackboards
        self.warnings = warnings
        self._runtime = runtime

    def tick_exactly_once(self) -> Status:
        """Tick the root once; after SUCCESS or FAILURE the tree is idle and may start again.

        Raises:
            NodeError: A node failed; the tree is left as it is, halt it before continuing.
        """
        self._runtime.timers.take_due()
        return self._ended(self.root.execute_tick())

    def tick_once(self, max_ticks: int | None = None) -> Status:
        """Tick the root, and again as long as it is running and a node asks for another tick without delay.

        Args:
            max_ticks: When to stop nevertheless; the request stays pending. An endless Repeat around a node
                that completes at once never stops by itself.

        Raises:
            NodeError: A node failed; the tree is left as it is, halt it before continuing.
        """
        self._runtime.timers.take_due()
        status = self.root.execute_tick()
        ticks = 1
        while status == RUNNING and (max_ticks is None or ticks < max_ticks) and self._runtime.take_wake_up():
            status = self.root.execute_tick()
            ticks += 1
        return self._ended(status)

    def tick_while_running(
        self, sleep: Callable[[float], object], period_s: float = 0.01, max_ticks: int | None = None
    ) -> Status:
        """Tick until the tree is no longer running, sleeping in between; return the last result.

        Args:
            sleep: Waits for a number of seconds, such as ``time.sleep``, or a manual clock's ``advance``.
            period_s: The longest time between two ticks; shorter where a timer of the tree comes due earlier.
            max_ticks: See `tick_once`.

        Raises:
            NodeError: A node failed; the tree is left as it is, halt it before continuing.
        """
        while (status := self.tick_once(max_ticks)) == RUNNING:
            wake_up = self.next_wake_up()
            sleep(period_s if wake_up is None else min(max(wake_up - self._runtime.clock.now(), 0.0), period_s))
        return status

    def halt_tree(self, *, like_btcpp: bool = False) -> None:
        """Halt every running node and make all nodes idle.

        Unlike BehaviorTree.CPP's haltTree, this runs ``_onHalted`` once, and only of nodes that were running.

        Args:
            like_btcpp: Do exactly what BehaviorTree.CPP does: halt the root, then every node again, and run each
                node's ``_onHalted`` each time, whether it was running or not; the first error ends it.

        Raises:
            NodeError: A node failed to halt. All others are halted and all are idle nevertheless; further
            errors are added to the first as notes.
        """
        if like_btcpp:
            for node in (self.root, *self.nodes):
                node.halt_node(always_run_script=True)
            self.root.set_status(IDLE)
            return
        errors = self._halt_each(self.nodes)
        if errors:
            # Children before parents, so that an error that kept a parent from halting does not occur again.
            errors += self._halt_each(reversed(self.nodes))
        for node in self.nodes:
            node.set_status(IDLE)
        if errors:
            for other in errors[1:]:
                errors[0].add_note(f"also: {other}")
            raise errors[0]

    def next_wake_up(self) -> float | None:
        """Return when the tree next wants to be ticked, in seconds of its clock; None if it does not know.

        Leaves that wait for the world outside know nothing of time: tick at the usual rate while the tree
        runs.
        """
        if self._runtime.wake_requested:
            return self._runtime.clock.now()
        return self._runtime.timers.earliest()

    def request_wake_up(self) -> None:
        """Ask for another tick without delay, as a node would."""
        self._runtime.wake_requested = True

    @property
    def status(self) -> Status:
        """The stored status of the root."""
        return self.root.status

    def node(self, path: str) -> Node:
        """Return the first node with a path.

        Raises:
            KeyError: There is none.
        """
        for node in self.nodes:
            if node.path == path:
                return node
        raise KeyError(f"there is no node '{path}'")

    def add_transition_hook(self, hook: TransitionHook) -> None:
        """Let a function know of every change of a stored status; it must not raise."""
        self._runtime.transition_hooks.append(hook)

    def remove_transition_hook(self, hook: TransitionHook) -> None:
        """Stop notifying a function."""
        self._runtime.transition_hooks.remove(hook)

    def debug(self, debugger: Debugger | None) -> None:
        """Ask a debugger about every tick of a node from now on, or nobody. `Breakpoints` is one."""
        if debugger is self._runtime.debugger:
            return
        self._runtime.debugger = debugger
        for node in self.nodes:
            node.set_hooks(node.pre_tick_hook, node.post_tick_hook)

    def describe(self) -> dict[str, Any]:
        """Return the tree as plain data: uid, name, type, kind, path, status, ports and children of each
        node.
        """
        return _describe(self.root)

    def _ended(self, status: Status) -> Status:
        if status in COMPLETED:
            self.root.set_status(IDLE)
        return status

    def _halt_each(self, nodes: Iterable[Node]) -> list[NodeError]:
        errors = []
        for node in nodes:
            try:
                node.halt_node()
            except NodeError as error:
                errors.append(error)
        return errors


def _describe(node: Node) -> dict[str, Any]:
    return {
        "uid": node.uid,
        "name": node.name,
        "type": node.type_id,
        "kind": node.kind.value,
        "path": node.path,
        "status": status_name(node.status),
        "ports": dict(node.setup.attributes),
        "subtree": node.setup.subtree_id,
        "children": [_describe(child) for child in node.children],
    }
