"""What a stream promises, whatever order its samples arrive in."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bus_schema.envelope import Envelope
from regraft.bus import Sample
from regraft.runtime.stream import HOLE_CLOSES_WITHIN, Stream


def _arrival(sequence: int, epoch: int = 1) -> tuple[Envelope, Sample]:
    return Envelope("s", epoch, epoch, sequence, 0), Sample("k", str(sequence).encode(), b"", "")


def _accept(stream: Stream, sequence: int, now: int = 0, *, reliable: bool = True) -> list[int]:
    envelope, sample = _arrival(sequence)
    assert stream.admit(envelope)
    return [e.sequence for e, _ in stream.accept(envelope, sample, now, reliable=reliable)]


@st.composite
def shuffled(draw: st.DrawFn) -> list[int]:
    """Sequences 1 to n, the first one first, the others in any order with repeats."""
    count = draw(st.integers(2, 12))
    rest = draw(st.permutations(range(2, count + 1)))
    repeats = draw(st.lists(st.integers(1, count), max_size=5))
    mixed = [*rest, *repeats]
    return [1, *draw(st.permutations(mixed))]


@given(shuffled())
def test_everything_comes_out_once_and_in_sequence(order: list[int]) -> None:
    stream = Stream()
    out = [sequence for arrived in order for sequence in _accept(stream, arrived)]
    assert out == list(range(1, max(order) + 1))
    assert stream.lost == 0
    assert not stream.waiting


@given(st.lists(st.integers(1, 30), min_size=1, max_size=40))
def test_what_is_given_up_on_is_counted_and_nothing_comes_out_twice(order: list[int]) -> None:
    stream = Stream()
    out: list[int] = []
    now = 0
    for arrived in order:
        out += _accept(stream, arrived, now)
        now += HOLE_CLOSES_WITHIN // 3
        out += [e.sequence for e, _ in stream.overdue(now)]
    while stream.waiting:
        now += HOLE_CLOSES_WITHIN
        out += [e.sequence for e, _ in stream.overdue(now)]
    assert out == sorted(set(out))
    assert stream.lost == (out[-1] - out[0] + 1) - len(out)


@given(st.lists(st.integers(1, 50), min_size=1))
def test_a_sensor_stream_never_goes_back_and_never_waits(order: list[int]) -> None:
    stream = Stream()
    out = [sequence for arrived in order for sequence in _accept(stream, arrived, reliable=False)]
    assert out == sorted(set(out))
    assert not stream.waiting


@given(shuffled(), st.data())
def test_in_step_nothing_beyond_the_frontier_comes_out(order: list[int], data: st.DataObject) -> None:
    stream = Stream()
    stream.admit(_arrival(1)[0])
    for arrived in order:
        stream.hold(*_arrival(arrived))
    last = max(order)
    frontier = data.draw(st.integers(0, last))
    assert stream.reaches(frontier)
    assert not stream.reaches(last + 1)
    assert [e.sequence for e, _ in stream.release(frontier)] == list(range(1, frontier + 1))
    assert [e.sequence for e, _ in stream.release(last)] == list(range(frontier + 1, last + 1))
    assert stream.lost == 0


def test_the_first_marker_sets_the_baseline_and_later_ones_do_not() -> None:
    stream = Stream()
    stream.admit(_arrival(5)[0])
    for sequence in (4, 5, 6, 7):
        stream.hold(*_arrival(sequence))
    stream.mark(5)
    stream.mark(7)
    assert [e.sequence for e, _ in stream.release(7)] == [6, 7]


def test_an_older_run_is_not_admitted() -> None:
    stream = Stream()
    assert stream.admit(_arrival(1, epoch=3)[0])
    assert not stream.admit(_arrival(2, epoch=2)[0])
    assert stream.stale == 1
