"""Ports of a component that runs, as its author uses them: ``self.NAME`` of each declared `Input` and `Output`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from regraft.bus_schema.encoding.envelope import Envelope
from regraft.component.future import Future

M = TypeVar("M")
M_contra = TypeVar("M_contra", contravariant=True)


class InputPort(Protocol[M]):
    """An input of a component that runs."""

    @property
    def name(self) -> str:
        """The port's name."""

    @property
    def key(self) -> str:
        """The key on the bus that it reads; empty while unconnected."""

    @property
    def latest(self) -> M | None:
        """The newest message, None before the first."""

    def opener(self) -> Callable[[], M | None] | None:
        """Return what opens the newest message as of now, also later; None before the first.

        A deferred message may be made of it. It returns None if the message is not to be had any more: an input that
        reads on demand may come too late.
        """

    @property
    def envelope(self) -> Envelope | None:
        """The envelope of the message that ``latest`` last returned, or that is being handled; None before any."""

    @property
    def stamp(self) -> float | None:
        """When that message was true, in seconds: its own ``stamp``, else when it was published; None before any."""

    def take(self) -> list[M]:
        """Return the messages that came since the last call, oldest first; raises TypeError without ``keep``."""

    def next(self) -> Future[M]:
        """Return the future of the next message: ``await self.image.next()``."""


class OutputPort(Protocol[M_contra]):
    """An output of a component that runs."""

    @property
    def name(self) -> str:
        """The port's name."""

    @property
    def key(self) -> str:
        """The key on the bus that it writes; empty while unconnected."""

    @property
    def wanted(self) -> bool:
        """Whether the topic has a reader: a message without one need not be made."""

    def publish(self, message: M_contra) -> None:
        """Publish a message.

        Raises:
            NotActive: the component is not active.
            BadMessage: a field of the message does not fit its type.
        """

    def publish_deferred(self, make: Callable[[], M_contra]) -> None:
        """Publish what ``make`` returns, as of now; in simulated time others need not wait until it is made.

        It is made right behind this step, on this thread, before anything else is handled; readers wait for it only
        when they are to handle it. So heavy work, such as rendering, continues while time does. ``make`` must use what
        is now, not what it finds later. Under the real clock it is made at once. If it raises, or a field does not fit,
        that is reported, and the message counts as lost.

        In simulated time it is made only for subscribers, and for readers on demand when they open it.

        Raises:
            NotActive: the component is not active.
        """


Inputs = Mapping[str, InputPort[Any]]
Outputs = Mapping[str, OutputPort[Any]]
