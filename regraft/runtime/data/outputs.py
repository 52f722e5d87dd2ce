"""The outputs of a running component."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.model.lifecycle import State
from regraft.component.errors import NotActive
from regraft.component.ports import Output
from regraft.runtime.data.status_reporter import StatusReporter
from regraft.runtime.data.writers import Writer, Writers

M = TypeVar("M")

MAY_PUBLISH = (State.ACTIVE, State.ACTIVATING, State.DEACTIVATING, State.SHUTTING_DOWN)
"""The states that may publish. Shutdown passes through deactivation, where a command to stop is still allowed."""


class LiveOutput(Generic[M]):
    """An output as the component writes it."""

    def __init__(self, declared: Output[M], writers: Writers, reporter: StatusReporter) -> None:
        self.declared = declared
        self.name = declared.name
        self.wanted_in_step: bool | None = None
        self._kind = type_of(declared.message)
        self._writers = writers
        self._writer: Writer | None = None
        self._reporter = reporter

    def connect(self, key: str, *, reliable: bool) -> Writer:
        """Write at ``key`` from now on; the former key stays declared until it is closed."""
        self._writer = self.open(key, reliable=reliable)
        return self._writer

    def open(self, key: str, *, reliable: bool) -> Writer:
        """Declare ``key`` next to the one in use, without writing there yet; ``reliable`` as its topic is."""
        return self._writers.open(key, self._kind.encoding, reliable=self.declared.reliable and reliable)

    def leave(self) -> None:
        """Write nowhere from now on; the former key stays declared until it is closed."""
        self._writer = None

    def disconnect(self) -> None:
        """Undeclare the key in use."""
        if self._writer:
            self._writers.close(self._writer.key)
            self._writer = None

    @property
    def key(self) -> str:
        """Where it writes; empty while unconnected."""
        return self._writer.key if self._writer else ""

    @property
    def wanted(self) -> bool:
        """Whether anybody reads it: what nobody wants need not be made."""
        if self.wanted_in_step:
            return True
        return self._writer is not None and self._writer.matched

    def publish(self, message: M) -> None:
        """Put a message, at no key while the port is connected to no topic.

        Raises:
            NotActive: the component is not active.
            BadMessage: a field of the message does not fit its type.
        """
        writer, packed = self._active_writer(), self._packed(message)
        if writer is not None:
            writer.put(packed)

    def publish_deferred(self, make: Callable[[], M]) -> None:
        """Publish what ``make`` returns, as of now; in simulated time others need not wait until it is made.

        It is made right behind this step, on this thread, before anything else is handled; readers wait for it only
        when they are to handle it. So heavy work, such as rendering, continues while time does. ``make`` must use what
        is now, not what it finds later. Under the real clock it is made at once. If it raises, or a field does not fit,
        that is reported, and the message counts as lost.

        In simulated time it is made only for subscribers, and for readers on demand when they open it.

        Raises:
            NotActive: the component is not active.
        """
        writer = self._active_writer()
        if writer is not None:
            writer.put_deferred(lambda: self._packed(make()))

    def _active_writer(self) -> Writer | None:
        if self._reporter.status.state not in MAY_PUBLISH:
            raise NotActive(f"output {self.name!r}: only an active component publishes")
        return self._writer

    def _packed(self, message: M) -> bytes:
        if type(message) is not self.declared.message:
            raise TypeError(
                f"output {self.name!r} publishes {self.declared.message.__name__}, not {type(message).__name__}"
            )
        return codec.encode_as(self._kind, message)


Outputs = dict[str, LiveOutput[Any]]
