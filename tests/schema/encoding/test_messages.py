"""Every message type travels unchanged, and nothing that does not fit it gets through."""

from __future__ import annotations

import copy
import random
import struct
from contextlib import suppress
from dataclasses import replace
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.records import RecordShape, UnionShape, attributes_of
from regraft.bus_schema.encoding.registry import MessageType
from regraft.bus_schema.encoding.shapes import CUT
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Event, SystemStatus
from regraft.bus_schema.messages.maps import OccupancyGrid
from regraft.bus_schema.messages.sensors import Image
from regraft.bus_schema.model.adaptation import Violation
from tests.schema.encoding.comparing import json_view, same
from tests.schema.encoding.misfits import misfits, places, wrong_arrays
from tests.schema.every_type import KINDS, of_every_message
from tests.schema.strategies import values
from tests.support.tables import check_each

chance = random.Random()
many = settings(max_examples=200, deadline=None, suppress_health_check=list(HealthCheck))
MARKS = (0x00, 0x01, 0x7F, 0x80, 0x81, 0x8F, 0x90, 0x91, 0x9F, 0xA0, 0xA1, 0xBF, *range(0xC0, 0xE1), 0xFF)
"""Bytes that mean most in MessagePack: the beginnings of its kinds, and the least and largest numbers."""
any_message = st.one_of(*(st.tuples(st.just(kind), values(kind.shape)) for kind in KINDS))


def packed(kind: MessageType, message: object, plain: Any) -> bytes:
    """Return a payload of ``plain``, behind which the tail of ``message`` follows where the type has one."""
    head: bytes = msgpack.packb(plain)
    if kind.tail is None:
        return head
    tail: bytes = getattr(message, kind.tail).tobytes()
    return struct.pack("<I", len(head)) + head + tail


@of_every_message()
def test_a_message_arrives_as_it_was_sent(kind: MessageType, message: Any) -> None:
    payload = codec.encode(message)
    assert same(codec.decode(payload, kind.cls), message)
    assert codec.encode(codec.decode(payload, kind.cls)) == payload


@of_every_message()
def test_optional_fields_may_be_left_out_and_take_their_defaults(kind: MessageType, message: Any) -> None:
    plain = codec.to_plain(message)
    some = {name for name in kind.shape.optional if chance.random() < 0.5}
    for left_out in (some, kind.shape.optional):
        kept = {name: value for name, value in plain.items() if name not in left_out}
        arrived: Any = codec.decode(packed(kind, message, kept), kind.cls)
        kept_attributes = [attributes_of(kind.cls)[name] for name in kept]
        assert all(same(getattr(arrived, name), getattr(message, name)) for name in kept_attributes), left_out


@of_every_message()
def test_no_publisher_can_send_a_field_that_does_not_fit(kind: MessageType, message: Any) -> None:
    for name, shape in kind.shape.fields:
        changed = copy.copy(message)
        object.__setattr__(changed, attributes_of(kind.cls)[name], chance.choice(misfits(shape)))
        with pytest.raises(BadMessage) as refused:
            codec.encode(changed)
        assert refused.value.where[0] == name


@of_every_message()
def test_a_received_value_that_does_not_fit_is_refused(kind: MessageType, message: Any) -> None:
    root = {"message": codec.to_plain(message)}
    inner = list(places(root, "message", kind.shape))
    for place in chance.sample(inner, min(5, len(inner))):
        fits, misfit = place.holder[place.key], chance.choice(misfits(place.shape))
        place.holder[place.key] = misfit
        with pytest.raises(BadMessage):
            codec.decode(packed(kind, message, root["message"]), kind.cls)
        place.holder[place.key] = fits


ARRAY = msgpack.ExtType(1, b"<f4" + struct.pack("<BI", 1, 2) + bytes(8))


@of_every_message()
def test_an_array_and_a_deep_list_are_refused_wherever_something_else_belongs(kind: MessageType, message: Any) -> None:
    deep: list[Any] = []
    for _level in range(980):
        deep = [deep]
    root = {"message": codec.to_plain(message)}
    for place in list(places(root, "message", kind.shape)):
        if isinstance(place.shape, ArrayShape):
            continue
        fits = place.holder[place.key]
        for misfit in (ARRAY, [ARRAY], deep):
            place.holder[place.key] = misfit
            with pytest.raises(BadMessage):
                codec.decode(packed(kind, message, root["message"]), kind.cls)
        place.holder[place.key] = fits


@of_every_message()
def test_a_missing_field_is_refused_by_name(kind: MessageType, message: Any) -> None:
    plain = codec.to_plain(message)
    for missing in kind.shape.names - kind.shape.optional:
        with pytest.raises(BadMessage, match=r"missing|describes its tail 0 times"):
            codec.decode(packed(kind, message, {key: plain[key] for key in plain if key != missing}), kind.cls)


@of_every_message()
def test_an_unknown_field_is_refused_by_name(kind: MessageType, message: Any) -> None:
    root = {"message": codec.to_plain(message)}
    records = [p for p in places(root, "message", kind.shape) if isinstance(p.shape, RecordShape)]
    place = chance.choice(records)
    place.holder[place.key]["surprise"] = 1
    with pytest.raises(BadMessage, match="surprise"):
        codec.decode(packed(kind, message, root["message"]), kind.cls)


@many
@given(any_message, st.text(max_size=10))
def test_a_union_refuses_a_tag_that_names_no_member(drawn: tuple[MessageType, Any], tag: str) -> None:
    kind, message = drawn
    root = {"message": codec.to_plain(message)}
    for place in places(root, "message", kind.shape):
        if isinstance(place.shape, UnionShape) and tag not in place.shape.members:
            place.holder[place.key][place.shape.key] = tag
            with pytest.raises(BadMessage):
                codec.decode(packed(kind, message, root["message"]), kind.cls)
            return


@of_every_message(kinds=[k for k in KINDS if any(isinstance(s, ArrayShape) for _, s in k.shape.fields)])
def test_an_array_of_another_dtype_or_shape_is_refused_by_both_sides(kind: MessageType, message: Any) -> None:
    name, shape = next((n, s) for n, s in kind.shape.fields if isinstance(s, ArrayShape))
    for array in wrong_arrays(shape):
        changed = copy.copy(message)
        plain = codec.to_plain(changed)
        object.__setattr__(changed, name, array)
        with pytest.raises(BadMessage, match=name):
            codec.encode(changed)
        layout = array.dtype.str.encode() + struct.pack(f"<B{array.ndim}I", array.ndim, *array.shape)
        plain[name] = msgpack.ExtType(2, layout) if shape.layout.tail else msgpack.ExtType(1, layout + array.tobytes())
        with pytest.raises(BadMessage):
            codec.decode(packed(kind, changed, plain), kind.cls)


def test_random_bytes_raise_nothing_but_bad_message() -> None:
    """Without hypothesis, which needs as long for one payload as this for a hundred."""

    def check(kind: MessageType) -> None:
        for number in range(100):
            length = chance.randrange(200) if number > 2 else number
            payload = bytes(chance.choices(MARKS if number % 2 else range(256), k=length))
            try:
                with suppress(BadMessage):
                    assert same(codec.decode(payload, kind.cls), codec.decode(payload, kind.cls))
            except BaseException as error:
                error.add_note(f"of {payload!r}")
                raise

    check_each(KINDS, check, lambda kind: kind.name)


@many
@given(any_message, st.data())
def test_a_truncated_payload_raises_bad_message(drawn: tuple[MessageType, Any], data: st.DataObject) -> None:
    kind, message = drawn
    payload = codec.encode(message)
    end = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(BadMessage):
        codec.decode(payload[:end], kind.cls)


@many
@given(any_message, st.binary(min_size=1, max_size=8))
def test_bytes_behind_a_payload_raise_bad_message(drawn: tuple[MessageType, Any], behind: bytes) -> None:
    kind, message = drawn
    with pytest.raises(BadMessage):
        codec.decode(codec.encode(message) + behind, kind.cls)


@many
@given(any_message, st.data())
def test_flipped_bits_raise_bad_message_or_give_a_message(drawn: tuple[MessageType, Any], data: st.DataObject) -> None:
    kind, message = drawn
    payload = bytearray(codec.encode(message))
    for _ in range(data.draw(st.integers(1, 4))):
        bit = data.draw(st.integers(0, 8 * len(payload) - 1))
        payload[bit // 8] ^= 1 << bit % 8
    try:
        arrived: Any = codec.decode(bytes(payload), kind.cls)
    except BadMessage:
        return
    assert same(codec.decode(codec.encode(arrived), kind.cls), arrived)


def test_the_json_schema_of_every_type_is_valid() -> None:
    check_each(KINDS, lambda kind: Draft202012Validator.check_schema(kind.json_schema()), lambda kind: kind.name)


@of_every_message()
def test_the_json_schema_accepts_every_message_but_none_with_an_unknown_field(kind: MessageType, message: Any) -> None:
    plain = json_view(codec.to_plain(message))
    validator = Draft202012Validator(kind.json_schema())
    assert validator.is_valid(plain)
    assert not validator.is_valid({**plain, "surprise": 1})


def test_a_tail_is_read_in_place_and_cannot_be_written() -> None:
    grid = OccupancyGrid(1.0, "map", 0.05, Pose(), np.zeros((3, 5), np.int8))
    payload = codec.encode(grid)
    cells = codec.decode(payload, OccupancyGrid).cells
    assert np.shares_memory(cells, np.frombuffer(payload, np.uint8))
    assert not cells.flags.writeable


def test_an_image_that_is_passed_on_as_it_came_is_not_copied_and_any_other_is() -> None:
    pixels = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    payload = codec.encode(Image(1.0, "camera", "base_link", Pose(), 1.2, pixels))
    came = codec.decode(payload, Image)
    assert codec.encode(came) is payload
    for changed in (
        replace(came, stamp=2.0),
        replace(came, pixels=came.pixels[1:]),
        replace(came, pixels=came.pixels[::-1]),
        replace(came, pixels=came.pixels.copy()),
    ):
        again = codec.encode(changed)
        assert again is not payload
        assert same(codec.decode(again, Image), changed)


def test_a_tail_that_no_field_describes_is_refused() -> None:
    image = Image(1.0, "camera", "base_link", Pose(), 1.2, np.zeros((2, 2, 3), np.uint8))
    plain = codec.to_plain(image)
    layout = plain["pixels"].data
    plain["pixels"] = msgpack.ExtType(1, layout + image.pixels.tobytes())
    head = msgpack.packb(plain)
    with pytest.raises(BadMessage, match="tail"):
        codec.decode(struct.pack("<I", len(head)) + head + b"stray", Image)


def test_an_array_with_a_gap_between_its_rows_is_sent_without_the_gap() -> None:
    wide = np.arange(24, dtype=np.int8).reshape(4, 6)
    grid = OccupancyGrid(1.0, "map", 0.05, Pose(), wide[:, ::2])
    assert same(codec.decode(codec.encode(grid), OccupancyGrid).cells, wide[:, ::2].copy())


@pytest.mark.parametrize("text", ["\ud800", "a\udfff"])
def test_text_that_no_encoding_carries_is_refused_wherever_it_stands(text: str) -> None:
    for message in (
        Event(0.0, text, "navigator", ""),
        Event(0.0, "fault", "navigator", "", {text: 1}),
        Event(0.0, "fault", "navigator", "", {"deep": {text: 1}}),
        SystemStatus(0.0, {text: 1}),
    ):
        with pytest.raises(BadMessage, match="Unicode"):
            codec.encode(message)


def test_an_integer_too_large_for_a_float_is_refused() -> None:
    with pytest.raises(BadMessage, match="too large"):
        codec.encode(Twist.planar(10**400, 0.0))


@pytest.mark.parametrize("number", [2**64, -(2**63) - 1, 10**5000], ids=["above", "below", "huge"])
def test_an_integer_beyond_64_bits_is_refused(number: int) -> None:
    with pytest.raises(BadMessage, match="64 bits"):
        codec.encode(Event(0.0, "fault", "navigator", "", {"count": number}))


def test_a_payload_above_the_limit_is_refused_unread() -> None:
    with pytest.raises(BadMessage, match="at most"):
        codec.decode(bytes(codec.MAX_MESSAGE_SIZE + 1), Twist)


@pytest.mark.parametrize("tail", [False, True])
def test_a_message_above_the_limit_is_not_sent_and_one_at_it_arrives(
    tail: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels = np.zeros((40, 50, 3), np.uint8)
    image = Image(1.0, "camera", "base_link", Pose(), 1.2, pixels)
    sent = image if tail else Event(0.0, "fault", "navigator", "", {"dump": bytes(6000)})
    size = len(codec.encode(sent))
    monkeypatch.setattr(codec, "MAX_MESSAGE_SIZE", size)
    assert same(codec.decode(codec.encode(sent), type(sent)), sent)
    monkeypatch.setattr(codec, "MAX_MESSAGE_SIZE", size - 1)
    with pytest.raises(BadMessage, match=f"is {size} bytes long, must be at most {size - 1}"):
        codec.encode(sent)


def test_an_error_names_the_path_of_the_field_at_fault() -> None:
    with pytest.raises(BadMessage) as refused:
        codec.from_plain({"linear": {"x": "fast"}}, Twist)
    assert refused.value.where == ("linear", "x")


def test_what_is_told_to_people_is_cut_rather_than_lost() -> None:
    violation = Violation(0, "navigator", "parameters.speed", "x" * 900_000)
    arrived = codec.decode(codec.encode(violation), Violation)
    assert arrived.problem == "x" * (4096 - len(CUT)) + CUT
    plain = {**codec.to_plain(violation), "problem": "x" * 4097}
    with pytest.raises(BadMessage, match="must be at most 4096"):
        codec.from_plain(plain, Violation)
