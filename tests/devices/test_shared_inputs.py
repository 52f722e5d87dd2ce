"""Devices of one robot that read the same topic get of it what each declares."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from regraft import Input
from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.messages.power import BatteryState
from regraft.component.component import describe
from regraft.component.parameters import ParameterError
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.world import World
from regraft.testing import Rig

WORLD = '<mujoco><worldbody><body name="base"><geom size=".1"/></body></worldbody></mujoco>'
ORDERS = pytest.mark.parametrize("order", [("Glance", "Counter"), ("Counter", "Glance")])


class Glance(Device):
    """Looks at the newest message, if there is one."""

    battery = Input(BatteryState, latest_only=True, required=False)


class Fetch(Device):
    """Opens one message now and then."""

    battery = Input(BatteryState, latest_only=True, on_demand=True, required=False)


class Counter(Device):
    """Counts all messages, and takes the last ten."""

    battery = Input(BatteryState, keep=10)

    def build(self) -> None:
        """Count from none."""
        self.charges: list[float] = []

    @battery.handler
    def count(self, state: BatteryState) -> None:
        """Note a message."""
        self.charges.append(state.charge)


class Charge(Device):
    """Reads the charge of whatever comes."""

    battery: Input[Any] = Input(None, required=False, reads=(Reading("charge"),))


class Stamp(Device):
    """Reads the stamp of whatever comes."""

    battery: Input[Any] = Input(None, required=False, reads=(Reading("stamp"),))


def world(folder: Path, *classes: str) -> dict[str, Any]:
    """Return the parameters of a world whose robot has devices of these classes of this file."""
    (file := folder / "world.xml").write_text(WORLD)
    devices = [
        {"name": f"{name.lower()}{number}", "class": f"{__name__}:{name}"} for number, name in enumerate(classes)
    ]
    return {"file": str(file), "robots": [{"devices": devices}]}


@ORDERS
def test_an_input_is_required_if_any_device_requires_it_and_the_problem_is_with_that_one(
    tmp_path: Path, order: tuple[str, str]
) -> None:
    port = describe(World, world(tmp_path, *order)).port("battery")
    assert port is not None
    assert (port.required, port.latest_only) == (True, False)
    assert port.origin == f"robots.0.devices.{order.index('Counter')}"


@ORDERS
def test_a_device_that_handles_and_takes_gets_every_message(tmp_path: Path, order: tuple[str, str]) -> None:
    charges, name = [0.9, 0.8, 0.7], f"counter{order.index('Counter')}"
    with Rig(seed=1) as rig:
        found = rig.add(World, parameters=world(tmp_path, *order)).simulation.robot("").device(name, Counter)
        for charge in charges:
            rig.publish("battery", BatteryState(0.0, 1.0, 1.0, charge, 7.0))
        rig.settle()
        assert [state.charge for state in found.battery.take()] == found.charges == charges


def test_an_input_is_read_on_demand_if_all_devices_read_it_so(tmp_path: Path) -> None:
    def ports(*classes: str) -> list[bool]:
        robots = World.robots.checked(world(tmp_path, *classes)["robots"])
        given = {"robots": robots, "people": (), "crowds": (), "failures": ()}
        return [port.on_demand for port in World.ports_for(given) if isinstance(port, Input)]

    assert ports("Fetch") == [True]
    assert ports("Fetch", "Glance") == ports("Fetch", "Counter") == [False]


def test_what_devices_read_in_messages_of_any_type_has_to_be_there_for_all(tmp_path: Path) -> None:
    port = describe(World, world(tmp_path, "Charge", "Stamp")).port("battery")
    assert port is not None
    assert [reading.field for reading in port.reads] == ["charge", "stamp"]


def test_a_second_device_that_takes_messages_is_refused(tmp_path: Path) -> None:
    refused = r"devices\.1.*'counter0' takes the messages of the port 'battery'.*handle"
    with pytest.raises(ParameterError, match=refused):
        describe(World, world(tmp_path, "Counter", "Counter"))
