"""A detector's measured performance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from regraft.bus_schema.annotations import PlainValue


@dataclass(frozen=True, slots=True)
class Performance:
    """A detector's hit rate by darkness, and what it costs.

    ``rates`` are the shares of pictures with a hit, the hydrant being in view at 0.4 to 3 m. They are in equal bins of
    darkness (0 is full light, 1 is black). ``cpu`` is seconds of one core for a picture of 320 x 240.
    """

    rates: tuple[float, ...]
    cpu: float

    def rate(self, darkness: float) -> float:
        """Return the hit rate at a darkness, on the line between the middles of the bins."""
        middles = (np.arange(len(self.rates)) + 0.5) / len(self.rates)
        return float(np.interp(darkness, middles, self.rates))

    def estimate(self, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the qualities of a request under a detector's parameters.

        ``context`` may hold ``darkness`` (default 0) and ``in_view`` (the chance that the hydrant is in view, default
        1). ``on_board`` is true by default; another camera sees full light and takes no energy of the robot's.
        ``camera_rate`` is in Hz (default 5); ``pictures`` is how many the request asks for.

        Returns:
            ``detection_rate`` of one picture, ``hits_per_request`` as expected, ``energy_per_request`` (J),
            ``power`` (W, if one request follows another), ``time_per_request`` and ``cpu_per_request`` (s).
        """
        on_board = bool(context.get("on_board", True))
        asked_for = context.get("pictures")
        pictures = float(parameters["pictures"] if asked_for is None else asked_for)
        darkness = float(context.get("darkness", 0.0)) if on_board else 0.0
        rate = self.rate(darkness) * float(context.get("in_view", 1.0))
        camera_rate = float(context.get("camera_rate", 5.0))
        # After the pause it is the next picture that is looked at, not the one that came meanwhile.
        period = max(1, math.ceil(float(parameters["interval"]) * camera_rate - 1e-9)) / camera_rate
        energy = float(parameters["picture_energy"]) if on_board else 0.0
        return {
            "detection_rate": rate,
            "hits_per_request": rate * pictures,
            "energy_per_request": energy * pictures,
            "power": energy / period,
            "time_per_request": period * pictures,
            "cpu_per_request": self.cpu * pictures,
        }
