"""Signals that robots give each other and people: colours, sounds, and radio messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, DecibelMilliwatts, Decibels, Ratio, Seconds, Text
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage

MAX_PAYLOAD = 116
"""Bytes of a radio message: IEEE 802.15.4 has frames of 127, of which 11 are header and check sum."""


@message("regraft/Colour")
@dataclass(frozen=True, slots=True)
class Colour:
    """A colour that a lamp shines in, by its share of red, green and blue light; all zero is off."""

    red: Ratio = 0.0
    green: Ratio = 0.0
    blue: Ratio = 0.0


@message("regraft/Sound")
@dataclass(frozen=True, slots=True)
class Sound:
    """A word or a tone by its name, with its level at 1 m (sound pressure level) and its duration."""

    word: Annotated[str, Text(64)]
    level: Decibels = 60.0
    duration: Annotated[Seconds, Bounds(minimum=0.0)] = 0.5


@dataclass(frozen=True, slots=True)
class HeardSound:
    """A sound that is recognised, and its level where it is heard."""

    word: str
    level: Decibels


@message("regraft/Hearing")
@dataclass(frozen=True, slots=True)
class Hearing:
    """The level of all that reaches a microphone now, and the sounds that are recognised in it, the loudest first."""

    stamp: Seconds
    level: Decibels
    sounds: tuple[HeardSound, ...] = ()


@message("regraft/RadioMessage")
@dataclass(frozen=True, slots=True)
class RadioMessage:
    """A broadcast of a radio: text of at most 116 bytes of UTF-8."""

    payload: Annotated[str, Text(MAX_PAYLOAD)]

    def __post_init__(self) -> None:
        size = len(self.payload.encode())
        if size > MAX_PAYLOAD:
            raise BadMessage(f"has {size} bytes, must have at most {MAX_PAYLOAD}", ("payload",))


@message("regraft/RadioReception")
@dataclass(frozen=True, slots=True)
class RadioReception:
    """A message that a radio received, the robot that sent it, and the strength of the signal."""

    stamp: Seconds
    sender: str
    payload: str
    signal: DecibelMilliwatts
