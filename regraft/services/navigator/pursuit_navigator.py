"""A navigator that costs less: the same but for its local control."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from regraft.bus_schema.model.description import Resources
from regraft.services.navigator.driving.local_controller import Controller, Manoeuvres
from regraft.services.navigator.driving.pursuit import PursuitController
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.qualities import PURSUIT, Caution


class PursuitNavigator(Navigator):
    """Drives the robot to goal poses by pure pursuit: at about half the cost, without leaving the planned path."""

    resources = Resources(cpu=0.04, memory=30.0)
    controller: ClassVar[Callable[[Manoeuvres], Controller]] = PursuitController
    caution: ClassVar[Caution] = PURSUIT
