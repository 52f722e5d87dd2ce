"""Devices declare qualities as components do: the world has them under the names of robot and device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from regraft import Quality
from regraft.bus_schema.model.qualities.qualities import Better
from regraft.component.component import describe
from regraft.sim_service.devices.charger import Charger
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.services.rigs import run
from tests.support.worlds import FROG_WORLD, robots_as_data


class CountingCharger(Charger):
    """Counts how often it was asked, and gives a value that nobody has declared."""

    asked = Quality("questions", better="lower", minimum=0.0, estimated=False)

    def evaluate(self) -> dict[str, float]:
        """Return a count."""
        return {"asked": 1.0, "liked": 2.0}


class Scale(Device):
    """A device whose ``evaluate`` raises."""

    load = Quality("what lies on it", unit="kg", minimum=0.0, estimated=False)
    wear = Quality("of its springs", measured=False)

    def evaluate(self) -> dict[str, float]:
        """Raise."""
        raise RuntimeError("no springs")


class Mute(Device):
    """A device whose ``evaluate`` returns nothing, though it declares no quality."""

    def evaluate(self) -> dict[str, float]:
        """Return no map."""
        return None  # type: ignore[return-value]  # the wrong value that the test is about


def robots(name: str, *more: type[Device]) -> list[dict[str, Any]]:
    """Return a robot with the charger of this module, and ``more`` devices of it, by the names of their classes."""
    (robot,) = robots_as_data()
    devices = [
        each | {"class": f"{__name__}:CountingCharger"} if each["name"] == "charger" else each
        for each in robot["devices"]
    ]
    devices += [{"name": each.__name__.lower(), "class": f"{__name__}:{each.__name__}"} for each in more]
    return [{**robot, "name": name, "devices": devices, "place": {"x": -0.75, "y": -0.14}}]


def test_a_world_describes_the_qualities_of_its_robots_devices() -> None:
    described = describe(World, {**FROG_WORLD, "robots": robots("rescuer")})
    assert [quality.name for quality in described.qualities] == [
        "contacts",
        "rescuer/contacts",
        "rescuer/charger_asked",
    ]
    last = described.quality("rescuer/charger_asked")
    assert last is not None
    assert replace(last, description="") == replace(last, better=Better.LOWER, minimum=0.0, description="")


def test_a_world_measures_the_qualities_of_its_robots_devices(tmp_path: Path) -> None:
    with Rig(seed=1) as rig:
        published = rig.collect_qualities("world")
        world = rig.add(World, parameters={**FROG_WORLD, "robots": robots("")})
        run(rig, world, 1.1)
        assert published[-1].values == {"contacts": 0.0, "charger_asked": 1.0}
        (event,) = [event for event in rig.events if event.kind == "quality.unknown"]
        assert event.details["qualities"] == ["charger_liked"]


def test_a_device_whose_evaluate_raises_costs_no_other_device_its_qualities() -> None:
    with Rig(seed=1) as rig:
        published = rig.collect_qualities("world")
        world = rig.add(World, parameters={**FROG_WORLD, "robots": robots("", Scale, Mute)})
        run(rig, world, 2.1)
        measured = published[-1]
        events = [event for event in rig.events if event.kind == "quality.unknown"]
    assert measured.values == {"contacts": 0.0, "charger_asked": 1.0}
    assert measured.unknown.keys() == {"scale_load"}
    assert all(word in measured.unknown["scale_load"] for word in ("scale", "RuntimeError", "no springs"))
    named = sorted(name for event in events for name in event.details["qualities"])
    assert named == ["charger_liked", "mute", "scale_load"]
