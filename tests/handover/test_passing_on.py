"""What one run passes on to the next, looked at without hurry: under a clock that stands still."""

from __future__ import annotations

from bus_schema.encoding import codec
from bus_schema.encoding.envelope import Envelope, Kind
from bus_schema.encoding.registry import type_of
from bus_schema.messages.handover import Place
from bus_schema.model.lifecycle import State
from regraft import Component
from regraft.assignment import Assignment, Succession
from regraft.bus import Sample
from regraft.component import class_path
from regraft.memory_bus import MemoryBus
from regraft.runtime import passing_on
from regraft.runtime.held import Held, envelope_of
from regraft.runtime.runtime import Runtime
from regraft.testing import Rig
from tests.handover.parts import Item, Source, Totaller


def item(rig: Rig, number: int, kind: Kind = Kind.DATA) -> Sample:
    """Return the sample of an item, numbered as it is."""
    payload = codec.encode(Item(number)) if kind is Kind.DATA else b""
    attachment = Envelope("source", 1, 1, number, 0, kind).to_bytes()
    return Sample(rig.keys.topic("items"), payload, attachment, type_of(Item).encoding)


def holding(*samples: Sample) -> Held:
    held = Held()
    for sample in samples:
        held.add(sample, envelope_of(sample))
    return held


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
        handed = passing_on.hand_over(incumbent, mine, theirs.first, rig.clock.now())
        assert [envelope_of(Sample(h.key, h.payload, h.attachment, h.encoding)).sequence for h in handed.unhandled] == [  # type: ignore[union-attr]
            5, 4, 3,
        ]  # fmt: skip
        successor = successor_of(rig, Totaller, "totaller")
        passing_on.take_over(successor, handed, theirs, with_state=True)
        rig.settle()
        assert [said_item.number for said_item in said] == [1, 2, 3, 4, 5, 6, 7]
        assert said[-1].total == 28
        successor.leave()


def test_a_timer_keeps_its_rhythm() -> None:
    with Rig() as rig:
        rig.add(Source, parameters={"rate": 1.0})
        incumbent = rig.runtimes["source"]
        rig.advance(2.25)
        handed = passing_on.hand_over(incumbent, Held(), {}, rig.clock.now())
        successor = successor_of(rig, Source, "source")
        successor.parameters.set({"rate": 1.0})
        passing_on.take_over(successor, handed, Held(), with_state=True)
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
            handed = passing_on.hand_over(incumbent, Held(), of_source, rig.clock.now())
            assert len(handed.inputs["items"][0].payload) == size


def test_a_marker_before_what_the_successor_holds_does_not_hide_it() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        incumbent = rig.runtimes["totaller"]
        incumbent.inbound.arrive(item(rig, 1))
        incumbent.work()
        both = (item(rig, 2), item(rig, 3), item(rig, 3, Kind.MARKER))
        handed = passing_on.hand_over(incumbent, holding(*both), holding(*both).first, rig.clock.now())
        successor = successor_of(rig, Totaller, "totaller")
        passing_on.take_over(successor, handed, holding(*both), with_state=True)
        rig.settle()
        assert [said_item.number for said_item in said] == [1, 2, 3]
        successor.leave()
