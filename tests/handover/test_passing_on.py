"""What one run passes on to the next, looked at without hurry: under a clock that stands still."""

from __future__ import annotations

from regraft import Component
from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.handover import Place
from regraft.bus_schema.model.lifecycle import State
from regraft.component.component import class_path
from regraft.runtime.core.assignment import Assignment, Succession
from regraft.runtime.data.replay_buffer import ReplayBuffer, envelope_of
from regraft.runtime.handover.transfer import Transfer
from regraft.runtime.runtime import Runtime
from regraft.testing import Rig
from tests.handover.parts import Item, Source, Totaller


def item(rig: Rig, number: int, kind: Kind = Kind.DATA) -> Sample:
    """Return the sample of an item, numbered as it is."""
    payload = codec.encode(Item(number)) if kind is Kind.DATA else b""
    attachment = Envelope("source", 1, 1, number, 0, kind).to_bytes()
    return Sample(rig.keys.topic("items"), payload, attachment, type_of(Item).encoding)


def holding(*samples: Sample) -> ReplayBuffer:
    held = ReplayBuffer()
    for sample in samples:
        held.add(sample, envelope_of(sample))
    return held


def transfer_of(runtime: Runtime) -> Transfer:
    return Transfer(runtime, runtime.lifecycle, runtime.checkpoints)


def successor_of(rig: Rig, cls: type[Component], name: str) -> Runtime:
    """Return a successor that is ready."""
    given = Assignment(rig.keys.system, name, class_path(cls), 2, heartbeat=3600.0, succeeds=Succession(1))
    runtime = Runtime(cls, given, MemoryBus(rig.hub), rig.clock)
    runtime.lifecycle.reach(State.INACTIVE)
    return runtime


def test_what_was_not_handled_is_handled_by_the_successor_in_its_place() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        incumbent = rig.runtimes["totaller"]
        for number in (1, 2, 5):  # the fifth waits for those before it
            incumbent.inbound.arrive(item(rig, number))
        incumbent.work()
        theirs = holding(item(rig, 6), item(rig, 7))
        mine = holding(item(rig, 4), item(rig, 3), item(rig, 6))
        handed = transfer_of(incumbent).hand_over(mine, theirs.first, rig.clock.now())
        assert [envelope_of(Sample(h.key, h.payload, h.attachment, h.encoding)).sequence for h in handed.unhandled] == [  # type: ignore[union-attr]
            5, 4, 3,
        ]  # fmt: skip
        successor = successor_of(rig, Totaller, "totaller")
        transfer_of(successor).take_over(handed, theirs, with_state=True)
        rig.settle()
        assert [said_item.number for said_item in said] == [1, 2, 3, 4, 5, 6, 7]
        assert said[-1].total == 28
        successor.leave()


def test_a_timer_keeps_its_rhythm() -> None:
    with Rig() as rig:
        rig.add(Source, parameters={"rate": 1.0})
        incumbent = rig.runtimes["source"]
        rig.advance(2.25)
        handed = transfer_of(incumbent).hand_over(ReplayBuffer(), {}, rig.clock.now())
        successor = successor_of(rig, Source, "source")
        successor.parameters.set({"rate": 1.0})
        transfer_of(successor).take_over(handed, ReplayBuffer(), with_state=True)
        assert successor.timers.next_due() == 3_000_000_000
        successor.leave()


def test_the_newest_message_that_the_successor_holds_is_named_and_not_sent() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        incumbent = rig.runtimes["totaller"]
        for number in (1, 2):
            incumbent.inbound.arrive(item(rig, number))
        incumbent.work()
        for first, size in ((2, 0), (3, len(item(rig, 2).payload))):
            of_source = {rig.keys.topic("items"): {"source": Place(1, first)}}
            handed = transfer_of(incumbent).hand_over(ReplayBuffer(), of_source, rig.clock.now())
            assert len(handed.inputs["items"][0].payload) == size


def test_a_marker_before_what_the_successor_holds_does_not_hide_it() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        incumbent = rig.runtimes["totaller"]
        incumbent.inbound.arrive(item(rig, 1))
        incumbent.work()
        both = (item(rig, 2), item(rig, 3), item(rig, 3, Kind.MARKER))
        handed = transfer_of(incumbent).hand_over(holding(*both), holding(*both).first, rig.clock.now())
        successor = successor_of(rig, Totaller, "totaller")
        transfer_of(successor).take_over(handed, holding(*both), with_state=True)
        rig.settle()
        assert [said_item.number for said_item in said] == [1, 2, 3]
        successor.leave()
