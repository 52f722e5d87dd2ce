"""Any value can be read out of any message by its path; what cannot be is told from the type alone."""

from __future__ import annotations

import math
import random
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.reading import Reading, Reduce, read
from regraft.bus_schema.encoding.reading_checks import reading_problem
from regraft.bus_schema.encoding.records import RecordShape
from regraft.bus_schema.encoding.registry import MessageType, type_of
from regraft.bus_schema.encoding.shapes import MapShape, OptionalShape, PlainShape, Shape, TupleShape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose, Twist, Vector3
from regraft.bus_schema.messages.health import Event, SensorFault, SensorHealth, SystemStatus
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.power import BatteryState, PowerDraw
from regraft.bus_schema.messages.sensors import Image, LaserScan, Odometry
from tests.schema.every_type import KINDS, messages
from tests.support.tables import check_each

REDUCTIONS = (None, *Reduce)
chance = random.Random()


def paths(shape: Shape, depth: int = 0) -> list[str]:
    """Return paths into a shape: all fields, and for lists, maps and arrays one of each kind; some lead nowhere."""
    if isinstance(shape, OptionalShape):
        return paths(shape.item, depth)
    inner: dict[str, Shape | None] = {}
    if isinstance(shape, RecordShape):
        inner = dict(shape.fields)
    elif isinstance(shape, TupleShape):
        own = paths(shape.item, depth + 1)
        return ["", "0", *own, *(f"0.{path}" for path in own if path)]
    elif isinstance(shape, MapShape | PlainShape):
        inner = {"key": shape.item if isinstance(shape, MapShape) else None, "0": None}
    elif isinstance(shape, ArrayShape):
        inner = {"0": None, ".".join("0" for _ in shape.layout.shape): None}
    found = [""]
    for name, part in inner.items():
        further = paths(part, depth + 1) if part is not None and depth < 6 else [""]
        found += [f"{name}.{path}" if path else name for path in further]
    return found


def is_plain(value: object) -> bool:
    """Tell whether a value is what entries may be."""
    if isinstance(value, list):
        return all(map(is_plain, value))
    return isinstance(value, bool | int | float | str) and not (isinstance(value, float) and math.isnan(value))


def holds_plain_data(shape: Shape, path: list[str]) -> bool:
    """Tell whether a path leads into plain data, whose form no type tells."""
    if isinstance(shape, PlainShape):
        return True
    if isinstance(shape, OptionalShape):
        return holds_plain_data(shape.item, path)
    if isinstance(shape, TupleShape | MapShape):
        return holds_plain_data(shape.item, path[1:]) or holds_plain_data(shape.item, path)
    return isinstance(shape, RecordShape) and any(
        holds_plain_data(inner, path[1:]) for name, inner in shape.fields if path and name == path[0]
    )


def test_whatever_the_type_promises_every_message_of_it_has() -> None:
    check_each(KINDS, have_what_is_promised, lambda kind: kind.name)


def have_what_is_promised(kind: MessageType) -> None:
    """Check that all that can be read by the type can be read out of some of its messages, and is plain."""
    arrived: list[Any] = [codec.decode(codec.encode(message), kind.cls) for message in messages(kind)]
    for path, reduce in product(paths(kind.shape), REDUCTIONS):
        reading = Reading(path, reduce)
        problem = reading_problem(kind.shape, reading)
        for message in chance.sample(arrived, min(3, len(arrived))):
            try:
                value = read(message, reading)
            except BadMessage as error:
                assert problem or holds_plain_data(kind.shape, path.split(".")), f"{reading}: {error} {message}"
            else:
                assert problem or value is None or is_plain(value), f"{reading}: {value} {message}"


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from(KINDS),
    st.lists(st.one_of(st.sampled_from(("stamp", "0", "x", "", "ranges")), st.text(max_size=5)), max_size=5),
    st.sampled_from(REDUCTIONS),
)
def test_no_path_however_odd_breaks_the_check(kind: Any, path: list[str], reduce: Reduce | None) -> None:
    problem = reading_problem(kind.shape, Reading(".".join(path), reduce))
    assert problem is None or kind.cls.__name__ in problem


ODOMETRY = Odometry(7.0, "odom", "base", Pose(), Twist(Vector3(0.3, -0.4, 0.0)))
HEALTH = SensorHealth(1.0, ("scan", "odometry"), (SensorFault("scan", "silent", "no scan", 0.5),) * 2)


def scan(*ranges: float) -> LaserScan:
    """Return a scan."""
    return LaserScan(1.0, "lidar", "base", Pose(), 0.0, 0.1, 0.12, 3.5, np.array(ranges, np.float32))


@pytest.mark.parametrize(
    ("message", "reading", "expected"),
    [
        (ODOMETRY, Reading("twist.linear.x"), 0.3),
        (ODOMETRY, Reading("twist.linear.y", Reduce.ABS), 0.4),
        (ODOMETRY, Reading("twist.linear", Reduce.NORM), 0.5),
        (ODOMETRY, Reading("child_frame"), "base"),
        (scan(0.0, 2.0, np.inf, 0.5), Reading("ranges", Reduce.MIN, at_least=0.12), 0.5),
        (scan(0.0, 2.0, np.inf, 1.0), Reading("ranges", Reduce.MAX), 2.0),
        (scan(1.0, 2.0, np.inf), Reading("ranges", Reduce.MEAN), 1.5),
        (scan(1.0, 2.0), Reading("ranges.1"), 2.0),
        (scan(1.0, 2.0), Reading("ranges.7"), None),
        (scan(1.0, 2.0), Reading("ranges", Reduce.LENGTH), 2),
        (scan(np.inf, 0.0), Reading("ranges", Reduce.MIN, at_least=0.12), None),
        (scan(np.inf, 0.0), Reading("ranges", Reduce.MIN, at_least=0.12, if_none=3.5), 3.5),
        (BatteryState(1.0, 5.0, 10.0, 0.5, 7.0), Reading("charge"), 0.5),
        (PowerDraw(1.0, 9.0, {"motors": 4.0, "cpu": 5.0}), Reading("consumers.motors"), 4.0),
        (PowerDraw(1.0, 9.0, {"motors": 4.0, "cpu": 5.0}), Reading("consumers", Reduce.MAX), 5.0),
        (PowerDraw(1.0, 9.0, {}), Reading("consumers.motors"), None),
        (PowerDraw(1.0, 9.0, {}), Reading("consumers", Reduce.MAX), None),
        (HEALTH, Reading("faults", Reduce.LENGTH), 2),
        (HEALTH, Reading("faults.text", Reduce.TEXT), "no scan; no scan"),
        (HEALTH, Reading("faults.0.since"), 0.5),
        (HEALTH, Reading("watched"), ["scan", "odometry"]),
        (SystemStatus(1.0, {}, None), Reading("charge"), None),
        (SystemStatus(1.0, {}, None), Reading("charge", if_none=-1.0), -1.0),
        (SystemStatus(1.0, {}), Reading("problems", Reduce.TEXT), ""),
        (MissionStatus(1.0, MissionState.PAUSED, "Main", 3), Reading("state"), "paused"),
        (Event(1.0, "a.b", "c", "d", {"speed": {"x": -2}}), Reading("details.speed.x", Reduce.ABS), 2),
    ],
)
def test_readings_mean_what_they_say(message: Any, reading: Reading, expected: Any) -> None:
    assert reading_problem(type_of(type(message)).shape, reading) is None
    value = read(message, reading)
    assert value == pytest.approx(expected) if isinstance(expected, float) else value == expected
    assert type(value) is type(expected)


@pytest.mark.parametrize(
    ("cls", "reading", "problem"),
    [
        (Odometry, Reading("twist.linar.x"), "Odometry.twist has no field 'linar'; it has: linear, angular"),
        (Odometry, Reading(""), "Odometry has no field ''; it has: stamp, frame, child_frame, pose, twist"),
        (Odometry, Reading("stamp.x"), "Odometry.stamp has no field 'x'; it is a number"),
        (Odometry, Reading("twist"), "Odometry.twist is a Twist, must be a number, truth value or text, or a list of "),
        (Odometry, Reading("twist", Reduce.NORM), "Odometry.twist is a Twist, must be a record, list or array of num"),
        (Odometry, Reading("frame", Reduce.ABS), "Odometry.frame is text, must be a number for 'abs'"),
        (LaserScan, Reading("ranges"), "LaserScan.ranges is an array, must be a number"),
        (LaserScan, Reading("ranges.first"), "LaserScan.ranges has no field 'first'; it is an array"),
        (Image, Reading("pixels.0"), "Image.pixels has no field '0'; it is an array"),
        (SensorHealth, Reading("faults.txt"), "SensorHealth.faults has no field 'txt'; it has: topic, fault, text"),
        (SensorHealth, Reading("faults.since", Reduce.NORM), None),
        (SensorHealth, Reading("faults.topic", Reduce.MAX), "SensorHealth.faults.topic is a list, must be a list, map"),
    ],
)
def test_what_a_type_has_not_is_told_with_what_it_has(cls: type, reading: Reading, problem: str | None) -> None:
    told = reading_problem(type_of(cls).shape, reading)
    assert told is None if problem is None else (told or "").startswith(problem), told
