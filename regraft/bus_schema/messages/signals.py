"""Signals that robots give each other and people: colours, sounds, and radio messages."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Ratio
from regraft.bus_schema.encoding.registry import message


@message("regraft/Colour")
@dataclass(frozen=True, slots=True)
class Colour:
    """A colour that a lamp shines in, by its share of red, green and blue light; all zero is off."""

    red: Ratio = 0.0
    green: Ratio = 0.0
    blue: Ratio = 0.0
