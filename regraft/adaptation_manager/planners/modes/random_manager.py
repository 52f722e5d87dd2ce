"""A manager that changes the robot without a reason: what every other one has to be better than.

SUAVE compares its managers with such a one (SEAMS 2023).
"""

from __future__ import annotations

from random import Random

from regraft import CallFailed, Component, Parameter
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, EnterMode
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.component.parameters import ParameterError


class RandomManager(Component):
    """Enters one of some modes at random, every ``period``; equal seeds choose alike.

    A mode that is listed twice is chosen twice as often.
    """

    modes = Parameter(("normal",), "the modes to choose from")
    period = Parameter(20.0, "time between two choices", minimum=0.1, unit="s")
    first_after = Parameter(20.0, "time until the first choice", minimum=0.0, unit="s")
    adapt_within = Parameter(30.0, "time that entering a mode may take", minimum=0.1, unit="s")

    def on_configure(self) -> None:
        """Check that there is a choice; raises ParameterError."""
        if not self.modes:
            raise ParameterError([("modes", "names no mode: must name one or more to choose from")])

    def on_activate(self) -> None:
        """Begin to choose."""
        self.kit.spawn(self._choose(), "choosing modes")

    async def _choose(self) -> None:
        random = Random(f"{self.kit.seed} {self.kit.name}")
        await self.kit.sleep(self.first_after)
        while True:
            mode = random.choice(self.modes)
            request = AdaptationRequest((EnterMode(mode),), "chosen at random", self.kit.name)
            try:
                await self.kit.call(SHARED + ADAPT, request, AdaptationReport, timeout=self.adapt_within)
            except CallFailed as error:
                self.kit.event("random.undecided", f"mode {mode}: {error}", mode=mode)
            await self.kit.sleep(self.period)
