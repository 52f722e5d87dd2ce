"""All that comes in: from raw samples, over streams, to consumers in the order in which they are to be handled."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator, Mapping
from typing import Protocol

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import PLACE, PLACE_ENDS, RUN_ENDS, Envelope, Kind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import matches
from regraft.bus_schema.messages.protocol.control import ResentSample
from regraft.runtime.core.clock import Clock
from regraft.runtime.data.fetching import notice
from regraft.runtime.data.repair import Repair
from regraft.runtime.data.run_check import RunCheck
from regraft.runtime.data.stream import HOLE_TIMEOUT, Arrival, Stream

MAX_STREAMS = 10_000


class Consumer(Protocol):
    """Handles the samples of a key: an input, a service, the replies to this component."""

    @property
    def reliable(self) -> bool:
        """Whether a hole is waited for, and reported."""

    @property
    def paused(self) -> bool:
        """Whether samples are ignored."""

    @property
    def wakes(self) -> bool:
        """Whether a sample is to be handled at once, rather than found when it is looked for."""

    def deliver(self, sample: Sample) -> None:
        """Handle one sample, in its turn; its attachment is an envelope."""

    def refuse(self, source: str, why: str) -> None:
        """Count and report a sample that cannot be handled."""

    def report_lost(self, source: str, count: int) -> None:
        """Count and report samples that never came."""


class NoticeConsumer(Consumer, Protocol):
    """Handles notices, by which it fetches what it opens."""

    def forget_notices(self, sources: Container[str] | None = None) -> None:
        """Drop notices of what nobody can make any more, of some sources or of all."""


Frontier = dict[str, dict[str, int]]


class Inbound:
    """Every stream of one component. ``stepped`` holds samples until their step, otherwise they continue at once."""

    def __init__(
        self,
        clock: Clock,
        *,
        stepped: bool,
        on_marker: Callable[[str, str, Stream], None] | None = None,
        repair: Repair | None = None,
        check: RunCheck | None = None,
    ) -> None:
        """Start without consumers; ``on_marker`` hears of every marker (key, source, stream).

        ``repair`` gets what has not come; without it a hole is given up after a moment. ``check`` finds out which run
        of a source is the newest, where two contradict each other.
        """
        self._repair = repair
        self._check = check
        self.stepped = stepped
        self._clock = clock
        self.on_marker = on_marker
        self.consumers: dict[str, Consumer] = {}
        self.patterns: dict[str, Consumer] = {}
        self.streams: dict[tuple[str, str], Stream] = {}
        self.on_demand: dict[str, NoticeConsumer] = {}
        self._noticed: dict[tuple[str, str], int] = {}
        self.from_outside: set[str] = set()
        self.ready: deque[tuple[Consumer, Sample]] = deque()
        self.holes: set[tuple[str, str]] = set()
        self.giving_up = False
        self._asleep: set[str] = set()
        self._dropped: set[str] = set()
        # The runs that send now, by what all their samples share: these need not be opened.
        self._known: dict[tuple[str, bytes, bytes], tuple[Stream, Consumer]] = {}

    def add(self, key: str, consumer: Consumer) -> None:
        """Handle samples of ``key`` (an expression with ``*`` too) with ``consumer`` from now on."""
        self._known.clear()
        (self.patterns if "*" in key else self.consumers)[key] = consumer

    def add_on_demand(self, key: str, consumer: NoticeConsumer) -> None:
        """Hand notices of what is put at ``key`` to ``consumer`` from now on; the key is not subscribed to."""
        self.on_demand[key] = consumer
        self.add(key, consumer)

    def end_on_demand(self, key: str) -> None:
        """Take what comes at ``key`` from now on: it is subscribed to, or read no longer."""
        if self.on_demand.pop(key, None) is not None:
            self._unwire(key)

    def remove(self, key: str) -> None:
        """Forget a key and its streams."""
        self._known.clear()
        if self.stepped and key in self.consumers and key not in self._asleep:
            self._dropped.add(key)
        self.consumers.pop(key, None)
        self.patterns.pop(key, None)
        self._asleep.discard(key)
        self.end_on_demand(key)
        for pair in [pair for pair in self.streams if pair[0] == key]:
            del self.streams[pair]
            self.holes.discard(pair)

    def consumer_of(self, key: str) -> Consumer | None:
        """Return who handles ``key``."""
        found = self.consumers.get(key)
        if found is None:
            found = next((c for pattern, c in self.patterns.items() if matches(pattern, key)), None)
        return found

    def stream(self, key: str, source: str) -> Stream:
        """Return the stream of a source on a key, new if need be."""
        pair = (key, source)
        stream = self.streams.get(pair)
        if stream is None:
            if len(self.streams) >= MAX_STREAMS:
                self._forget_one()
            stream = self.streams[pair] = Stream()
        return stream

    def _forget_one(self) -> None:
        """Forget the stranger that has been silent for longest, rather than a stream whose place is needed."""
        used = {id(stream) for stream, _ in self._known.values()}
        idle = (pair for pair, s in self.streams.items() if not (s.wired or s.waiting or id(s) in used))
        pair = next(idle, None) or next(iter(self.streams))
        self._known.clear()
        del self.streams[pair]

    def strike(self, key: str, source: str, last: int, doubted: Container[int]) -> None:
        """Drop what a writer has not put: its own numbering had only come to ``last``."""
        stream, consumer = self.streams.get((key, source)), self.consumer_of(key)
        if stream is None or consumer is None:
            return
        for sequence in stream.strike(last, doubted):
            consumer.refuse(source, f"has sequence {sequence}, but its writer has only come to {last}")

    def disbelieve(self, source: str, newest: int) -> None:
        """Return the streams of a source to their places before a run that is newer than its ``newest``."""
        for key, name in [pair for pair in self.streams if pair[1] == source]:
            stream = self.streams[key, name]
            before, consumer = stream.before(newest), self.consumer_of(key)
            if before is None:
                continue
            self._known.clear()
            self.streams[key, name] = before
            if consumer is not None:
                run = max(stream.epoch, stream.incarnation)
                consumer.refuse(source, f"came from incarnation {run}, which there is not: the newest is {newest}")

    def go_on(self, key: str, source: str, stream: Stream) -> None:
        """Continue with a stream at the place of another run of this component."""
        self._known.clear()
        self.streams[key, source] = stream

    def arrive_early(self, samples: Mapping[str, ResentSample]) -> None:
        """Take samples by key that come on the bus, too: whichever is second is a repeat."""
        for key, sample in samples.items():
            self.arrive(Sample(key, sample.payload, sample.attachment, sample.encoding))

    def arrive(self, sample: Sample) -> None:
        """Take a sample from the bus."""
        if not self.stepped:
            attachment = sample.attachment
            known = self._known.get((sample.key, attachment[:RUN_ENDS], attachment[PLACE_ENDS:]))
            if known is not None and known[0].follows(PLACE.unpack_from(attachment, RUN_ENDS)[0]):
                self.ready.append((known[1], sample))
                return
        consumer = self.consumer_of(sample.key)
        if consumer is None:
            return
        try:
            envelope = Envelope.from_bytes(sample.attachment)
        except BadMessage as error:
            consumer.refuse("", str(error))
            return
        self._sort_in(consumer, envelope, sample)

    def _sort_in(self, consumer: Consumer, envelope: Envelope, sample: Sample) -> None:
        stream = self.stream(sample.key, envelope.source)
        before = stream.epoch, stream.incarnation
        if not stream.admit(envelope):
            consumer.refuse(envelope.source, f"comes from incarnation {envelope.incarnation}, which has been replaced")
            if self._check is not None:
                self._check.doubt(envelope.source)
            return
        if (stream.epoch, stream.incarnation) != before:
            self._known.clear()
        if not stream.wired:
            pair = (sample.key, envelope.source)
            self.streams[pair] = self.streams.pop(pair)  # behind all that have been silent since
        if envelope.kind is Kind.MARKER:
            stream.mark(envelope.sequence, stepped=self.stepped)
            if not self.stepped and envelope.incarnation == stream.incarnation:
                self._look_for_hole(sample.key, envelope.source, stream, consumer)
            if self.on_marker:
                self.on_marker(sample.key, envelope.source, stream)
            return
        if stream.leap is not None and stream.goes_back(envelope):
            consumer.refuse(envelope.source, f"goes on at {envelope.sequence}: a sequence far ahead was not its own")
        if consumer.paused and (not self.stepped or sample.key in self._asleep):
            stream.pass_by(envelope, self._clock.now())
        elif self.stepped:
            stream.hold(envelope, sample)
        else:
            attachment = sample.attachment
            if envelope.incarnation == stream.incarnation:
                self._known[sample.key, attachment[:RUN_ENDS], attachment[PLACE_ENDS:]] = (stream, consumer)
            self._give_out(sample.key, stream, consumer, envelope, sample)

    def _give_out(self, key: str, stream: Stream, consumer: Consumer, envelope: Envelope, sample: Sample) -> None:
        arrivals = stream.accept(envelope, sample, self._clock.now(), reliable=consumer.reliable)
        self._line_up(consumer, arrivals)
        if stream.waiting:
            self.holes.add((key, envelope.source))

    def _look_for_hole(self, key: str, source: str, stream: Stream, consumer: Consumer) -> None:
        """Note that messages are missing which, by a marker, have been put."""
        if consumer.reliable and not consumer.paused and not stream.waiting and stream.hole() is not None:
            stream.waiting_since = self._clock.now()
            self.holes.add((key, source))

    def reliable_streams(self) -> dict[tuple[str, str], Stream]:
        """Return the streams of which every message is wanted."""
        found = {}
        for (key, source), stream in self.streams.items():
            consumer = self.consumer_of(key)
            if consumer is not None and consumer.reliable and not consumer.paused and stream.handled is not None:
                found[key, source] = stream
        return found

    def give_up_on_holes(self, now: int) -> None:
        """Get what is missing; report holes that cannot be closed, and continue behind them."""
        for pair in list(self.holes):
            stream = self.streams.get(pair)
            consumer = self.consumer_of(pair[0])
            hole = stream.hole() if stream is not None else None
            if stream is None or consumer is None or hole is None:
                self.holes.discard(pair)
                if self._repair is not None:
                    self._repair.forget(pair)
                continue
            if now - stream.waiting_since < HOLE_TIMEOUT:
                continue
            if self._repair is not None and consumer.reliable and self._repair.may_come(pair, stream, *hole):
                stream.waiting_since = now
                continue
            lost_before = stream.lost
            self._line_up(consumer, stream.overdue(now))
            if stream.lost > lost_before:
                consumer.report_lost(pair[1], stream.lost - lost_before)

    def next_give_up(self) -> int | None:
        """Return when the next hole is given up on, in nanoseconds."""
        since = [self.streams[pair].waiting_since for pair in self.holes if pair in self.streams]
        return min(since) + HOLE_TIMEOUT if since else None

    # --- in step ---

    def holds(self, frontier: Frontier) -> bool:
        """Return whether everything up to ``frontier`` is here."""
        for key, source, sequence in self._sent(frontier):  # noqa: SIM110  asked for at every step
            if not self.stream(key, source).holds(sequence):
                return False
        return True

    def _sent(self, frontier: Frontier) -> Iterator[tuple[str, str, int]]:
        """Yield key, source and sequence of what comes by itself."""
        for key, sources in frontier.items():
            if key not in self.on_demand:
                for source, sequence in sources.items():
                    yield key, source, sequence

    def reaches(self, frontier: Frontier) -> bool:
        """Return whether everything up to ``frontier`` is here, or has got lost on its way or was not made."""
        return all(self.stream(key, source).reaches(sequence) for key, source, sequence in self._sent(frontier))

    def ask_for_missing(self, frontier: Frontier) -> bool:
        """Have writers send again what is missing up to ``frontier``; returns whether all of it may still come."""
        if self._repair is None:
            return True
        for key, source, sequence in self._sent(frontier):
            stream = self.stream(key, source)
            first = stream.first_missing(sequence)
            if first is not None and not self._repair.may_come((key, source), stream, first, sequence):
                return False
        return True

    def missing(self, frontier: Frontier) -> str:
        """Return what is missing up to ``frontier``, for people."""
        late = (
            f"{key} of {source} from {stream.first_missing(sequence)} to {sequence}"
            for key, source, sequence in self._sent(frontier)
            if not (stream := self.stream(key, source)).reaches(sequence)
        )
        return ", ".join(late)

    def release(self, frontier: Frontier) -> None:
        """Line up everything up to ``frontier``, by key, source and sequence."""
        for key in sorted(frontier):
            consumer = self.consumer_of(key)
            for source in sorted(frontier[key]):
                if key in self.on_demand:
                    self._line_up_notice(key, source, frontier[key][source])
                    continue
                stream = self.stream(key, source)
                lost_before = stream.lost
                self._line_up(consumer, stream.release(frontier[key][source]))
                if consumer and stream.lost > lost_before:
                    consumer.report_lost(source, stream.lost - lost_before)

    def _line_up_notice(self, key: str, source: str, sequence: int) -> None:
        """Line up notices of the first and the last of what is new: nobody opens what lies between."""
        consumer, before = self.on_demand[key], self._noticed.get((key, source))
        self._noticed[key, source] = sequence
        if not consumer.paused:
            first = sequence if before is None else before + 1
            self.ready.extend((consumer, notice(key, source, n)) for n in sorted({min(first, sequence), sequence}))

    def release_outside(self, sources: tuple[str, ...]) -> None:
        """Line up all that has come from sources that are no members of the clock."""
        self.from_outside.update(sources)
        for key, source in sorted(pair for pair in self.streams if pair[1] in sources):
            self._line_up(self.consumer_of(key), self.streams[key, source].release_all(self._clock.now()))

    def outsiders(self) -> tuple[str, ...]:
        """Return the sources that have sent something without being wired: no members, or not yet."""
        return tuple(sorted({source for (_, source), s in self.streams.items() if s.waiting and not s.wired}))

    def forget_sources(self, sources: tuple[str, ...]) -> None:
        """Drop what sources that left sent beyond their last frontier, also what of it comes only later."""
        if not sources:
            return
        for consumer in self.on_demand.values():
            consumer.forget_notices(sources)
        self._noticed = {pair: n for pair, n in self._noticed.items() if pair[1] not in sources}
        for pair in [pair for pair in self.streams if pair[1] in sources]:
            self.streams[pair] = Stream(self.streams[pair].epoch, self.streams[pair].incarnation, gone=True)

    def told(self, read: Container[str]) -> None:
        """Take note that others know from now on which keys are read.

        The next marker on a key that is read no longer, or again, begins again. Pauses that the coordinator has not
        seen do not count: no message comes while time is still.
        """
        asleep = {key for key in (*self.consumers, *self.patterns) if key not in read}
        for key in asleep ^ self._asleep:
            self._unwire(key)
        self._asleep = asleep
        self._dropped.clear()

    @property
    def anew(self) -> tuple[str, ...]:
        """The keys that are read again, and of which others think that they have been read all along."""
        return tuple(sorted(self._dropped & self.consumers.keys())) if self._dropped else ()

    def _unwire(self, key: str) -> None:
        self._noticed = {pair: n for pair, n in self._noticed.items() if pair[0] != key}
        for pair, stream in self.streams.items():
            if pair[0] == key:
                stream.wired = False
                stream.waiting.clear()

    def forget_all(self) -> None:
        """Drop all queues and baselines: the clock begins again with this component."""
        self.ready.clear()
        self._noticed.clear()
        for consumer in self.on_demand.values():
            consumer.forget_notices()
        for pair, stream in self.streams.items():
            self.streams[pair] = Stream(stream.epoch, stream.incarnation)

    def _line_up(self, consumer: Consumer | None, arrivals: list[Arrival]) -> None:
        if consumer and not consumer.paused:
            self.ready.extend((consumer, sample) for _, sample in arrivals)
