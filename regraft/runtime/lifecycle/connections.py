"""The ports of one component on the bus: which keys they read and write, and whether they are paused."""

from __future__ import annotations

from regraft.bus.interface import Closable
from regraft.bus_schema.model.robots.scopes import in_scope
from regraft.runtime.data.hold_buffer import HoldBuffer
from regraft.runtime.data.inputs import TopicReader
from regraft.runtime.parts import Parts


class Connections:
    """The connections of one component's ports to topics."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._subscriptions: dict[str, Closable] = {}
        self._connected = False
        self._hold_buffer: HoldBuffer | None = None

    def connect(self) -> None:
        """Connect all ports before the component is configured. Nothing is handled until it is active."""
        if self._connected:
            return
        self._connected = True
        parts = self._parts
        for name, port in parts.inputs.items():
            key = self._key(name, port.declared.topic)
            if key:
                port.connect(key, reliable=parts.is_reliable(key))
                self.also_read(name, key)
        for name, output in parts.outputs.items():
            key = self._key(name, output.declared.topic)
            if key:
                output.connect(key, reliable=parts.is_reliable(key))

    @property
    def connected(self) -> bool:
        """Whether the ports are connected, apart from those that are to have no topic."""
        return self._connected

    def _key(self, port: str, topic: str | None) -> str:
        """Return the key of a port, empty for one that is to have no topic."""
        assignment = self._parts.assignment
        usual = in_scope(assignment.scope, topic or port)
        connected = assignment.connections.get(port, usual)
        return "" if connected is None else self._parts.keys.topic(connected)

    def also_read(self, name: str, key: str) -> None:
        """Subscribe an input's second key, next to the one it has."""
        parts = self._parts
        port = parts.inputs[name]
        reader = parts.reader(key)
        if reader is None:
            reader = TopicReader((port,))
            if port.on_demand:
                parts.inbound.add_on_demand(key, reader)
                return
            parts.inbound.add(key, reader)
        elif port not in reader.ports:
            reader.read_by(*reader.ports, port)
        if key not in self._subscriptions and not port.on_demand:
            parts.inbound.end_on_demand(key)
            self._subscriptions[key] = parts.bus.subscribe(key, parts.take_in)

    def stop_reading(self, name: str, key: str) -> None:
        """Take an input off a key. The subscription ends with its last reader."""
        parts = self._parts
        reader = parts.reader(key)
        port = parts.inputs[name]
        if reader is None or port not in reader.ports:
            return
        reader.read_by(*(other for other in reader.ports if other is not port))
        if not reader.ports:
            parts.inbound.remove(key)
            subscription = self._subscriptions.pop(key, None)
            if subscription:
                subscription.close()

    def disconnect(self) -> None:
        """Take all ports off the bus, and forget what they received."""
        self._connected = False
        self._hold_buffer = None
        for name, port in self._parts.inputs.items():
            for key in filter(None, (port.key, port.move.key if port.move else "")):
                self.stop_reading(name, key)
            port.key, port.move, port.paused, port.hold_buffer = "", None, True, None
            port.forget()
        for output in self._parts.outputs.values():
            output.disconnect()

    def pause(self) -> None:
        """Drop what comes for the inputs, but for those that hold it."""
        self._set_paused(True)

    def hold(self) -> None:
        """Keep what comes for the reliable inputs until they resume."""
        self._hold_buffer = HoldBuffer()
        for port in self._parts.inputs.values():
            if port.reliable:
                port.hold_buffer = self._hold_buffer

    def resume(self) -> None:
        """Handle what comes for the inputs, first what was held."""
        self._set_paused(False)
        hold_buffer, self._hold_buffer = self._hold_buffer, None
        for port in self._parts.inputs.values():
            port.hold_buffer = None
        if hold_buffer is not None:
            self._parts.handle_first(hold_buffer.take_all())

    def _set_paused(self, paused: bool) -> None:
        for port in self._parts.inputs.values():
            if port.hold_buffer is None:
                port.paused = paused
