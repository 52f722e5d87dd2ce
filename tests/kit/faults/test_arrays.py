"""Arrays travel on topics alone: a class that offers or keeps them otherwise is refused, and learns why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from regraft import Component, action, every, service
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadType
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import Image, LaserScan
from regraft.component.component import describe
from regraft.testing import Rig
from tests.kit.parts import Number

SCAN = LaserScan(0.0, "lidar", "base_link", Pose(), 0.0, 0.1, 0.12, 3.5, np.array([1.0], np.float32))


@message("kit_tests/Sweep")
@dataclass(frozen=True, slots=True)
class Sweep:
    """Holds arrays in what it holds."""

    scans: dict[str, LaserScan]


class Asked(Component):
    """Takes an array in a request."""

    @service("ask")
    def ask(self, request: LaserScan) -> Number:
        return Number(1)


class Answering(Component):
    """Answers by a large array."""

    @service("answer")
    def answer(self, request: Number) -> Image:
        raise NotImplementedError


class Nested(Component):
    """Has arrays in a part of its result."""

    @action("sweep")
    async def sweep(self, goal: Number) -> Sweep:
        return Sweep({})


class Feeding(Component):
    """Gives arrays as feedback."""

    @action("feed", feedback=LaserScan)
    async def feed(self, goal: Number) -> Number:
        return goal


@pytest.mark.parametrize(
    ("cls", "method", "held"),
    [
        (Asked, "ask", "LaserScan"),
        (Answering, "answer", "Image"),
        (Nested, "sweep", "Sweep"),
        (Feeding, "feed", "LaserScan"),
    ],
)
def test_a_service_or_action_with_an_array_is_refused_with_its_method(
    cls: type[Component], method: str, held: str
) -> None:
    with pytest.raises(BadType, match=rf"{cls.__name__}\.{method}: {held} holds an array"):
        describe(cls)


class Keeper(Component):
    """Keeps a state with an array in it."""

    def __init__(self) -> None:
        self.kept: Any = None

    @every(seconds=1.0)
    def keep(self) -> None:
        self.kit.checkpoint()

    def snapshot(self) -> Any:
        return {"kept": self.kept}


@pytest.mark.parametrize("kept", [SCAN.ranges, codec.to_plain(SCAN)], ids=["array", "message"])
def test_a_state_with_an_array_is_a_fault_where_it_is_taken(kept: Any) -> None:
    with Rig() as rig:
        keeper = rig.add(Keeper)
        keeper.kept = kept
        rig.advance(1.0)
        (fault,) = rig.take_faults()
        assert "must be plain data" in fault
        keeper.kept = [{"ranges": SCAN.ranges.tolist()}, SCAN.ranges.tobytes()]
        rig.advance(1.0)
