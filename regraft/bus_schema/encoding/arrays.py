"""Arrays in messages: the shape of a field that holds one, and how it travels.

MessagePack has extension values for them: a header of dtype and dimensions, and the raw bytes behind it unless they
are the payload's tail.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import msgpack
import numpy as np

from regraft.bus_schema.annotations import Array
from regraft.bus_schema.encoding.shapes import JsonSchema
from regraft.bus_schema.errors import BadMessage

ARRAY_EXTENSION = 1
"""MessagePack extension type of an array: dtype (3 ASCII bytes), dimensions (u8), lengths (u32 LE each), raw bytes."""
TAIL_EXTENSION = 2
"""The same without the raw bytes: they are the tail of the payload."""
KNOWN_DTYPES = frozenset(
    {b"|u1", b"|i1", b"|b1", b"<u2", b"<i2", b"<u4", b"<i4", b"<u8", b"<i8", b"<f2", b"<f4", b"<f8"}
)


@dataclass(frozen=True, slots=True)
class ArrayShape:
    """A numpy array of a fixed dtype, little-endian and C-contiguous on the wire."""

    layout: Array

    def check(self, value: Any) -> np.ndarray[Any, Any]:
        """Return ``value`` as a C-contiguous array if dtype and shape fit."""
        if not isinstance(value, np.ndarray):
            raise BadMessage(f"is {type(value).__name__}, must be an array of {self.layout.dtype}")
        if value.dtype != np.dtype(self.layout.dtype):
            raise BadMessage(f"is an array of {value.dtype}, must be of {self.layout.dtype}")
        wanted = self.layout.shape
        if len(value.shape) != len(wanted) or any(
            w is not None and w != length for w, length in zip(wanted, value.shape, strict=True)
        ):
            raise BadMessage(f"has the shape {value.shape}, must be {wanted}")
        return np.ascontiguousarray(value)

    def pack(self, value: Any) -> msgpack.ExtType:
        """Return the array as extension data, raw bytes included unless it travels as the tail."""
        array = self.check(value)
        header = array.dtype.str.encode() + struct.pack(f"<B{array.ndim}I", array.ndim, *array.shape)
        if self.layout.tail:
            return msgpack.ExtType(TAIL_EXTENSION, header)
        return msgpack.ExtType(ARRAY_EXTENSION, header + array.tobytes())

    def unpack(self, plain: Any) -> np.ndarray[Any, Any]:
        """Return the array, without another copy; it is read-only."""
        if not isinstance(plain, np.ndarray):
            raise BadMessage(f"is {type(plain).__name__}, must be an array of {self.layout.dtype}")
        return self.check(plain)

    def json_schema(self) -> JsonSchema:
        """Return what a JSON view shows of an array: its dtype and shape. ``x-array`` describes how it travels."""
        lengths: list[JsonSchema] = [
            {"type": "integer", "minimum": 0} if length is None else {"const": length} for length in self.layout.shape
        ]
        return {
            "type": "object",
            "properties": {
                "dtype": {"const": self.layout.dtype},
                "shape": {"type": "array", "prefixItems": lengths, "minItems": len(lengths), "items": False},
            },
            "required": ["dtype", "shape"],
            "x-array": {"dtype": self.layout.dtype, "shape": list(self.layout.shape), "tail": self.layout.tail},
        }


def array_of(code: int, data: bytes) -> np.ndarray[Any, Any]:
    """Return the array that an extension value holds; raises BadMessage."""
    if code != ARRAY_EXTENSION:
        raise BadMessage(f"holds the unknown MessagePack extension {code}")
    dtype, dimensions, end = layout_in(data)
    return shaped(np.frombuffer(data, np.uint8, offset=end), dtype, dimensions)


def layout_in(data: bytes) -> tuple[np.dtype[Any], tuple[int, ...], int]:
    """Return an array\'s dtype and dimensions, and where their description ends; raises BadMessage."""
    if len(data) < 4 or data[:3] not in KNOWN_DTYPES:
        raise BadMessage(f"holds an array of the unknown dtype {data[:3]!r}")
    end = 4 + 4 * data[3]
    if len(data) < end:
        raise BadMessage("holds an array whose shape is cut short")
    return np.dtype(data[:3].decode()), struct.unpack_from(f"<{data[3]}I", data, 4), end


def shaped(raw: np.ndarray[Any, Any], dtype: np.dtype[Any], dimensions: tuple[int, ...]) -> np.ndarray[Any, Any]:
    """Return raw bytes as an array, without a copy; raises BadMessage if they are too many or too few."""
    count = 1
    for length in dimensions:
        count *= length
    if count * dtype.itemsize != raw.size:
        raise BadMessage(f"holds an array of {raw.size} bytes, its shape {dimensions} needs {count * dtype.itemsize}")
    return raw.view(dtype).reshape(dimensions) if raw.size else np.empty(dimensions, dtype)
