"""Connects the devices of a simulation with the world component: parameters, ports, events and failures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from regraft.component.kit import Kit
from regraft.sim_service.devices.device import Device
from regraft.sim_service.devices.device_kit import DeviceParameters
from regraft.sim_service.devices.failures import NONE, parse_schedule
from regraft.sim_service.devices.fitting import Fitted, fitted
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.simulation import Simulation

FAILURE = "failure"
"""The parameter of a device that says how it fails."""


class _Renamed(Mapping[str, Any]):
    """The world's current values of one device's parameters, by the device's own names."""

    def __init__(self, kit: Kit, device: Fitted) -> None:
        self._kit = kit
        self._names = {short: device.parameter(short) for short in device.declared.parameters}

    def __getitem__(self, short: str) -> Any:
        return self._kit.parameters.values[self._names[short]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class DeviceWiring:
    """The devices of all robots, as the world component handles them.

    Raises:
        ParameterError: the robots' devices do not fit their classes.
        ScheduleError: the schedule of failures cannot be read, or names what there is not.
    """

    def __init__(self, kit: Kit, robots: Sequence[RobotSpec], failures: str) -> None:
        self._kit = kit
        self._fitted = fitted(robots)
        kinds = {
            device.robot.prefix + device.spec.name: device.declared.parameters[FAILURE].choices
            for device in self._fitted
            if FAILURE in device.declared.parameters
        }
        self._schedule = parse_schedule(failures, kinds)
        self._failing = dict.fromkeys(kinds, NONE)
        self._devices: dict[str, Device] = {}
        self._handlers: dict[str, list[Callable[[Any], object]]] = {}

    def parameters(self, device: Fitted) -> DeviceParameters:
        """Return a device's parameters, which are the world's."""
        return DeviceParameters(_Renamed(self._kit, device))

    def connect(self, simulation: Simulation) -> None:
        """Give the devices of a simulation their live ports, and a way to report events."""
        self._handlers.clear()
        for fit in self._fitted:
            device = simulation.robot(fit.robot.name).devices[fit.spec.name]
            device.kit.event = self._kit.event
            own = fit.robot.prefix + fit.spec.name
            device.kit.failing = self._failing.get(own, NONE)
            self._devices[own] = device
            for short in fit.declared.outputs:
                vars(device)[short] = self._kit.outputs[fit.port(short)]
            for short, port in fit.declared.inputs.items():
                name = fit.port(short)
                vars(device)[short] = self._kit.inputs[name]
                if port.handler_name is not None:
                    self._handlers.setdefault(name, []).append(getattr(device, port.handler_name))

    def handle(self, port: str, message: object) -> None:
        """Have the devices that read a port handle a message."""
        for handle in self._handlers.get(port, ()):
            handle(message)

    def fail(self, now: float) -> None:
        """Let the devices fail as parameters and schedule say for this moment (s)."""
        for name, failing in self._failing.items():
            device = self._devices[name]
            asked = device.kit.parameters.values[FAILURE]
            failure = asked if asked != NONE else self._schedule.at(name, now)
            if failure != failing:
                self._failing[name] = device.kit.failing = failure
                self._kit.event("world.failure", f"{name}: {failure}", sensor=name, failure=failure)
