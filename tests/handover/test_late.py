"""What was put before a hand-over may arrive after what was put behind it: by another way, over other hubs."""

from __future__ import annotations

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.runtime.data.writers import Identity, Writer, Writers
from regraft.testing import Rig
from tests.handover.parts import Item, Totaller


def writer(rig: Rig, incarnation: int, behind: int) -> Writer:
    """Return a writer that goes on with the numbering of the source's first run."""
    writers = Writers(rig.bus, rig.clock, Identity("source", 1, incarnation))
    writers.go_on_from({rig.keys.topic("items"): behind})
    return writers.open(rig.keys.topic("items"), type_of(Item).encoding)


def put(rig: Rig, by: Writer, number: int) -> None:
    by.put(codec.encode(Item(number)))
    rig.settle()


def test_late_messages_of_the_run_before_are_handled_in_their_place() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        before, after, late = writer(rig, 1, 0), writer(rig, 2, 4), writer(rig, 1, 2)
        for number in (1, 2):
            put(rig, before, number)
        for number in (5, 6):
            put(rig, after, number)
        for number in (3, 4):
            put(rig, late, number)
        assert [item.number for item in said] == [1, 2, 3, 4, 5, 6]


def test_the_run_before_cannot_go_on_where_the_next_one_is_heard() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        before, after = writer(rig, 1, 0), writer(rig, 2, 1)
        put(rig, before, 1)
        put(rig, after, 2)
        for number in (2, 3, 4):
            put(rig, before, -number % 100)
        put(rig, after, 3)
        assert [item.number for item in said] == [1, 2, 3]


def test_late_messages_are_handled_too_where_a_marker_of_the_next_run_came_first() -> None:
    with Rig() as rig:
        rig.add(Totaller)
        said = rig.collect("totals", Item)
        before, after = writer(rig, 1, 0), writer(rig, 2, 3)
        before.mark()
        put(rig, before, 1)
        after.mark()
        rig.settle()
        for number in (2, 3):
            put(rig, before, number)
        put(rig, before, 99)
        put(rig, after, 4)
        assert [item.number for item in said] == [1, 2, 3, 4]
