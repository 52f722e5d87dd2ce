"""Connects the devices of a simulation with the world component: parameters, ports, events and failures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from regraft.bus_schema.model.qualities.qualities import measured
from regraft.bus_schema.suggestions import instead_of
from regraft.component.kit import Kit
from regraft.component.parameters import ParameterError
from regraft.sim_service.devices.core.calling import Calls, DeviceError, call
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.device_kit import DeviceParameters
from regraft.sim_service.devices.core.failure_schedule import NONE, DeviceFails, Schedule
from regraft.sim_service.devices.core.fitting import Fitted, fitted
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.simulation import Simulation

FAILURE = "failure"
"""The parameter of a device for how it fails."""


class _Renamed(Mapping[str, Any]):
    """The world's current values of one device's parameters, by the device's own names."""

    def __init__(self, kit: Kit, device: Fitted) -> None:
        self._parameters = kit.parameters
        self._names = {short: device.parameter(short) for short in device.declared.parameters}

    def __getitem__(self, short: str) -> Any:
        return self._parameters.values[self._names[short]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def check_failures(robots: Sequence[RobotSpec], failures: Sequence[DeviceFails]) -> None:
    """Check that devices can fail as a schedule states; raises ParameterError with everything that is wrong."""
    kinds = _kinds(fitted(robots))
    problems: list[tuple[str, str]] = []
    for index, fails in enumerate(failures):
        known = kinds.get(fails.device)
        if known is None:
            why = f"there is no device {fails.device!r} that can fail; {instead_of(fails.device, kinds)}"
            problems.append((f"failures.{index}.device", why))
        elif fails.failure not in known:
            why = f"{fails.failure!r}: {fails.device} can fail as one of: {', '.join(known)}"
            problems.append((f"failures.{index}.failure", why))
    if problems:
        raise ParameterError(problems)


def _kinds(devices: Sequence[Fitted]) -> dict[str, tuple[str, ...]]:
    """Return the ways to fail of each device that has any, by its name in the world."""
    return {
        device.robot.prefix + device.spec.name: device.declared.parameters[FAILURE].choices
        for device in devices
        if FAILURE in device.declared.parameters
    }


class DeviceWiring:
    """The devices of all robots, as the world component handles them.

    Raises:
        ParameterError: the robots' devices do not fit their classes.
    """

    def __init__(self, kit: Kit, robots: Sequence[RobotSpec], failures: Sequence[DeviceFails]) -> None:
        self._kit = kit
        self._fitted = fitted(robots)
        kinds = _kinds(self._fitted)
        self._schedules = {name: Schedule([fails for fails in failures if fails.device == name]) for name in kinds}
        self._reported = dict.fromkeys(kinds, NONE)
        """How each device failed when that was reported last."""
        self._devices: dict[str, Device] = {}
        self._handlers: dict[str, list[tuple[Device, Callable[[Any], object]]]] = {}

    def parameters(self, device: Fitted) -> DeviceParameters:
        """Return a device's parameters, which are the world's."""
        return DeviceParameters(_Renamed(self._kit, device))

    def connect(self, simulation: Simulation) -> None:
        """Give the devices of a simulation their live ports, a way to report events, and how they fail now."""
        self._handlers.clear()
        for fit in self._fitted:
            device = simulation.robot(fit.robot.name).devices[fit.spec.name]
            device.kit.event = self._kit.event
            own = fit.robot.prefix + fit.spec.name
            self._devices[own] = device
            if own in self._reported:
                # Messages may come before the first tick, and find the device as it is.
                device.kit.failing = self._failure(own, self._kit.now())
            for short in fit.declared.outputs:
                vars(device)[short] = self._kit.outputs[fit.port(short)]
            for short, port in fit.declared.inputs.items():
                name = fit.port(short)
                vars(device)[short] = self._kit.inputs[name]
                if port.handler_name is not None:
                    self._handlers.setdefault(name, []).append((device, getattr(device, port.handler_name)))

    def handle(self, port: str, message: object) -> None:
        """Have each device that reads a port handle a message; raises what devices raised, once all have it."""
        calls = Calls()
        for device, handle in self._handlers.get(port, ()):
            calls.call(device, partial(handle, message))
        calls.raise_all()

    def fail(self, now: float) -> None:
        """Let the devices fail by parameters and schedule at this moment (s)."""
        for name, reported in self._reported.items():
            failure = self._devices[name].kit.failing = self._failure(name, now)
            if failure != reported:
                self._reported[name] = failure
                self._kit.event("world.failure", f"{name}: {failure}", sensor=name, failure=failure)

    def _failure(self, name: str, now: float) -> str:
        asked: str = self._devices[name].kit.parameters.values[FAILURE]
        return asked if asked != NONE else self._schedules[name].at(now)

    def evaluate(self) -> tuple[dict[str, float], dict[str, Exception]]:
        """Return what qualities the devices give, and what was raised instead of others, by the world's names.

        A device that measures none has its own name for what it raises.
        """
        given: dict[str, float] = {}
        errors: dict[str, Exception] = {}
        for fit in self._fitted:
            own = fit.robot.prefix + fit.spec.name
            device = self._devices[own]
            try:
                values = call(device, _evaluated, device)
            except DeviceError as error:
                described = measured(quality.describe() for quality in fit.declared.qualities.values())
                errors |= dict.fromkeys([fit.parameter(quality.name) for quality in described] or [own], error)
            else:
                given |= {fit.parameter(short): value for short, value in values.items()}
        return given, errors

    def snapshot(self) -> dict[str, str]:
        """Return how each device failed when that was reported last."""
        return dict(self._reported)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what was reported: it is not reported again."""
        self._reported |= {name: str(state[name]) for name in self._reported if name in state}


def _evaluated(device: Device) -> dict[str, float]:
    # A result that is no map raises here, so that its device is named.
    return dict(device.evaluate())
