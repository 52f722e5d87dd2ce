"""The README's first component does not drive without seeing."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

from regraft import Component
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.testing import Rig
from tests.support.paths import ROOT

README = (ROOT / "README.md").read_text()


@pytest.fixture
def timid(monkeypatch: pytest.MonkeyPatch) -> type[Component]:
    """Return the component of the README."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    module = ModuleType("readme_example")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(code, module.__dict__)
    kind: type[Component] = module.__dict__["Timid"]
    return kind


@pytest.fixture
def rig() -> Iterator[Rig]:
    """Give what stands for everything around a component."""
    with Rig() as made:
        yield made


def scan(stamp: float, nearest: float) -> LaserScan:
    """Return a scan with something at a distance (m)."""
    return LaserScan(stamp, "lidar", "base_link", Pose(), 0.0, 0.1, 0.12, 3.5, np.array([3.0, nearest], np.float32))


def speeds(told: list[Twist]) -> set[float]:
    """Return the speeds that were asked for, and forget them."""
    found = {twist.linear.x for twist in told}
    told.clear()
    return found


def test_the_example_stands_still_before_a_first_scan(timid: type[Component], rig: Rig) -> None:
    rig.add(timid)
    told = rig.collect("velocity", Twist)
    rig.advance(2.0)
    assert speeds(told) == {0.0}


def test_the_example_drives_by_fresh_scans_alone(timid: type[Component], rig: Rig) -> None:
    rig.add(timid)
    told = rig.collect("velocity", Twist)
    rig.publish("scan", scan(0.0, 2.0))
    rig.advance(0.3)
    assert speeds(told) == {0.2}
    rig.advance(1.0)
    speeds(told)
    rig.advance(1.0)
    assert speeds(told) == {0.0}


def test_the_example_stops_for_what_is_near(timid: type[Component], rig: Rig) -> None:
    rig.add(timid)
    told = rig.collect("velocity", Twist)
    rig.publish("scan", scan(0.0, 0.3))
    rig.advance(0.3)
    assert speeds(told) == {0.0}
