"""Components that measure well, badly and not at all."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from regraft import Component, Input, Parameter, Quality
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.system import SystemMeasurements


class Unprintable:
    """Cannot be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("cannot be shown")

    def __hash__(self) -> int:
        return 1


VALUES: dict[str, Any] = {
    "fine": 0.5,
    "whole": 1,
    "array's": np.float32(0.25),
    "nan": math.nan,
    "infinite": math.inf,
    "text": "0.5",
    "yes": True,
    "list": [0.5],
    "none": None,
    "complex": 0.5j,
    "huge": 10**400,
    "too much": 1.5,
    "too little": -0.1,
}


class Gauge(Component):
    """Gives whatever it is told to."""

    evaluate_every = 0.5

    mood = Parameter("fine", choices=(*VALUES, "left out", "undeclared", "no map", "raises", "unprintable"))

    level = Quality("of the tank", unit="m", better="higher", minimum=0.0, maximum=1.0, functional=True)
    cost = Quality("of filling it", unit="J", better="lower", measured=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return a cost, and the level that the context gives."""
        return {"cost": 2.0, "level": context.get("level", 0.5)}

    def evaluate(self) -> dict[str, float]:
        """Return what the mood has."""
        given: Any = {"level": VALUES.get(self.mood, 0.5)}
        if self.mood == "raises":
            raise RuntimeError("the gauge is broken")
        if self.mood == "left out":
            return {}
        if self.mood == "undeclared":
            given["levle"] = 0.5
        if self.mood == "unprintable":
            given[Unprintable()] = 0.5
        if self.mood == "no map":
            given = [0.5]
        fine: dict[str, float] = given
        return fine


class Busy(Component):
    """Measures now and then, but can be too busy for its timers."""

    evaluate_every = 0.05
    handler_timeout = 5.0

    busy = Parameter(0.0, "for how long tasks keep the timers from their turn", minimum=0.0, unit="s")

    level = Quality("of the tank", unit="m")

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Be busy for a while."""
        self.kit.spawn(self.spin(time.monotonic() + self.busy))

    async def spin(self, until: float) -> None:
        """Come back at once while busy: heartbeats are kept, timers are not."""
        if time.monotonic() < until:
            self.kit.spawn(self.spin(until))

    def evaluate(self) -> dict[str, float]:
        """Return the level."""
        return {"level": 0.5}


class Plain(Component):
    """Declares nothing, and gives nothing."""


class Listener(Component):
    """Reads what others measure."""

    measurements = Input(SystemMeasurements, topic="system/measurements", latest_only=True, required=False)
