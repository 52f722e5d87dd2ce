"""Publications of both sides of the clock's protocol: plain puts, outside the numbering of data."""

from __future__ import annotations

from regraft.bus.interface import Bus, Publisher
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of


class ClockPublisher:
    """Publishers for the clock's messages, declared when first used."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._publishers: dict[str, Publisher] = {}

    def put(self, key: str, message: object) -> None:
        """Put a message of the clock's protocol."""
        publisher = self._publishers.get(key)
        if publisher is None:
            encoding = type_of(type(message)).encoding
            publisher = self._publishers[key] = self._bus.publisher(key, encoding, reliable=True)
        publisher.put(codec.encode(message), b"")

    def close(self) -> None:
        """Undeclare all."""
        for publisher in self._publishers.values():
            publisher.close()
        self._publishers.clear()
