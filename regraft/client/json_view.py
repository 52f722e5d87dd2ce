"""Messages as JSON shows them. Types need not be known here: a payload and its encoding are enough."""

from __future__ import annotations

import base64
import math
from typing import Any

import msgpack
import numpy as np

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.arrays import ARRAY_EXTENSION, TAIL_EXTENSION
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage

MAX_SHOWN = 64
"""Elements up to which an array's values are shown."""
TAIL_ENCODING = "application/x-msgpack-tail"


def read_plain(payload: bytes, encoding: str) -> Any:
    """Return the plain data in a payload, arrays as numpy arrays; raises BadMessage.

    The class of the message need not be known: MessagePack and the array layout describe themselves.
    """
    if not encoding.startswith(TAIL_ENCODING):
        return codec.unpack_plain(payload)
    if len(payload) < codec.HEADER_LENGTH.size:
        raise BadMessage("is too short for a header length")
    (length,) = codec.HEADER_LENGTH.unpack_from(payload)
    end = codec.HEADER_LENGTH.size + length
    try:
        header = msgpack.unpackb(payload[codec.HEADER_LENGTH.size : end])
        return codec.unpack_plain(msgpack.packb(_with_tail_inside(header, payload[end:])))
    except (ValueError, TypeError, msgpack.exceptions.UnpackException) as error:
        raise BadMessage(f"is not a well-formed message with a tail ({error})") from None


def _with_tail_inside(header: Any, tail: bytes) -> Any:
    if not isinstance(header, dict):
        raise BadMessage(f"is {type(header).__name__}, must be a map")
    return {name: _with_tail(value, tail) for name, value in header.items()}


def _with_tail(value: Any, tail: bytes) -> Any:
    if isinstance(value, msgpack.ExtType) and value.code == TAIL_EXTENSION:
        return msgpack.ExtType(ARRAY_EXTENSION, value.data + tail)
    return value


def as_json(value: Any) -> Any:
    """Return a message, or plain data, as values that JSON has.

    An array becomes ``{"dtype", "shape", "data"}``, its data a list where it is small, ``"..."`` where not.
    Bytes become base64. Infinities, which JSON lacks, become ``"Infinity"`` and ``"-Infinity"``.
    """
    if hasattr(type(value), "__dataclass_fields__"):
        value = read_plain(codec.encode(value), type_of(type(value)).encoding)
    return _shown(value)


def _shown(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(name): _shown(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_shown(item) for item in value]
    if isinstance(value, np.ndarray):
        data = _shown(value.tolist()) if value.size <= MAX_SHOWN else "..."
        return {"dtype": value.dtype.str, "shape": list(value.shape), "data": data}
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else ("Infinity" if value > 0 else "-Infinity")
    return value
