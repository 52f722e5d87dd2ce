"""The bus that the kit needs. ``zenoh_bus`` is the real one, ``memory_bus`` the one for fast tests.

All that arrives is handed to a *sink* as it comes, on any thread; the receiver's own thread then opens it. So nothing
but a queue's ``put`` ever runs on a network thread.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

Sink = Callable[[Any], object]


class BusError(Exception):
    """The bus cannot do what was asked: not reachable, closed, refused."""


class Sample(NamedTuple):
    """A message as it came: key, payload, attachment (the envelope) and encoding (the type).

    One is made per message, and a named tuple is made in half the time of a frozen dataclass.
    """

    key: str
    payload: bytes
    attachment: bytes
    encoding: str


@dataclass(frozen=True, slots=True)
class Presence:
    """A liveliness token has appeared or gone."""

    key: str
    present: bool


class Query(Protocol):
    """A question to answer once."""

    @property
    def key(self) -> str:
        """The key expression that was asked."""

    @property
    def payload(self) -> bytes:
        """The payload and envelope of the query."""

    def reply(self, payload: bytes, *, error: bool = False) -> None:
        """Answer; a second answer is ignored."""

    def drop(self) -> None:
        """Leave it to others to answer."""


class Closable(Protocol):
    """Something declared on the bus, until it is closed."""

    def close(self) -> None:
        """Undeclare it; again does nothing."""


class Publisher(Closable, Protocol):
    """Puts samples at one key."""

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Put one sample; blocks, within bounds, where the publisher is reliable."""

    @property
    def matched(self) -> bool:
        """Whether somebody subscribes to the key."""


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer to a query: its payload, and whether it is an error."""

    key: str
    payload: bytes
    error: bool


class Bus(Protocol):
    """One session of one process."""

    def publisher(self, key: str, encoding: str, *, reliable: bool) -> Publisher:
        """Declare a publisher."""

    def subscribe(self, key: str, sink: Sink) -> Closable:
        """Hand every sample whose key matches to ``sink``, unopened."""

    def serve(self, key: str, sink: Sink) -> Closable:
        """Hand every query whose key matches to ``sink``, unopened."""

    def open_sample(self, item: Any) -> Sample | None:
        """Open what a subscription handed to its sink; None for what is no sample."""

    def open_query(self, item: Any) -> Query | None:
        """Open what a ``serve`` handed to its sink; None for what is no query."""

    def query(self, key: str, payload: bytes, timeout: float, *, all_of_them: bool = False) -> list[Answer]:
        """Ask and wait for the answer (or all answers); an empty list if nobody answers in ``timeout`` seconds."""

    def ask(self, key: str, payload: bytes, timeout: float, done: Callable[[list[Answer]], object]) -> None:
        """Ask without waiting: ``done`` gets the first answer, if any, on some thread, within ``timeout`` seconds."""

    def announce(self, key: str) -> Closable:
        """Declare a liveliness token."""

    def watch(self, key: str, sink: Callable[[Presence], object]) -> Closable:
        """Hand the presence of every matching token to ``sink``, those already there first."""

    def present(self, key: str, timeout: float) -> list[str]:
        """Return the keys of the matching tokens that are there now."""

    def when_renewed(self, call: Callable[[], object]) -> None:
        """Have something called, on some thread, whenever a broken link has been replaced by another."""

    def close(self) -> None:
        """Leave the bus, within bounds; again does nothing."""
