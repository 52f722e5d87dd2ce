"""What a run that does not speak keeps, and what it says of it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.runtime.data import replay_buffer
from regraft.runtime.data.replay_buffer import ReplayBuffer, envelope_of, is_held

SOURCES = ("one", "two")
ARRIVALS = st.lists(st.tuples(st.sampled_from(SOURCES), st.sampled_from(["data", "data", "marker", "restart"])))


def sample_of(envelope: Envelope) -> Sample:
    return Sample("key", b"x" if envelope.kind is Kind.DATA else b"", envelope.to_bytes(), "")


@given(ARRIVALS, st.integers(0, 3), st.integers(1, 12))
def test_it_says_of_every_sample_rightly_whether_it_holds_it(
    arrivals: list[tuple[str, str]], before: int, most: int
) -> None:
    """Each source has put some samples before the first that arrives; the last epoch is what counts."""
    epochs, sequences = dict.fromkeys(SOURCES, 1), dict.fromkeys(SOURCES, before)
    holding = ReplayBuffer()
    sent: list[Sample] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(replay_buffer, "MAX_HELD", most)
        for source, what in arrivals:
            if what == "restart":
                epochs[source], sequences[source] = epochs[source] + 1, 0
                continue
            sequences[source] += what == "data"
            kind = Kind.DATA if what == "data" else Kind.MARKER
            sent.append(sample_of(Envelope(source, epochs[source], epochs[source], sequences[source], 0, kind)))
            holding.add(sent[-1], envelope_of(sent[-1]))
    for sample in sent:
        envelope = envelope_of(sample)
        assert envelope is not None
        if envelope.kind is Kind.DATA and envelope.epoch == epochs[envelope.source]:
            assert is_held(holding.first, "key", envelope) == (sample in holding.samples)
    for source in SOURCES:
        missed = Envelope(source, 1, 1, before, 0)
        assert not before or not is_held(holding.first, "key", missed)


def test_it_does_not_grow_beyond_its_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_buffer, "MAX_HELD_BYTES", 1000)
    holding = ReplayBuffer()
    for number in range(1, 101):
        sample = Sample("key", bytes(100), Envelope("source", 1, 1, number, 0).to_bytes(), "")
        holding.add(sample, envelope_of(sample))
    assert len(holding.samples) == 10
    assert holding.first["key"]["source"].sequence == 91


def test_what_has_come_since_the_mark_is_told_apart() -> None:
    holding = ReplayBuffer()
    samples = [sample_of(Envelope("source", 1, 1, number, 0)) for number in range(1, 7)]
    for number, sample in enumerate(samples):
        if number == 4:
            holding.mark()
        holding.add(sample, envelope_of(sample))
    assert holding.since_mark() == samples[4:]
    assert holding.take_all() == samples
    assert not holding.samples
