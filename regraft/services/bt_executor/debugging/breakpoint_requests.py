"""The breakpoints of a mission as others ask for them."""

from __future__ import annotations

from behavior_tree import FAILURE, SUCCESS, Breakpoint, Node, Position, Status, Stop, Tree
from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.messages.mission import (
    BreakpointChange,
    BreakpointsRequest,
    ForcedResult,
    MissionBreakpoint,
    MissionStop,
    TickPosition,
)
from regraft.bus_schema.suggestions import instead_of
from regraft.services.bt_executor.debugging.stopped_tick import Debugging
from regraft.services.bt_executor.structure import STATUSES

RESULTS = {ForcedResult.SUCCESS: SUCCESS, ForcedResult.FAILURE: FAILURE}
FORCED = {status: result for result, status in RESULTS.items()}


def forced_status(result: ForcedResult | None) -> Status | None:
    """Return the status of a result that is to be forced, None for none."""
    return None if result is None else RESULTS[result]


def change_breakpoints(debugging: Debugging, tree: Tree, request: BreakpointsRequest) -> None:
    """Change the breakpoints as asked; raises RequestRefused, and they then stay as they are."""
    position = Position(request.position.value)
    if request.change is BreakpointChange.SET:
        uid = found_node(tree, request.node).uid
        debugging.set(Breakpoint(uid, position, forced_status(request.result), request.once))
    elif request.change is BreakpointChange.REMOVE:
        node = found_node(tree, request.node)
        if not debugging.remove(node.uid, position):
            why = f"there is no breakpoint {position.value} '{node.path}'"
            raise RequestRefused(why, RefusalCode.NOT_FOUND)
    elif request.change is BreakpointChange.CLEAR:
        debugging.clear()


def found_node(tree: Tree, name: str) -> Node:
    """Return the node with a path, with a name that it alone has, or with a uid.

    Raises:
        RequestRefused: there is none, or there are several.
    """
    for node in tree.nodes:
        if name in (node.path, str(node.uid)):
            return node
    named = [node for node in tree.nodes if name in (node.name, node.type_id)]
    if len(named) == 1:
        return named[0]
    if named:
        paths = ", ".join(f"'{node.path}' ({node.uid})" for node in named[:5])
        why = f"{len(named)} nodes are called {name!r}: give a path or uid, such as {paths}"
        raise RequestRefused(why, RefusalCode.INVALID)
    names = {each for node in tree.nodes for each in (node.path, node.name)}
    raise RequestRefused(f"the tree has no node {name!r}; {instead_of(name, names)}", RefusalCode.NOT_FOUND)


def listed(debugging: Debugging, tree: Tree) -> tuple[MissionBreakpoint, ...]:
    """Return the breakpoints of a tree."""
    return tuple(
        MissionBreakpoint(
            each.uid,
            tree.nodes[each.uid - 1].path,
            TickPosition(each.position.value),
            None if each.result is None else FORCED[each.result],
            each.once,
        )
        for each in debugging.breakpoints
    )


def shown_stop(stop: Stop | None) -> MissionStop | None:
    """Return where a tick has stopped."""
    if stop is None:
        return None
    result = None if stop.result is None else STATUSES[stop.result]
    return MissionStop(stop.node.uid, stop.node.path, TickPosition(stop.position.value), result)
