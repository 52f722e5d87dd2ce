"""Moves a running component's port to another topic, or to none, with nothing lost and nothing doubled.

The components do the moving (``regraft.runtime.lifecycle.port_rewiring``). This is the order in which they are asked:
open the new topic next to the old, see markers through from every publisher to every reader, switch.
"""

from __future__ import annotations

from collections.abc import Iterable

from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer, PendingQuery
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlCode, Peer, Rewire, RewireStep
from regraft.bus_schema.model.lifecycle import State
from regraft.patience import Patience

OLD_PUBLISHER_TIMEOUT = 0.5
"""Seconds that a publisher of the topic being left may take for its marker: it may be why it is left."""


async def move_port(context: ExecutionContext, component: str, port: str, topic: str | None) -> None:
    """Move a port to ``topic``, None for none; raises ControlFailed, with the port on either topic but working."""
    context.touch(component)
    if topic is None:
        await _disconnect(context, component, port)
    elif context.direction(component, port) == "input":
        await _move_input(context, component, port, topic)
    else:
        await _move_output(context, component, port, topic)


async def abandon(context: ExecutionContext, component: str, port: str) -> None:
    """Give up a move that was begun; does nothing if there was none."""
    context.touch(component)
    await context.controls.rewire(component, Rewire(RewireStep.ABANDON, port)).view()


async def see_through(context: ExecutionContext, view: ComponentView, run: str = "") -> None:
    """Wait until a component that is not active yet is wired to all it reads, and all who read it; ControlFailed.

    ``run`` is the name of one that runs next to a component.
    """
    name = view.component
    run = run or name
    for port, topic in sorted(view.connections.items()):
        if topic and context.direction(name, port) == "input":
            await _bind(context, (run,), port, topic, [writer for writer in context.writers(topic) if writer != run])
        elif topic:
            readers = [reader for reader in await _connected_readers(context, topic) if reader != name]
            await _bind(context, readers, "", topic, [run])


async def _move_input(context: ExecutionContext, component: str, port: str, topic: str) -> None:
    opened = await context.controls.rewire(component, Rewire(RewireStep.OPEN, port, topic)).view()
    former = opened.connections[port]
    await _bind(context, (component,), port, topic, context.writers(topic))
    cuts = await _cuts(context, former) if former else {}
    switch = Rewire(RewireStep.SWITCH, port, topic, cuts=cuts, revision=context.revision)
    switched = await context.controls.rewire(component, switch).view()
    _note_incomplete(context, switched, f"{component}.{port}: not all of {former!r} before the switch to {topic!r}")


async def _move_output(context: ExecutionContext, component: str, port: str, topic: str) -> None:
    await context.controls.rewire(component, Rewire(RewireStep.OPEN, port, topic)).view()
    readers = await _connected_readers(context, topic)
    await _bind(context, readers, "", topic, [component])
    for reader in readers:
        context.touch(reader)
    await context.controls.rewire(component, Rewire(RewireStep.SWITCH, port, topic, revision=context.revision)).view()


async def _disconnect(context: ExecutionContext, component: str, port: str) -> None:
    view = await context.controls.read(component).view()
    former = view.connections.get(port)
    reads = former and context.direction(component, port) == "input"
    cuts = await _cuts(context, former) if former and reads else {}
    leave = Rewire(RewireStep.DISCONNECT, port, cuts=cuts, revision=context.revision)
    left = await context.controls.rewire(component, leave).view()
    _note_incomplete(context, left, f"{component}.{port}: not all of {former!r} before it was disconnected")


def _note_incomplete(context: ExecutionContext, switched: ComponentView, what: str) -> None:
    if switched.detail.get("complete") is False:
        context.kit.event("adaptation.incomplete_switch", f"{what} has come")


async def _connected_readers(context: ExecutionContext, topic: str) -> tuple[str, ...]:
    """Return the components that read ``topic`` now, without those that are gone."""
    asked = [context.controls.read(name) for name in context.readers(topic)]
    connected = []
    for one in asked:
        view = await _unless_absent(context, one)
        if view is not None and topic in view.connections.values():
            connected.append(view.component)
    return tuple(connected)


async def _unless_absent(context: ExecutionContext, asked: PendingQuery) -> ComponentView | None:
    """Return an answer, None from a component that is gone, or that hangs and is not needed; raises ControlFailed."""
    try:
        return await asked.view()
    except NoAnswer as error:
        following = context.after.components.get(asked.component)
        if error.gone or following is None or following.state is not State.ACTIVE:
            return None
        raise


async def _bind(context: ExecutionContext, readers: Iterable[str], port: str, topic: str, writers: list[str]) -> None:
    """Have markers put until every reader has seen every writer's; raises ControlFailed at the bound."""
    patience = Patience(context.bounds.bind)
    peers = await _mark(context, writers, topic)
    waiting = tuple(readers) if peers else ()
    while True:
        await_them = Rewire(RewireStep.AWAIT, port, topic, tuple(peers.values()))
        asked = [(reader, context.controls.rewire(reader, await_them)) for reader in waiting]
        missing: dict[str, list[str]] = {}
        for reader, one in asked:
            view = await one.view()
            missing[reader] = [str(name) for name in view.detail.get("missing", [])]
        waiting = tuple(reader for reader in waiting if missing[reader])
        if not waiting:
            return
        late = sorted({name for names in missing.values() for name in names})
        if patience.is_over():
            raise ControlFailed(
                f"{', '.join(waiting)}: no marker of {', '.join(late)} has come through on {topic!r} "
                f"within {context.bounds.bind:g} s"
            )
        await _mark(context, late, topic)


async def _mark(context: ExecutionContext, writers: list[str], topic: str) -> dict[str, Peer]:
    """Have writers put markers; returns the runs that did, without those that are gone or write elsewhere."""
    asked = [(name, context.controls.rewire(name, Rewire(RewireStep.MARK, topic=topic))) for name in writers]
    peers = {}
    for name, one in asked:
        try:
            view = await _unless_absent(context, one)
        except ControlFailed as error:
            if error.code is ControlCode.REFUSED:
                continue
            raise
        if view is not None:
            context.touch(name)
            peers[name] = Peer(name, view.incarnation)
    return peers


async def _cuts(context: ExecutionContext, topic: str) -> dict[str, int]:
    """Return how far each publisher of ``topic`` has come; one that does not report it is not waited for."""
    mark = Rewire(RewireStep.MARK, topic=topic)
    asked = [(name, context.controls.rewire(name, mark, OLD_PUBLISHER_TIMEOUT)) for name in context.writers(topic)]
    cuts = {}
    for name, one in asked:
        try:
            view = await one.view()
        except ControlFailed as error:
            if error.code is ControlCode.FENCED:
                raise
            continue
        cuts[name] = int(view.detail.get("sequence", 0))
    return cuts
