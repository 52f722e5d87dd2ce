"""The envelope arrives as it was sent, and nothing else passes for one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.encoding.envelope import LAYOUT, MAX_SOURCE_LENGTH, Envelope, Kind
from regraft.bus_schema.errors import BadMessage

U32 = st.integers(0, 2**32 - 1)
names = st.from_regex(r"[A-Za-z0-9_.-]{1,160}", fullmatch=True)
envelopes = st.builds(
    Envelope,
    names,
    U32,
    U32,
    st.integers(0, 2**64 - 1),
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from(Kind),
)


@given(envelopes)
def test_an_envelope_arrives_as_it_was_sent(envelope: Envelope) -> None:
    assert Envelope.from_bytes(envelope.to_bytes()) == envelope


@given(st.binary(max_size=250))
def test_random_bytes_are_an_envelope_or_a_bad_message(attachment: bytes) -> None:
    try:
        envelope = Envelope.from_bytes(attachment)
    except BadMessage:
        return
    assert Envelope.from_bytes(envelope.to_bytes()) == envelope


@given(envelopes, st.data())
def test_an_envelope_cut_short_before_its_source_is_refused(envelope: Envelope, data: st.DataObject) -> None:
    attachment = envelope.to_bytes()
    with pytest.raises(BadMessage, match="not an envelope"):
        Envelope.from_bytes(attachment[: data.draw(st.integers(0, LAYOUT.size))])


@given(envelopes, st.integers(3, 255))
def test_another_version_and_an_unknown_kind_are_refused(envelope: Envelope, wrong: int) -> None:
    attachment = envelope.to_bytes()
    with pytest.raises(BadMessage, match="version"):
        Envelope.from_bytes(bytes([wrong]) + attachment[1:])
    with pytest.raises(BadMessage, match="kind"):
        Envelope.from_bytes(attachment[:1] + bytes([wrong]) + attachment[2:])


def test_the_reserved_bytes_are_ignored() -> None:
    envelope = Envelope("navigator", 1, 2, 3, 4)
    attachment = bytearray(envelope.to_bytes())
    attachment[2:4] = b"\xff\xff"
    assert Envelope.from_bytes(bytes(attachment)) == envelope


def test_a_source_that_is_not_utf8_is_refused() -> None:
    with pytest.raises(BadMessage, match="UTF-8"):
        Envelope.from_bytes(Envelope("navigator", 1, 1, 1, 0).to_bytes() + b"\xff")


def test_the_longest_component_name_fits_an_envelope() -> None:
    name = "r" * 64 + "." + "c" * 64
    assert Envelope.from_bytes(Envelope(name, 1, 1, 1, 0).to_bytes()).source == name


@pytest.mark.parametrize(
    "envelope",
    [
        Envelope("", 1, 1, 1, 0),
        Envelope("x" * (MAX_SOURCE_LENGTH + 1), 1, 1, 1, 0),
        Envelope("\ud800", 1, 1, 1, 0),
        Envelope("navigator", 2**32, 1, 1, 0),
        Envelope("navigator", 1, -1, 1, 0),
        Envelope("navigator", 1, 1, 2**64, 0),
    ],
)
def test_an_envelope_that_no_receiver_would_take_is_not_sent(envelope: Envelope) -> None:
    with pytest.raises(BadMessage):
        envelope.to_bytes()
