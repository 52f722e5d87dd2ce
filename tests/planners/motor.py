"""What the planner of the small stack adapts."""

from __future__ import annotations

from regraft import Component, Parameter, Quality
from regraft.bus_schema.annotations import PlainValue


class Motor(Component):
    """Turns as fast as it is told."""

    speed = Parameter(1.0, "how fast", minimum=0.0, maximum=4.0, unit="rad/s")
    gear = Parameter(1, "which gear", choices=(1, 2))

    work = Quality(better="higher", measured=False)
    wear = Quality(better="lower", measured=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Expect to do more the faster it turns, and to wear out."""
        speed = float(parameters["speed"])
        return {"work": speed * float(parameters["gear"]), "wear": speed**2}


class StrongMotor(Motor):
    """Does twice as much at any speed."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Expect twice as much work."""
        found = super().estimate(parameters, context)
        return {**found, "work": 2 * found["work"]}
