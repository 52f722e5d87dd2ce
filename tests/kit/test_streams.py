"""What a stream promises, whatever order its samples arrive in."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.runtime.data.stream import HOLE_TIMEOUT, MAX_HOLE, Stream


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
        now += HOLE_TIMEOUT // 3
        out += [e.sequence for e, _ in stream.overdue(now)]
    while stream.waiting:
        now += HOLE_TIMEOUT
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


def _put_at(stream: Stream, sequence: int, stamp: int, now: int, *, reliable: bool = False) -> list[int]:
    envelope, sample = Envelope("s", 1, 1, sequence, stamp), Sample("k", b"", b"", "")
    stream.goes_back(envelope)
    return [e.sequence for e, _ in stream.accept(envelope, sample, now, reliable=reliable)]


@given(st.integers(MAX_HOLE + 3, 2**63), st.integers(1, 20))
def test_a_sensor_stream_goes_on_where_it_was_before_a_false_sequence(false: int, behind: int) -> None:
    stream = Stream()
    assert _put_at(stream, 1, stamp=1, now=1) == [1]
    assert _put_at(stream, false, stamp=2, now=2) == [false]
    out = [n for real in range(2, behind + 2) for n in _put_at(stream, real, stamp=real + 1, now=real + 1)]
    assert out == list(range(2, behind + 2))


def test_what_was_put_before_a_hole_was_given_up_does_not_come_again() -> None:
    stream = Stream()
    _put_at(stream, 1, stamp=1, now=1)
    _put_at(stream, MAX_HOLE + 10, stamp=9, now=10)
    assert _put_at(stream, 5, stamp=2, now=11) == []
    assert _put_at(stream, MAX_HOLE + 11, stamp=12, now=12) == [MAX_HOLE + 11]


def test_what_its_writer_has_not_put_is_struck_and_the_rest_waits() -> None:
    stream = Stream()
    for sequence in (1, 3, 7, 10**9):
        _accept(stream, sequence)
    assert stream.strike(5, {3, 10**9}) == [10**9], "what came after the question may be later"
    assert sorted(stream.waiting) == [3, 7]


def test_a_run_that_there_is_not_leaves_the_stream_as_it_was() -> None:
    stream = Stream()
    _accept(stream, 1)
    envelope, _ = _arrival(1, epoch=9)
    assert stream.admit(envelope)
    before = stream.before(newest=1)
    assert before is not None
    assert (before.epoch, before.handled) == (1, 1)
    assert stream.before(newest=9) is None
