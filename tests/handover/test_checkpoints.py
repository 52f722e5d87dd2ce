"""A component publishes a checkpoint when it wants to, and a state that cannot be kept is reported."""

from __future__ import annotations

from typing import Any

from regraft import Component, Input
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.testing import Rig


class Notebook(Component):
    """Keeps what it has heard, at once."""

    heard = Input(Twist, topic="numbers", required=False)

    def __init__(self) -> None:
        self.notes: list[float] = []

    @heard.handler
    def note(self, message: Twist) -> None:
        self.notes.append(message.linear.x)
        self.kit.checkpoint()

    def snapshot(self) -> dict[str, Any]:
        return {"notes": object() if 13.0 in self.notes else list(self.notes)}


def test_a_checkpoint_is_published_when_a_component_asks_for_it() -> None:
    with Rig() as rig:
        kept = _kept(rig)
        rig.publish("numbers", Twist(Vector3(1.0)))
        rig.publish("numbers", Twist(Vector3(2.0)))
        rig.advance(60.0)
        assert [each.state for each in kept] == [{"notes": [1.0]}, {"notes": [1.0, 2.0]}]


def test_a_state_that_cannot_be_kept_is_a_fault_and_the_component_continues() -> None:
    with Rig() as rig:
        kept = _kept(rig)
        rig.publish("numbers", Twist(Vector3(13.0)))
        rig.advance(1.0)
        assert not kept
        (fault,) = rig.take_faults()
        assert "snapshot: state: is object, must be plain data" in fault
        assert rig.status("notebook").state.value == "active"


def _kept(rig: Rig) -> list[Snapshot]:
    """Add the component, and return its checkpoints as they come."""
    kept: list[Snapshot] = []

    def take(sample: Sample) -> None:
        kept.append(codec.decode(sample.payload, Snapshot))

    rig.bus.subscribe(rig.keys.checkpoint("notebook"), take)
    rig.add(Notebook, name="notebook")
    return kept
