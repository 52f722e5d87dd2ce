"""One source's samples on one key, put back into sequence: repeats dropped, holes waited for, losses counted."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, replace

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope, Kind

HOLE_TIMEOUT = 50_000_000
"""Nanoseconds that an early arrival is held for the ones before it."""
MAX_HOLE = 1_000
"""Samples left out at once that may yet come: a sequence further ahead may be a false one."""
MAX_HELD_OF_A_STRANGER = 10_000
"""Samples held in step for a source that is not wired: no member, or not yet."""

Arrival = tuple[Envelope, Sample]


@dataclass(frozen=True, slots=True)
class Leap:
    """Sequences ``first`` to ``last`` were left out at a time (nanoseconds), on the word of one sample."""

    first: int
    last: int
    at: int


@dataclass(slots=True)
class Stream:
    """The state of one (key, source). ``handled`` is the last sequence given out, None before the first sample.

    ``wired`` is set by the first marker; ``marked`` is how far the numbering had come by the last one. ``waiting``
    holds what has arrived but may not be given out yet. ``since`` is the first sequence of this incarnation that is
    known of, if it continues with the numbering of another.

    Samples of a run that is ``gone`` are dropped. A marker shows that it is back; another run is taken, too.

    One sample can be false: ``leap`` and ``former`` are the stream's place before it was believed.
    """

    epoch: int = 0
    incarnation: int = 0
    handled: int | None = None
    wired: bool = False
    lost: int = 0
    stale: int = 0
    waiting: dict[int, Arrival] = field(default_factory=dict)
    waiting_since: int = 0
    since: int = 0
    marked: int = 0
    leap: Leap | None = None
    former: Stream | None = None
    gone: bool = False

    def admit(self, envelope: Envelope) -> bool:
        """Return whether a sample is of the living run of its source; a newer run begins the numbering again."""
        if envelope.epoch < self.epoch or envelope.incarnation < self.incarnation:
            # A sample that was put before a hand-over may come after it, by another way.
            if envelope.epoch == self.epoch and envelope.sequence < self.since and envelope.kind is Kind.DATA:
                return True
            self.stale += 1
            return False
        if self.epoch and (envelope.epoch > self.epoch or envelope.incarnation > self.incarnation):
            self.former = replace(self, waiting={}, former=None)
        if envelope.incarnation > self.incarnation:
            behind = envelope.sequence + (envelope.kind is Kind.MARKER)
            self.since = behind if envelope.epoch == self.epoch else 0
        if envelope.epoch > self.epoch:
            known = self.epoch > 0
            self.epoch = envelope.epoch
            self.handled = 0 if known else None
            self.wired = False
            self.marked = 0
            self.leap = None
            self.waiting.clear()
        if envelope.incarnation > self.incarnation:
            self.gone = False
        self.incarnation = envelope.incarnation
        return True

    def before(self, newest: int) -> Stream | None:
        """Return the stream as it was before a run that is none was believed; ``newest`` is the newest that is one.

        None if the run that is known is one. Blank if no place before is known.
        """
        if max(self.epoch, self.incarnation) <= newest:
            return None
        fits = self.former is not None and max(self.former.epoch, self.former.incarnation) <= newest
        return self.former if fits else Stream()

    def goes_back(self, envelope: Envelope) -> bool:
        """Go back where the numbering was left, if a sample that was put since then shows that it continues there."""
        leap = self.leap
        if leap is None or not leap.first <= envelope.sequence <= leap.last or envelope.stamp < leap.at:
            return False
        self.handled, self.leap = envelope.sequence - 1, None
        self.waiting = {n: arrival for n, arrival in self.waiting.items() if n <= leap.last}
        return True

    def _go_to(self, sequence: int, now: int) -> None:
        """Continue behind a sequence; what lies before it is left out."""
        if self.handled is not None and sequence - self.handled > MAX_HOLE:
            self.leap = Leap(self.handled + 1, sequence - 1, now)
        self.handled = sequence

    def mark(self, sequence: int, *, stepped: bool = True) -> None:
        """Take a marker: the first one wires the stream, and what lies at or below it is not for us.

        Under the real clock, the samples between it and the last handled one are lost on the way, and ours.
        """
        self.marked, self.gone = max(self.marked, sequence), False
        if self.wired:
            return
        self.wired = True
        if self.handled is None or (stepped and self.handled < sequence):
            self.handled = sequence
        self.waiting = {n: arrival for n, arrival in self.waiting.items() if n > self.handled}

    # --- under the real clock: give out as soon as the sequence allows ---

    def follows(self, sequence: int) -> bool:
        """Take the sequence's next if nothing is held back: the usual case, which ``accept`` would decide alike."""
        if self.waiting or self.handled is None or sequence != self.handled + 1:
            return False
        self.handled = sequence
        return True

    def accept(self, envelope: Envelope, sample: Sample, now: int, *, reliable: bool) -> list[Arrival]:
        """Take a sample and return what can be handled now, in sequence. A sensor stream waits for no hole."""
        sequence = envelope.sequence
        if self.handled is None:
            self.handled = sequence - 1
        if sequence <= self.handled or sequence in self.waiting:
            return []
        if sequence == self.handled + 1 and not self.waiting:
            self.handled = sequence
            return [(envelope, sample)]
        if not reliable:
            self._go_to(sequence, now)
            return [(envelope, sample)]
        if not self.waiting:
            self.waiting_since = now
        self.waiting[sequence] = (envelope, sample)
        return self._in_sequence()

    def hole(self) -> tuple[int, int] | None:
        """Return the first and last sequence that are missing before what has come or, by a marker, was put."""
        if self.handled is None:
            return None
        last = min(self.waiting) - 1 if self.waiting else self.marked
        return (self.handled + 1, last) if last > self.handled else None

    def overdue(self, now: int) -> list[Arrival]:
        """Give up on a hole that has stayed open for too long: count it as lost and return what lies behind it."""
        hole = self.hole()
        if hole is None or now - self.waiting_since < HOLE_TIMEOUT:
            return []
        first, last = hole
        self.lost += last - first + 1
        self._go_to(last, now)
        self.waiting_since = now
        return self._in_sequence()

    def strike(self, last: int, doubted: Container[int]) -> list[int]:
        """Drop what the writer has not put: it had come to ``last`` after the ``doubted`` had arrived."""
        false = [n for n in self.waiting if n > last and n in doubted]
        for n in false:
            del self.waiting[n]
        if self.marked > last and self.marked in doubted:
            self.marked = last
        return false

    def _in_sequence(self) -> list[Arrival]:
        ready = []
        while self.waiting and self.handled is not None and self.handled + 1 in self.waiting:
            self.handled += 1
            ready.append(self.waiting.pop(self.handled))
        return ready

    # --- in step: hold everything until the frontier allows it ---

    def hold(self, envelope: Envelope, sample: Sample) -> None:
        """Keep a sample until its step; a stranger who sends more than anybody handles loses it."""
        if self.gone:
            return
        if not self.wired and len(self.waiting) >= MAX_HELD_OF_A_STRANGER:
            self.lost += 1
            return
        if self.handled is None or envelope.sequence > self.handled:
            self.waiting.setdefault(envelope.sequence, (envelope, sample))

    def reaches(self, frontier: int) -> bool:
        """Return whether everything up to ``frontier`` is here, or cannot come any more.

        That is so of what was put before a marker and is not here; of another run's data it is unknown.
        """
        start = self.handled or 0
        return all(
            sequence in self.waiting or self.since <= sequence <= self.marked
            for sequence in range(start + 1, frontier + 1)
        )

    def holds(self, frontier: int) -> bool:
        """Return whether everything up to ``frontier`` is here."""
        start = self.handled or 0
        if frontier == start + 1:  # as at most steps
            return frontier in self.waiting
        return self.first_missing(frontier) is None

    def first_missing(self, frontier: int) -> int | None:
        """Return the first sequence up to ``frontier`` that is not here."""
        return next((n for n in range((self.handled or 0) + 1, frontier + 1) if n not in self.waiting), None)

    def release(self, frontier: int) -> list[Arrival]:
        """Give out everything up to ``frontier``, in sequence; what is missing counts as lost."""
        start = self.handled or 0
        # Not over the range: a frontier that nobody can reach must cost no more than what is here.
        ready = [self.waiting.pop(n) for n in sorted(self.waiting) if start < n <= frontier]
        self.lost += max(0, frontier - start) - len(ready)
        self.handled = max(start, frontier)
        return ready

    def release_all(self, now: int) -> list[Arrival]:
        """Give out all that is here, in sequence: for sources that are no members of the clock."""
        ready = [self.waiting.pop(n) for n in sorted(self.waiting)]
        if ready:
            self._go_to(ready[-1][0].sequence, now)
        return ready

    def pass_by(self, envelope: Envelope, now: int) -> None:
        """Let a sample go by unhandled: its consumer is paused."""
        self.wired = False
        self.waiting.clear()
        if self.handled is None or envelope.sequence > self.handled:
            self._go_to(envelope.sequence, now)
