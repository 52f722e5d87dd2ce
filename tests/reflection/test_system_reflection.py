"""The component that reads topics for missions: each entry at its rate, only what is new, with the source's stamp."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import MessageType
from regraft.bus_schema.messages.geometry import Vector3
from regraft.bus_schema.messages.health import Event, SystemStatus
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.reflection import ReflectedEntries, ReflectedEntry
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.services.system_reflection import SystemReflection
from regraft.testing import Rig
from tests.reflection.parts import Battery, Wheels, battery_state, odometry_of

SPEED = {"topic": "odometry", "field": "twist.linear.x", "entry": "speed", "rate": 10, "stale_after": 1.0}
CHARGE = {"topic": "battery", "field": "charge", "entry": "battery_charge", "rate": 2}


def reflecting(rig: Rig, *mapping: dict[str, Any], **more: Any) -> list[ReflectedEntries]:
    """Start a system reflection; returns what it will have told."""
    told = rig.collect("reflection", ReflectedEntries)
    rig.add(SystemReflection, "system_reflection", {"mapping": list(mapping)}, **more)
    return told


def test_at_first_it_tells_which_entries_there_will_be() -> None:
    with Rig(start=5.0) as rig:
        told = reflecting(rig, SPEED, CHARGE)
        assert told == [
            ReflectedEntries(5.0, (ReflectedEntry("speed", stale_after=1.0), ReflectedEntry("battery_charge")))
        ]


def test_a_new_message_is_told_of_once_and_everything_else_with_it() -> None:
    with Rig() as rig:
        told = reflecting(rig, SPEED, CHARGE)
        rig.publish("odometry", odometry_of(0.01, 0.2))
        rig.advance(1.0)
        assert told[1:] == [
            ReflectedEntries(0.0, (ReflectedEntry("speed", 0.2, 0.01, 1, 1.0), ReflectedEntry("battery_charge")))
        ]
        rig.publish("battery", battery_state(1.0, 0.5))
        rig.advance(1.0)
        assert told[2:] == [
            ReflectedEntries(
                1.0,
                (ReflectedEntry("speed", 0.2, 0.01, 1, 1.0), ReflectedEntry("battery_charge", 0.5, 1.0, 1)),
            )
        ]


def test_equal_values_are_new_when_the_source_says_them_anew() -> None:
    with Rig() as rig:
        told = reflecting(rig, SPEED)
        for stamp in (0.0, 0.5):
            rig.publish("odometry", odometry_of(stamp, 0.2))
            rig.advance(0.5)
        assert [message.entries[0].stamp for message in told[1:]] == [0.0, 0.5]


def test_what_comes_is_told_at_once_and_what_comes_too_soon_after_it_when_its_time_has_come() -> None:
    with Rig() as rig:
        told = reflecting(rig, {**SPEED, "rate": 2})
        for stamp, speed in ((0.0, 0.1), (0.1, 0.2), (0.2, 0.3)):
            rig.publish("odometry", odometry_of(stamp, speed))
            rig.advance(0.1)
        rig.advance(1.0)
        rig.publish("odometry", odometry_of(1.3, 0.4))
        assert [(round(message.stamp, 3), message.entries[0].value) for message in told[1:]] == [
            *((0.0, 0.1), (0.5, 0.3), (1.3, 0.4)),
        ]


@pytest.mark.parametrize("rate", [1.0, 2.0, 3.0, 7.0, 10.0, 0.5])
def test_an_entry_is_read_at_its_rate_however_often_its_topic_is_written(rate: float) -> None:
    with Rig() as rig:
        rig.add(Wheels)
        told = reflecting(rig, {**SPEED, "rate": rate})
        rig.advance(10.0)
        assert len(told) - 1 == round(10.0 * rate)


def test_entries_of_one_topic_come_in_one_message() -> None:
    with Rig() as rig:
        rig.add(Battery)
        told = reflecting(rig, CHARGE, {**CHARGE, "entry": "power", "field": "power", "rate": 4})
        rig.advance(1.0)
        stamps = [message.stamp for message in told]
        assert len(stamps) == len(set(stamps)) == 5
        assert [entry.value for entry in told[1].entries] == [0.99, 7.0]


def test_what_is_not_read_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    with Rig() as rig:
        reflecting(rig, {**SPEED, "rate": 1.0})
        decoded = []
        decode = codec.decode_as

        def noted(kind: MessageType, payload: bytes) -> Any:
            decoded.append(kind.name)
            return decode(kind, payload)

        monkeypatch.setattr(codec, "decode_as", noted)
        for _ in range(19):
            rig.publish("odometry", odometry_of(0.0, 0.2))
            rig.advance(0.05)
        assert decoded.count("regraft/Odometry") == 1


def test_an_empty_field_tells_nothing_new() -> None:
    status = {"topic": "system_status", "field": "charge", "entry": "told_charge", "rate": 2}
    with Rig() as rig:
        told = reflecting(rig, status)
        for charge in (None, 0.5, None):
            rig.publish("system_status", SystemStatus(rig.clock.now() / 1e9, {}, charge))
            rig.advance(0.5)
        assert [message.entries[0] for message in told] == [
            ReflectedEntry("told_charge"),
            ReflectedEntry("told_charge", 0.5, 0.5, 2),
        ]


def test_a_message_without_stamp_is_as_old_as_its_publishing() -> None:
    mapping = {"topic": "place", "field": "x", "entry": "x", "rate": 2}
    with Rig(start=3.0) as rig:
        told = reflecting(rig, mapping)
        rig.publish("place", Vector3(1.0, 0.0, 0.0))
        rig.advance(0.5)
        assert told[-1].entries == (ReflectedEntry("x", 1.0, 3.0, 1),)


def test_plain_data_of_another_form_is_told_of_once_and_harms_nobody() -> None:
    mapping = {"topic": "happened", "field": "details.x", "entry": "x", "rate": 10}
    with Rig() as rig:
        told = reflecting(rig, mapping, CHARGE)
        for details in ({"x": {"y": 1}}, {"x": {"y": 2}}, {"x": 3}):
            rig.publish("happened", Event(0.0, "a.b", "c", "d", details))
            rig.advance(0.5)
        assert told[-1].entries[0].value == 3
        unreadable = [event.text for event in rig.events if event.kind == "reflection.unreadable"]
        assert unreadable == [
            "x, from happened: field 'details.x' is dict, must be a number, truth value or text, or a list of them"
        ]


def test_how_many_there_are_is_a_value_too() -> None:
    with Rig() as rig:
        told = reflecting(rig, {"topic": "seen", "field": "objects", "reduce": "length", "entry": "seen", "rate": 2})
        rig.publish("seen", Detections(0.0, "camera"))
        rig.advance(0.5)
        assert told[-1].entries[0].value == 0


def test_a_message_that_has_not_the_field_is_told_of_too() -> None:
    with Rig() as rig:
        told = reflecting(rig, SPEED, connections={"speed": "light"})
        rig.publish("light", LightLevel(0.0, 0.5))
        rig.advance(0.5)
        assert len(told) == 1


def test_without_mapping_it_is_silent() -> None:
    with Rig() as rig:
        told = reflecting(rig)
        rig.advance(5.0)
        assert told == []
