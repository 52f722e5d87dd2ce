"""Messages to bytes and back: MessagePack maps, arrays as extension values, a large array as the payload's tail.

A payload with a tail is ``header length (u32 LE) | MessagePack map | raw array``; the array is read in place.
"""

from __future__ import annotations

import struct
from typing import Any, TypeVar

import msgpack
import numpy as np

from regraft.bus_schema.encoding.arrays import TAIL_EXTENSION, array_of, layout_in, shaped
from regraft.bus_schema.encoding.registry import MessageType, type_of
from regraft.bus_schema.errors import BadMessage

MAX_MESSAGE_SIZE = 64 * 1024 * 1024
MAX_MAP_SIZE = 1_000_000
HEADER_LENGTH = struct.Struct("<I")

T = TypeVar("T")

MALFORMED = (ValueError, TypeError, RecursionError, msgpack.exceptions.UnpackException)

_pack = msgpack.Packer().pack
"""One packer for all: a new one for every message would cost more than the packing."""
_unpack = msgpack.unpackb


def encode(message: object) -> bytes:
    """Return the payload of a message; raises BadMessage if it is too large, or a field does not fit its type."""
    return encode_as(type_of(type(message)), message)


def encode_as(kind: MessageType, message: object) -> bytes:
    """Return the payload of a message of a known kind; raises BadMessage as `encode` does."""
    packed: bytes = _pack(kind.pack(message))
    if kind.tail is not None:
        return with_tail(packed, getattr(message, kind.tail))
    if len(packed) > MAX_MESSAGE_SIZE:
        raise _too_large(len(packed))
    return packed


def with_tail(packed: bytes, array: np.ndarray[Any, Any]) -> bytes:
    """Return a payload of a packed map and the array that it describes as its tail; raises BadMessage if too large.

    A message that is passed on as it came is the payload that it came in: nothing is copied.
    """
    header = HEADER_LENGTH.pack(len(packed)) + packed
    if len(header) + array.nbytes > MAX_MESSAGE_SIZE:
        raise _too_large(len(header) + array.nbytes)
    tail = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    came = _read_from(array)
    if came is not None and came.startswith(header) and _is_behind(tail, came, len(header)):
        return came
    return b"".join((header, tail.data))


def _too_large(size: int) -> BadMessage:
    return BadMessage(f"is {size} bytes long, must be at most {MAX_MESSAGE_SIZE}")


def _read_from(array: np.ndarray[Any, Any]) -> bytes | None:
    """Return the bytes in which an array was read in place, None for one that has memory of its own."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return base if type(base) is bytes else None


def _is_behind(tail: np.ndarray[Any, Any], payload: bytes, start: int) -> bool:
    """Return whether an array is, in memory, all that there is of a payload behind its header."""
    where = np.frombuffer(payload, np.uint8).ctypes.data + start
    return tail.ctypes.data == where and tail.size == len(payload) - start


def decode(payload: bytes, cls: type[T]) -> T:
    """Return the message of class ``cls`` that ``payload`` holds; raises BadMessage if it does not fit."""
    message: T = decode_as(type_of(cls), payload)
    return message


def decode_as(kind: MessageType, payload: bytes) -> Any:
    """Return the message of a known kind that ``payload`` holds; raises BadMessage if it does not fit."""
    if len(payload) > MAX_MESSAGE_SIZE:
        raise _too_large(len(payload))
    if kind.tail:
        plain = _plain_with_tail(payload)
    else:
        # The same as _unpacked, without its frame: every small message comes this way.
        try:
            plain = _unpack(payload, ext_hook=array_of, strict_map_key=True, max_map_len=MAX_MAP_SIZE)
        except MALFORMED as error:
            raise _malformed(error) from None
    try:
        return kind.unpack(plain)
    except BadMessage:
        raise
    except Exception as error:
        raise _refusal(kind, error) from error


def pack_plain(plain: Any) -> bytes:
    """Return plain data as MessagePack."""
    packed: bytes = _pack(plain)
    return packed


def unpack_plain(payload: bytes) -> Any:
    """Return the plain data in ``payload``; raises BadMessage for anything but one well-formed MessagePack value."""
    return _unpacked(payload, array_of)


def to_plain(message: object) -> dict[str, Any]:
    """Return a message as a map of plain data, without its arrays' contents turned to lists."""
    plain: dict[str, Any] = type_of(type(message)).pack(message)
    return plain


def from_plain(plain: Any, cls: type[T]) -> T:
    """Return the message of class ``cls`` of which a map of plain data has the fields; raises BadMessage."""
    kind = type_of(cls)
    try:
        message: T = kind.unpack(plain)
    except BadMessage:
        raise
    except Exception as error:
        raise _refusal(kind, error) from error
    return message


def encoding_fits(encoding: str, kind: MessageType) -> bool:
    """Return whether a payload's Zenoh encoding names this type and version."""
    return encoding == kind.encoding


def _unpacked(payload: bytes, extension: Any) -> Any:
    try:
        return _unpack(payload, ext_hook=extension, strict_map_key=True, max_map_len=MAX_MAP_SIZE)
    except MALFORMED as error:
        raise _malformed(error) from None


def _malformed(error: Exception) -> BadMessage:
    """Return the error of a payload that is no MessagePack; an array in it has brought its own."""
    if isinstance(error, BadMessage):
        return error
    return BadMessage(f"is not one well-formed MessagePack value ({type(error).__name__})")


def _refusal(kind: MessageType, error: Exception) -> BadMessage:
    """Return the error of data that a type does not take; its class may raise anything, and readers expect this."""
    return BadMessage(f"is refused by {kind.cls.__name__} ({type(error).__name__}: {error})")


def _plain_with_tail(payload: bytes) -> Any:
    if len(payload) < HEADER_LENGTH.size:
        raise BadMessage("is too short for a header length")
    (length,) = HEADER_LENGTH.unpack_from(payload)
    start = HEADER_LENGTH.size + length
    if start > len(payload):
        raise BadMessage(f"announces a header of {length} bytes, but ends before")

    layouts = []

    def tail(code: int, data: bytes) -> Any:
        if code != TAIL_EXTENSION:
            return array_of(code, data)
        dtype, dimensions, end = layout_in(data)
        if end != len(data):
            raise BadMessage("has stray bytes behind an array's layout")
        layouts.append(dimensions)
        return shaped(np.frombuffer(payload, np.uint8, offset=start), dtype, dimensions)

    plain = _unpacked(memoryview(payload)[HEADER_LENGTH.size : start].tobytes(), tail)
    if len(layouts) != 1:
        raise BadMessage(f"describes its tail {len(layouts)} times, must once")
    return plain
