"""The meaning of a message's field: its unit, its bounds, the layout of an array.

``Annotated`` carries them, so that a type checker sees plain ``float`` and a tool reads the unit:

>>> from regraft.bus_schema.annotations import Metres
>>> from typing import get_args
>>> get_args(Metres)
(<class 'float'>, Unit(symbol='m'))
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit of a number, in SI symbols; ``1`` is a ratio. A text that names a file has ``path``."""

    symbol: str


@dataclass(frozen=True, slots=True)
class Bounds:
    """The inclusive range that a number must lie in."""

    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True, slots=True)
class Text:
    """The longest text that a field takes, in characters; ``cut`` has a longer one cut when it is packed.

    Cut only texts for people, which may quote anything: the report itself is always sent.
    """

    longest: int
    cut: bool = False


@dataclass(frozen=True, slots=True)
class OneOf:
    """The members of an enumeration that a field takes, where others have no meaning there."""

    members: tuple[Enum, ...]


@dataclass(frozen=True, slots=True)
class Named:
    """The name under which a field travels, where that of its attribute is another: Python reserves ``class``."""

    name: str


@dataclass(frozen=True, slots=True)
class MayBeInfinite:
    """Marks a float that may be infinite; no float may be NaN."""


@dataclass(frozen=True, slots=True)
class Array:
    """The layout of a numpy array field: little-endian ``dtype``, and ``shape`` with ``None`` for a free length.

    An array with ``tail=True`` is large: it travels raw behind the message's header (at most one per message).
    """

    dtype: str
    shape: tuple[int | None, ...]
    tail: bool = False


@dataclass(frozen=True, slots=True)
class Tagged:
    """Names the key that distinguishes the members of a union of dataclasses; each has its tag as a ClassVar."""

    key: str


Metres = Annotated[float, Unit("m")]
SquareMetres = Annotated[float, Unit("m2"), Bounds(minimum=0.0)]
Radians = Annotated[float, Unit("rad")]
Seconds = Annotated[float, Unit("s")]
Hertz = Annotated[float, Unit("Hz"), Bounds(minimum=0.0)]
MetresPerSecond = Annotated[float, Unit("m/s")]
RadiansPerSecond = Annotated[float, Unit("rad/s")]
Watts = Annotated[float, Unit("W")]
FilePath = Annotated[str, Unit("path")]
"""The absolute path of a file that is only read: it has to be there, on the machine that runs the component."""
Joules = Annotated[float, Unit("J")]
Newtons = Annotated[float, Unit("N")]
Decibels = Annotated[float, Unit("dB")]
DecibelMilliwatts = Annotated[float, Unit("dBm")]
Lux = Annotated[float, Unit("lx"), Bounds(minimum=0.0)]
Ratio = Annotated[float, Unit("1"), Bounds(0.0, 1.0)]
Count = Annotated[int, Bounds(minimum=0)]
ClassPath = Annotated[str, Named("class")]
"""``module:Class``, as a field named ``class``."""
Connections = Annotated[dict[str, str | None], Named("connect")]
"""Port to topic, None for a port that is connected to no topic; as a field named ``connect``."""
Told = Annotated[str, Text(65_536, cut=True)]
ToldBriefly = Annotated[str, Text(4096, cut=True)]

FloatArray = NDArray[np.float32]
ByteArray = NDArray[np.uint8]
SignedByteArray = NDArray[np.int8]

PlainValue = Any
"""A value of plain data: None, bool, int, float, str, bytes, or lists and string-keyed maps of them."""
