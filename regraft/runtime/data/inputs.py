"""The inputs of a running component."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_encoded, type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.handover import HeldSample
from regraft.component.future import Future
from regraft.component.ports import Input
from regraft.runtime.data.fetching import Fetching, is_notice
from regraft.runtime.data.hold_buffer import HoldBuffer
from regraft.runtime.data.move_buffer import MoveBuffer

M = TypeVar("M")


class Reporter(Protocol):
    """The listener for messages that cannot be handled or never came, and for handlers that fail."""

    def refused(self, where: str, source: str, why: str) -> None:
        """A message was refused."""

    def lost(self, where: str, source: str, count: int) -> None:
        """Messages were lost."""

    def fault(self, where: str, error: BaseException) -> None:
        """An exception came out of an author's method."""

    def event(self, kind: str, text: str) -> None:
        """Something happened that people should know."""


class LiveInput(Generic[M]):
    """An input as the component reads it."""

    def __init__(
        self,
        declared: Input[M],
        handle: Callable[[M], object] | None,
        reporter: Reporter,
        fetching: Fetching | None = None,
    ) -> None:
        """Start without a message, paused; ``handle`` is called with every message, if given.

        With ``fetching``, an input that is read on demand gets by it what it opens.
        """
        self.declared = declared
        self._fetching = fetching if declared.on_demand else None
        self.name = declared.name
        self.reliable = not declared.latest_only
        self.paused = True
        self.hold_buffer: HoldBuffer | None = None
        self.key = ""
        self.move: MoveBuffer | None = None
        self._handle = handle
        self._reporter = reporter
        self._kind = type_of(declared.message) if declared.message else None
        self._newest: Sample | None = None
        self._latest: M | None = None
        self._attachment = b""
        self._kept: deque[M] = deque(maxlen=declared.keep or 1)
        self._waiters: list[Future[M]] = []

    def connect(self, key: str, *, reliable: bool) -> None:
        """Read ``key`` from now on; holes are waited for and reported if its topic is ``reliable``."""
        self.key, self.reliable = key, reliable and not self.declared.latest_only

    @property
    def latest(self) -> M | None:
        """The newest message, None before the first."""
        if self._newest is not None:
            newest, self._newest = self._newest, None
            self._keep(self._read(newest))
        return self._latest

    def opener(self) -> Callable[[], M | None] | None:
        """Return what opens the newest message as of now; None before the first."""
        newest, known = self._newest, self._latest
        if newest is None:
            return None if known is None else lambda: known

        def open_then() -> M | None:
            if self._newest is newest:
                return self.latest
            read = self._read(newest)
            return read[0] if read is not None else None

        return open_then

    @property
    def on_demand(self) -> bool:
        """Whether it hears of messages only by notices, and fetches those that it opens."""
        return self._fetching is not None

    @property
    def envelope(self) -> Envelope | None:
        """The envelope of the message that ``latest`` last returned, or that is being handled; None before any."""
        return Envelope.from_bytes(self._attachment) if self._attachment else None

    @property
    def stamp(self) -> float | None:
        """When that message was true, in seconds: its own ``stamp``, else when it was published; None before any."""
        envelope = self.envelope
        if envelope is None:
            return None
        own = getattr(self._latest, "stamp", None)
        return float(own) if isinstance(own, int | float) else envelope.stamp / 1e9

    def take(self) -> list[M]:
        """Return the messages that came since the last call, oldest first; raises TypeError without ``keep``."""
        if not self.declared.keep:
            raise TypeError(f"the input {self.name!r} keeps nothing to take: declare it with keep=N")
        taken = list(self._kept)
        self._kept.clear()
        return taken

    def next(self) -> Future[M]:
        """Return what the next message resolves: ``await self.image.next()``."""
        waiting: Future[M] = Future()
        self._waiters = [other for other in self._waiters if not other.abandoned]
        self._waiters.append(waiting)
        return waiting

    @property
    def wakes(self) -> bool:
        """Whether a new message is to be handled at once, rather than found when it is looked for."""
        if self._handle is not None:
            return True
        return bool(self._waiters) and any(not waiting.abandoned for waiting in self._waiters)

    def forget_notices(self, sources: Container[str] | None = None) -> None:
        """Drop the notice of a message that nobody can make any more, if it is of these sources; None: of any."""
        newest = self._newest
        if newest is None or not is_notice(newest):
            return
        if sources is None or Envelope.from_bytes(newest.attachment).source in sources:
            self._newest = None

    def forget(self) -> None:
        """Drop what was received: the component starts again."""
        self._newest = self._latest = None
        self._attachment = b""
        self._kept.clear()
        self._waiters.clear()

    def wrap(self, around: Callable[[Callable[[M], object]], Callable[[M], object]]) -> None:
        """Have what ``around`` makes of the handler called instead of it."""
        if self._handle is not None:
            self._handle = around(self._handle)

    # --- from one run to the next ---

    def hand_over(self) -> tuple[HeldSample, ...]:
        """Return the newest message, if any, then those that are kept."""
        sample = self._opened(self._newest) if self._newest is not None else None
        newest: tuple[HeldSample, ...] = ()
        if sample is not None:
            newest = (HeldSample(*sample),)
        elif self._latest is not None:
            newest = (self._held(self._latest, self._attachment),)
        return newest + tuple(self._held(message, b"") for message in self._kept)

    def _held(self, message: M, attachment: bytes) -> HeldSample:
        return HeldSample(self.key, codec.encode(message), attachment, type_of(type(message)).encoding)

    def take_over(self, newest: Sample | None, kept: Iterable[Sample]) -> None:
        """Have received what the previous run had received; handlers do not get it again."""
        self.forget()
        self._newest = newest
        for sample in kept:
            message = self._decoded(sample)
            if message is not None:
                self._kept.append(message)

    # --- as a consumer of samples ---

    def deliver(self, sample: Sample) -> None:
        """Take a sample in its turn; one from the key that the input is moving to waits for the switch."""
        if self.move is not None and sample.key == self.move.key:
            self.move.keep(sample)
            return
        if self.paused or sample.key != self.key:
            return
        if self.hold_buffer is not None:
            self.hold_buffer.keep(self, sample)
            return
        self._newest = sample
        if self._handle is None and not self._waiters and not self.declared.keep:
            return
        self._newest = None
        read = self._read(sample)
        self._keep(read)
        if read is None:
            return
        message, _ = read
        if self.declared.keep:
            self._kept.append(message)
        if self._waiters:
            waiters, self._waiters = self._waiters, []
            for waiting in waiters:
                waiting.resolve(message)
        if self._handle is not None:
            try:
                self._handle(message)
            except Exception as error:
                self._reporter.fault(self.name, error)

    def _read(self, sample: Sample) -> tuple[M, bytes] | None:
        """Return the message of a sample or notice, with its envelope; None if there is none."""
        opened = self._opened(sample)
        message = self._decoded(opened) if opened is not None else None
        return (message, opened.attachment) if opened is not None and message is not None else None

    def _keep(self, read: tuple[M, bytes] | None) -> None:
        if read is not None:
            self._latest, self._attachment = read

    def _opened(self, sample: Sample) -> Sample | None:
        """Return a sample as it is, for a notice what it stands for: None if that is not to be had any more."""
        if self._fetching is None or not is_notice(sample):
            return sample
        return self._fetching.fetch(sample)

    def _decoded(self, sample: Sample) -> M | None:
        kind = self._kind or type_encoded(sample.encoding)
        if kind is None or sample.encoding != kind.encoding:
            wanted = f"be {kind.encoding!r}" if kind else "be of a type that is known here"
            self._refuse_sample(sample, f"has the encoding {sample.encoding!r}, must {wanted}")
            return None
        try:
            message: M = codec.decode_as(kind, sample.payload)
        except BadMessage as error:
            self._refuse_sample(sample, str(error))
            return None
        return message

    def _refuse_sample(self, sample: Sample, why: str) -> None:
        self.refuse(Envelope.from_bytes(sample.attachment).source, why)

    def refuse(self, source: str, why: str) -> None:
        """Count and report a message that cannot be handled."""
        self._reporter.refused(f"input {self.name!r}", source, f"{self._kind.name if self._kind else 'message'} {why}")

    def report_lost(self, source: str, count: int) -> None:
        """Count and report messages that never came."""
        if self.reliable:
            self._reporter.lost(f"input {self.name!r}", source, count)


class NewestInput(LiveInput[M]):
    """A ``latest_only`` input with a handler, under the real clock: the handler leaves out what was overtaken.

    While more waits in the inbox, a newer message may be among it. So the handler is called behind that.
    """

    def __init__(self, declared: Input[M], handle: Callable[[M], object], reporter: Reporter, inbox: Inbox) -> None:
        super().__init__(declared, None, reporter)
        self._see = handle
        self._inbox = inbox
        self._in_line = False
        self._due: bytes | None = None

    @property
    def wakes(self) -> bool:
        """Whether a new message is to be handled at once."""
        return True

    def wrap(self, around: Callable[[Callable[[M], object]], Callable[[M], object]]) -> None:
        """Have what ``around`` makes of the handler called instead of it."""
        self._see = around(self._see)

    def deliver(self, sample: Sample) -> None:
        """Take a sample in its turn, and handle it unless a newer one may have come."""
        super().deliver(sample)
        if self.paused or sample.key != self.key:
            return
        self._due = sample.attachment
        if self._in_line:
            return
        if self._inbox.empty():
            self._handle_due()
        else:
            self._in_line = True
            self._inbox.put(self._take_turn)

    def handle_before_its_turn(self) -> bool:
        """Have the message in line handled now, for what comes behind it cannot wait; return whether there was one."""
        if self._due is None or self.paused:
            return False
        self._handle_due()
        return True

    def _take_turn(self) -> None:
        self._in_line = False
        if self.paused:
            self._due = None
        else:
            self._handle_due()

    def _handle_due(self) -> None:
        """Have the newest message handled, unless it cannot be read, or was handled before its turn."""
        due, self._due = self._due, None
        message = self.latest
        if due is None or message is None or self._attachment is not due:
            return
        try:
            self._see(message)
        except Exception as error:
            self._reporter.fault(self.name, error)


Inputs = dict[str, LiveInput[Any]]


@dataclass(slots=True)
class TopicReader:
    """All inputs of one component that read the same key."""

    ports: tuple[LiveInput[Any], ...]
    deliver: Callable[[Sample], None] = field(init=False)
    """Hands a sample to every input; with one input, that one's own."""

    def __post_init__(self) -> None:
        self.read_by(*self.ports)

    def read_by(self, *ports: LiveInput[Any]) -> None:
        """Have these inputs read the key from now on."""
        self.ports = ports
        self.deliver = ports[0].deliver if len(ports) == 1 else self._deliver_to_all

    @property
    def reliable(self) -> bool:
        """Whether holes are waited for."""
        return any(port.reliable for port in self.ports)

    @property
    def paused(self) -> bool:
        """Whether nobody reads now."""
        for port in self.ports:  # noqa: SIM110  asked for every sample: a generator costs three times as much
            if not port.paused or port.move is not None:
                return False
        return True

    @property
    def wakes(self) -> bool:
        """Whether a new sample is to be handled at once."""
        for port in self.ports:  # noqa: SIM110  asked after every step
            if port.wakes or port.move is not None:
                return True
        return False

    def _deliver_to_all(self, sample: Sample) -> None:
        for port in self.ports:
            port.deliver(sample)

    def forget_notices(self, sources: Container[str] | None = None) -> None:
        """Drop notices of what nobody can make any more, of some sources or of all."""
        for port in self.ports:
            port.forget_notices(sources)

    def refuse(self, source: str, why: str) -> None:
        """Report a sample that is no message, once."""
        self.ports[0].refuse(source, why)

    def report_lost(self, source: str, count: int) -> None:
        """Report a loss, once: for the first input that is to get every message."""
        for port in self.ports:
            if port.reliable:
                port.report_lost(source, count)
                return
