"""How dark it is, as FROG has it: light that comes and goes like a sine."""

from __future__ import annotations

import math

from regraft import Component, Output, Parameter, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.description import Resources


def darkness_at(time: float, period: float, phase: float, darkest: float = 1.0) -> float:
    """Return (1 + sin(2 pi (time + phase) / period)) / 2, scaled to at most ``darkest``.

    All times in s; at time 0 the curve is ``phase`` seconds past its rising middle.
    """
    return darkest * (1.0 + math.sin(math.tau * (time + phase) / period)) / 2.0


class Lighting(Component):
    """Reports how dark it is: full light and full darkness in turns.

    The curve follows the stack's clock, so a restarted component continues where the light is. The defaults are those
    measured in the published FROG runs: 0.006 Hz, begun 51.8 s before the mission.
    """

    resources = Resources(cpu=0.01, memory=20.0)

    period = Parameter(1.0 / 0.006, "from one darkness to the next", minimum=1.0, unit="s")
    phase = Parameter(51.8, "how far the curve is at time 0", unit="s")
    darkest = Parameter(1.0, "darkness at the darkest", minimum=0.0, maximum=1.0)

    darkness = Quality("0 is full light, 1 is black", better="lower", minimum=0.0, maximum=1.0, functional=True)

    light = Output(LightLevel, description="how dark it is now")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``darkness`` (0 to 1) at ``context["time"]`` (s), or without one its mean over a period."""
        darkest = float(parameters.get("darkest", cls.darkest.default))
        if "time" not in context:
            return {"darkness": darkest / 2.0}
        period = float(parameters.get("period", cls.period.default))
        phase = float(parameters.get("phase", cls.phase.default))
        return {"darkness": darkness_at(float(context["time"]), period, phase, darkest)}

    def evaluate(self) -> dict[str, float]:
        """Return the ``darkness`` (0 to 1) now."""
        return {"darkness": darkness_at(self.kit.now(), self.period, self.phase, self.darkest)}

    @every(hz=2.0)
    def tell(self) -> None:
        """Publish how dark it is."""
        now = self.kit.now()
        self.light.publish(LightLevel(now, darkness_at(now, self.period, self.phase, self.darkest)))
