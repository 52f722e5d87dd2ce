"""The system reflection (ReBeT, section IV): publishes topics' values to missions, by a mapping in the stack file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from regraft import Component, Future, Input, InputPort, Output, Records
from regraft.bus_schema.annotations import Bounds, Text, Unit
from regraft.bus_schema.encoding.reading import Reading, Reduce, read
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.reflection import ReflectedEntries, ReflectedEntry
from regraft.bus_schema.model.description import Resources

ENTRY = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
RESERVED = ("_age", "_stale")
"""How the entries end that the executor adds to each entry."""


@dataclass(frozen=True, slots=True)
class Mapped:
    """One blackboard entry: a field of a topic's messages, what is made of it, and how often a second at the most."""

    topic: Annotated[str, Text(200)]
    field: Annotated[str, Text(200)]
    entry: Annotated[str, Text(100)]
    rate: Annotated[float, Unit("Hz"), Bounds(0.001, 1000.0)]
    reduce: Reduce | None = None
    at_least: float | None = None
    if_none: float | None = None
    stale_after: Annotated[float, Unit("s"), Bounds(minimum=0.0)] | None = None

    def __post_init__(self) -> None:
        if not ENTRY.fullmatch(self.entry):
            raise BadMessage(f"{self.entry!r} must be a letter, then letters, digits and '_'", ("entry",))
        if self.entry.endswith(RESERVED):
            raise BadMessage(f"{self.entry!r} must not end in {' or '.join(map(repr, RESERVED))}", ("entry",))
        if self.at_least is not None and self.reduce not in (Reduce.MIN, Reduce.MAX, Reduce.MEAN):
            raise BadMessage("is for reduce: min, max and mean", ("at_least",))

    @property
    def reading(self) -> Reading:
        """Return the fields that are read from each message."""
        return Reading(self.field, self.reduce, self.at_least, self.if_none)


class SystemReflection(Component):
    """Puts topics into the root blackboard of missions, by a mapping.

    Each entry is an input of its own, named like the entry; rewire it to have the entry come from another topic. Values
    are reported at once, but at most ``rate`` times a second, then the newest. An empty field reports nothing.
    """

    resources = Resources(cpu=0.02, memory=20.0)

    mapping = Records(Mapped, "which field of which topic is which entry, how often, and what is made of it")

    reflection = Output(ReflectedEntries, description="the entries, whenever one of them is new")

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any]]:
        """Name an input per entry, which takes any message that has the field."""
        for index, mapped in enumerate(parameters["mapping"]):
            yield Input(
                None,
                topic=mapped.topic,
                latest_only=True,
                required=False,
                description=f"for {{@{mapped.entry}}}",
                reads=(mapped.reading,),
                name=mapped.entry,
                origin=f"mapping.{index}",
            )

    def on_activate(self) -> None:
        """Begin without values, and publish that: readers then know which entries there will be."""
        self._entries = [_Entry(mapped, self.kit.inputs[mapped.entry]) for mapped in self.mapping]
        if not self._entries:
            return
        self._tell()
        self._news: Future[None] = Future()
        self.kit.spawn(self._tell_news(), "telling what is new")
        for entry in self._entries:
            self.kit.spawn(self._follow(entry), entry.mapped.entry)

    async def _follow(self, entry: _Entry) -> None:
        """Look at what comes, at once, but not sooner than a period after the last look; nothing wakes it before."""
        while True:
            if not entry.has_come:
                await entry.port.next()
            if self._look(entry):
                self._news.resolve(None)
            await self.kit.sleep(1.0 / entry.mapped.rate)

    async def _tell_news(self) -> None:
        """Report all entries that are new at one time in one message."""
        while True:
            await self._news
            self._news = Future()
            self._tell()

    def _look(self, entry: _Entry) -> bool:
        try:
            return entry.look()
        except BadMessage as error:
            if not entry.failed:
                entry.failed = True
                self.kit.event("reflection.unreadable", f"{entry.mapped.entry}, from {entry.mapped.topic}: {error}")
            return False

    def _tell(self) -> None:
        self.reflection.publish(ReflectedEntries(self.kit.now(), tuple(entry.told for entry in self._entries)))


class _Entry:
    """One entry: its input, and its published value."""

    def __init__(self, mapped: Mapped, port: InputPort[Any]) -> None:
        self.mapped = mapped
        self.told = ReflectedEntry(mapped.entry, stale_after=mapped.stale_after)
        self.failed = False
        self.port = port
        self._reading = mapped.reading
        self._seen: object = None

    @property
    def has_come(self) -> bool:
        """Whether there is a message that has not been looked at."""
        return self.port.latest is not self._seen

    def look(self) -> bool:
        """Read the newest message; return whether that gave a value. Raises BadMessage."""
        self._seen = self.port.latest
        value, envelope = read(self._seen, self._reading), self.port.envelope
        if value is None or envelope is None:
            return False
        self.told = ReflectedEntry(
            self.mapped.entry, value, self.port.stamp, envelope.sequence, self.mapped.stale_after
        )
        return True
