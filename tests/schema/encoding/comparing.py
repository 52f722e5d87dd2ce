"""Comparing messages whose fields may be arrays, and showing them as JSON does."""

from __future__ import annotations

import base64
import struct
from dataclasses import fields, is_dataclass
from typing import Any

import msgpack
import numpy as np


def same(one: Any, other: Any) -> bool:
    """Tell whether two messages are equal, arrays bit by bit."""
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.shape == other.shape and one.tobytes() == other.tobytes()
    if type(one) is not type(other):
        return False
    if is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return bool(one == other)


def json_view(plain: Any) -> Any:
    """Return plain data as JSON can hold it: bytes as base64, an array as its dtype and shape."""
    if isinstance(plain, msgpack.ExtType):
        dimensions = plain.data[3]
        shape = struct.unpack_from(f"<{dimensions}I", plain.data, 4)
        return {"dtype": plain.data[:3].decode(), "shape": list(shape)}
    if isinstance(plain, bytes):
        return base64.b64encode(plain).decode()
    if isinstance(plain, list):
        return [json_view(item) for item in plain]
    if isinstance(plain, dict):
        return {key: json_view(item) for key, item in plain.items()}
    return plain
