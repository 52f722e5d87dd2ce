"""A manager that changes the robot without a reason: what every other one has to be better than."""

from __future__ import annotations

from random import Random

from regraft import CallFailed, Component, Parameter, RequestRefused
from regraft.adaptation_manager.planners.manager_client import AdaptationOrder, Manager
from regraft.bus_schema.model.adaptation import Change, EnterMode
from regraft.bus_schema.model.architecture import Architecture


class RandomManager(Component):
    """Enters one of some modes at random, every ``period``; equal seeds choose alike."""

    modes = Parameter(("to_navigate.normal",), "the modes to choose from")
    period = Parameter(20.0, "time between two choices", minimum=0.1, unit="s")
    adapt_within = Parameter(30.0, "time that entering a mode may take", minimum=0.1, unit="s")

    def on_activate(self) -> None:
        """Begin to choose."""
        self._manager = Manager(self.kit)
        self.kit.spawn(self._choose(), "choosing modes")

    async def _choose(self) -> None:
        random = Random(f"{self.kit.seed} {self.kit.name}")
        while True:
            await self.kit.sleep(self.period)
            mode = random.choice(self.modes)
            try:
                await self._enter(mode)
            except (CallFailed, RequestRefused) as error:
                self.kit.event("random.undecided", str(error))

    async def _enter(self, mode: str) -> None:
        def plan(seen: Architecture) -> tuple[Change, ...]:
            return (EnterMode(mode),)

        architecture = await self._manager.architecture(self.adapt_within)
        order = AdaptationOrder(self.kit.name, "chosen at random")
        done = await self._manager.carry_out(plan, architecture, order, self.adapt_within)
        if not done.stands:
            self.kit.event("random.failed", f"mode {mode} could not be entered: {done.problem}", mode=mode)
