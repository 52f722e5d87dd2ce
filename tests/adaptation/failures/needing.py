"""Components that need amounts and devices of their hosts."""

from __future__ import annotations

from regraft import Component, Resources
from regraft.bus_schema.annotations import PlainValue

HERE = "tests.adaptation.failures.needing"


class Small(Component):
    """Needs a little power, and has a state."""

    resources = Resources(memory=10.0, amounts={"power": 2.0})

    def snapshot(self) -> PlainValue:
        return {}

    def restore(self, state: PlainValue) -> None:
        pass


class Large(Small):
    """Needs more power."""

    resources = Resources(memory=10.0, amounts={"power": 5.0})


class Exclusive(Small):
    """Releases its power before a successor takes it."""

    exclusive = True


class Fast(Small):
    """Computes on an accelerator."""

    resources = Resources(amounts={"accelerator_area": 0.5}, devices=("fpga",))
