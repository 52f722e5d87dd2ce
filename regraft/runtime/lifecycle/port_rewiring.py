"""Moves a port while messages flow: open the new topic next to the old, wait for markers, switch.

A publisher puts a marker behind its last sample. An input that has seen the markers of all publishers of the new topic
misses none of their later samples. Once the old topic is handled up to its own markers, nothing of it is missing
either. Only then is the old one closed. The same works for busy and for silent publishers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from regraft.bus_schema.keys import topic_name
from regraft.bus_schema.messages.protocol.control import Peer, Rewire, RewireStep
from regraft.runtime.core.pending import Pending
from regraft.runtime.data.inbound import Frontier
from regraft.runtime.data.inputs import LiveInput
from regraft.runtime.data.move_buffer import MoveBuffer
from regraft.runtime.data.stream import Stream
from regraft.runtime.lifecycle.connections import Connections
from regraft.runtime.parts import Parts

Finish = Callable[[bool], dict[str, object]]
"""Ends a step, with whether all has come that was to be handled; returns the detail of its answer."""


class RewiringRefused(Exception):
    """A step of rewiring that does not fit; the text states why."""


class Rewiring:
    """The rewiring of one component's ports."""

    def __init__(self, parts: Parts, connections: Connections) -> None:
        self._parts = parts
        self._connections = connections
        self._seen: dict[tuple[str, str], tuple[int, int]] = {}
        self._opened: dict[str, str] = {}

    def step(self, step: Rewire) -> dict[str, object] | Pending:
        """Perform one step; returns the detail of its answer, or that it has to wait.

        Raises:
            RewiringRefused: the port, the topic or the order of steps is wrong.
        """
        steps: dict[RewireStep, Callable[[Rewire], dict[str, object] | Pending]] = {
            RewireStep.READ: lambda _: {},
            RewireStep.OPEN: self._open,
            RewireStep.MARK: self._mark,
            RewireStep.AWAIT: self._await,
            RewireStep.SWITCH: self._switch,
            RewireStep.ABANDON: self._abandon,
            RewireStep.DISCONNECT: self._disconnect,
        }
        return steps[step.step](step)

    def saw_marker(self, key: str, source: str, stream: Stream) -> None:
        """Note a marker, for the inputs that wait for it."""
        handled = stream.handled or 0
        self._seen[key, source] = (stream.incarnation, handled)
        for port in self._parts.inputs.values():
            if port.move is not None and port.move.key == key:
                port.move.marks.setdefault(source, (stream.incarnation, handled))

    def forget(self) -> None:
        """Give up every move of an output that was begun: the component leaves the bus, or its ports do."""
        for key in self._opened.values():
            self._parts.writers.close(key)
        self._opened.clear()

    def _key(self, step: Rewire) -> str:
        return self._parts.keys.topic(topic_name(step.topic))

    def _open(self, step: Rewire) -> dict[str, object]:
        key = self._key(step)
        port = self._parts.inputs.get(step.port)
        if port is not None:
            self._refuse_unless_connected(step)
            if key == port.key:
                raise RewiringRefused(f"input {step.port!r} is connected to {step.topic!r} already")
            if port.move is not None and port.move.key != key:
                raise RewiringRefused(f"input {step.port!r} is on its way to another topic")
            port.move = port.move or MoveBuffer(key)
            self._connections.also_read(step.port, key)
            return {}
        output = self._parts.outputs.get(step.port)
        if output is None:
            raise RewiringRefused(f"there is no port {step.port!r}")
        self._refuse_unless_connected(step)
        self._opened[step.port] = key
        writer = output.open(key, reliable=self._parts.is_reliable(key))
        writer.mark()
        return {"sequence": writer.sequence}

    def _mark(self, step: Rewire) -> dict[str, object]:
        writer = self._parts.writers.open_keys.get(self._key(step))
        if writer is None:
            raise RewiringRefused(f"no output is connected to {step.topic!r}")
        writer.mark()
        return {"sequence": writer.sequence}

    def _await(self, step: Rewire) -> Pending:
        key = self._key(step)

        def missing() -> list[str]:
            return [peer.component for peer in step.peers if not self._has_seen(key, peer, step.port)]

        return Pending(lambda: not missing(), lambda: {"missing": missing()})

    def _has_seen(self, key: str, peer: Peer, port_name: str) -> bool:
        if key in self._parts.inbound.on_demand:
            return True  # nobody is to send it anything
        port = self._parts.inputs.get(port_name)
        if port is not None and port.move is not None and port.move.key == key:
            return port.move.marks.get(peer.component, (0, 0))[0] == peer.incarnation
        return self._seen.get((key, peer.component), (0, 0))[0] == peer.incarnation

    def _switch(self, step: Rewire) -> Pending | dict[str, object]:
        port = self._parts.inputs.get(step.port)
        if port is not None:
            return self._switch_input(port, step)
        output = self._parts.outputs.get(step.port)
        key = self._key(step)
        if output is None or self._opened.get(step.port) != key:
            raise RewiringRefused(f"port {step.port!r} has not been opened towards {step.topic!r}")
        self._refuse_unless_connected(step)
        old, cut = output.key, self._cut(output.key)
        output.connect(key, reliable=self._parts.is_reliable(key))
        del self._opened[step.port]
        self._close_unless_written(old)
        return {"cut": cut}

    def _cut(self, key: str) -> int:
        """Put a marker at a key that an output leaves; returns the sequence that the key has come to."""
        writer = self._parts.writers.open_keys.get(key)
        if writer is None:
            return 0
        writer.mark()
        return writer.sequence

    def _close_unless_written(self, key: str) -> None:
        if not any(output.key == key for output in self._parts.outputs.values()):
            self._parts.writers.close(key)

    def _disconnect(self, step: Rewire) -> Pending | dict[str, object]:
        self._abandon(step)
        port, output = self._parts.inputs.get(step.port), self._parts.outputs.get(step.port)
        if port is None and output is None:
            raise RewiringRefused(f"there is no port {step.port!r}")
        self._refuse_unless_connected(step)
        if port is not None:
            return self._when_handled(port, step, partial(self._leave, port)) if port.key else {}
        assert output is not None
        old, cut = output.key, self._cut(output.key)
        output.leave()
        self._close_unless_written(old)
        return {"cut": cut}

    def _refuse_unless_connected(self, step: Rewire) -> None:
        if not self._connections.connected:
            raise RewiringRefused(f"port {step.port!r} is not connected while the component is unconfigured")

    def _switch_input(self, port: LiveInput[object], step: Rewire) -> Pending:
        if port.move is None or port.move.key != self._key(step):
            raise RewiringRefused(f"input {step.port!r} has not been opened towards {step.topic!r}")
        return self._when_handled(port, step, partial(self._finish_switch, port))

    def _when_handled(self, port: LiveInput[object], step: Rewire, finish: Finish) -> Pending:
        """Finish once what has been put by the cuts is handled, or was waited for in vain."""
        old = port.key
        if self._parts.stepped:
            frontier = {old: {source: cut for source, cut in step.cuts.items() if cut > 0}}
            return self._when_handled_in_step(frontier, finish)

        def handled() -> bool:
            streams = self._parts.inbound.streams
            return all(
                (stream := streams.get((old, source))) is not None and (stream.handled or 0) >= cut
                for source, cut in step.cuts.items()
                if cut > 0
            )

        return Pending(handled, lambda: finish(handled()))

    def _when_handled_in_step(self, frontier: Frontier, finish: Finish) -> Pending:
        """Finish in a slot: what wakes nobody still waits for the component's next step, and is delivered now."""
        inbound = self._parts.inbound

        def deliver() -> dict[str, object]:
            complete = inbound.reaches(frontier)
            inbound.release(frontier)
            self._parts.work()
            return finish(complete)

        return Pending(lambda: inbound.reaches(frontier), deliver)

    def _leave(self, port: LiveInput[object], complete: bool) -> dict[str, object]:
        old, port.key = port.key, ""
        self._connections.stop_reading(port.name, old)
        return {"complete": complete}

    def _finish_switch(self, port: LiveInput[object], complete: bool) -> dict[str, object]:
        move = port.move
        if move is None:
            return {"complete": complete}
        old, port.move = port.key, None
        port.connect(move.key, reliable=self._parts.is_reliable(move.key))
        self._connections.stop_reading(port.name, old)
        if not port.paused:  # an inactive component was to handle none of them
            for source, count in move.lost().items():
                port.report_lost(source, count)
        self._parts.handle_first([(port, sample) for sample in move.ours()])
        return {"complete": complete}

    def _abandon(self, step: Rewire) -> dict[str, object]:
        port = self._parts.inputs.get(step.port)
        if port is not None and port.move is not None:
            key, port.move = port.move.key, None
            self._connections.stop_reading(step.port, key)
        opened = self._opened.pop(step.port, None)
        if opened:
            self._close_unless_written(opened)
        return {}
