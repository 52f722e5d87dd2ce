"""Classes that one may want to have in the place of a totaller, and some that one may not."""

from __future__ import annotations

from regraft import Component, Input, Output, Parameter, service
from regraft.bus_schema.annotations import PlainValue
from tests.handover.parts import Ask, Item, Totaller


class Counting(Totaller):
    """Another configuration of a totaller: some of its parameters, ports and services, and some of its own."""

    offset = Parameter(1, minimum=0, maximum=5)
    label = Parameter("plain", choices=("plain", "fancy"), read_only=True)
    config = Output(Item, required=False, topic="config")  # type: ignore[assignment]
    spare = Input(Item, required=False)

    @service("configured")
    def configured(self, ask: Ask) -> Item:
        """Say how it is configured."""
        return Item(int(self.label == "fancy"), self.offset)


class Needy(Totaller):
    """Needs an input that a totaller does not have."""

    more = Input(Item, topic="nowhere")


class Second(Totaller):
    """Has a state of a later version, and goes on from the first too."""

    state_version = 2
    converts_versions = (1,)

    @classmethod
    def convert_state(cls, state: PlainValue, version: int) -> PlainValue:
        """Put the total where it is now."""
        return {"of": {"total": state["total"]}, "calls": state["calls"], "steps": state["steps"]}

    def snapshot(self) -> PlainValue:
        """Return the state."""
        return {"of": {"total": self.total}, "calls": self.calls, "steps": self.steps}

    def restore(self, state: PlainValue) -> None:
        """Go on."""
        self.total, self.calls, self.steps = state["of"]["total"], state["calls"], state["steps"]


class Broken(Totaller):
    """Cannot be configured."""

    def on_configure(self) -> None:
        """Refuse."""
        raise RuntimeError("not like this")


class Lame(Totaller):
    """Cannot be activated."""

    def on_activate(self) -> None:
        """Refuse."""
        raise RuntimeError("cannot get up")


class Onlooker(Component):
    """Lives by the wall clock, also under simulated time."""

    lockstep = False


class Mute(Totaller):
    """Goes on from a state, and gives none."""

    def snapshot(self) -> PlainValue:
        """Fail."""
        raise RuntimeError("cannot say how I am")


class Hoarder(Totaller):
    """Goes on from a state, and gives one that is far too large."""

    many = Parameter(True, "whether it is of many small values, or of one large text")

    def snapshot(self) -> PlainValue:
        """Return what would take long to pack, but is quickly made: an author's own slowness is not tried here."""
        return {"total": self.total, "hoard": [1 << 62] * 20_000_000 if self.many else "x" * 200_000_000}
