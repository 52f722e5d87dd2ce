"""What the planner of the small stack adapts."""

from __future__ import annotations

from regraft import Component, Parameter


class Motor(Component):
    """Turns as fast as it is told."""

    speed = Parameter(1.0, "how fast", minimum=0.0, maximum=4.0, unit="rad/s")
    gear = Parameter(1, "which gear", choices=(1, 2))
