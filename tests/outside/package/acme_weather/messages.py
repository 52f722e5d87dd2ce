"""A message type of our own."""

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Seconds, Unit
from regraft.bus_schema.encoding.registry import message


@message("acme/Weather")
@dataclass(frozen=True, slots=True)
class Weather:
    """Temperature and rain outside."""

    stamp: Seconds
    temperature: Annotated[float, Unit("K"), Bounds(minimum=0.0)]
    raining: bool = False
