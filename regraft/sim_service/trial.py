"""Lets a moment of a world pass before anything starts, to find what would fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from regraft import Input, Output
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.description import Description
from regraft.component.future import Future
from regraft.component.live_ports import Inputs, Outputs
from regraft.component.parameters import ParameterError
from regraft.sim_service.devices.core.calling import Calls, DeviceError
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.device_kit import DeviceParameters
from regraft.sim_service.devices.core.fitting import Fitted, fitted, place_of
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.simulation import Simulation, SimulationSettings
from regraft.stack.files import file_problems


class _Input:
    """An input to which nothing has come."""

    latest = envelope = stamp = None

    def __init__(self, name: str, declared: Input[Any]) -> None:
        self.name, self.key = name, ""
        self._keep = declared.keep

    def opener(self) -> None:
        """Return None: there is no message to open."""

    def take(self) -> list[Any]:
        """Return no messages; raises TypeError without ``keep``."""
        if not self._keep:
            raise TypeError(f"the input {self.name!r} keeps nothing to take: declare it with keep=N")
        return []

    def next(self) -> Future[Any]:
        """Return the future of a message that never comes."""
        return Future()


class _Output:
    """An output whose messages must fit its type, and go nowhere."""

    wanted = True

    def __init__(self, name: str, declared: Output[Any]) -> None:
        self.name, self.key = name, ""
        self._message = declared.message

    def publish(self, message: object) -> None:
        """Encode a message."""
        if not isinstance(message, self._message):
            raise TypeError(f"publishes {type(message).__name__}, must be {self._message.__name__}")
        codec.encode(message)

    def publish_deferred(self, make: Callable[[], Any]) -> None:
        """Encode a message that is made when it is needed."""
        self.publish(make())


def try_world(
    scene: Scene, seed: int, settings: SimulationSettings, parameters: Callable[[Fitted], DeviceParameters]
) -> None:
    """Build a world with its devices, let a tick pass, and restore it from a snapshot.

    ``parameters`` gives the parameters of each device.

    Raises:
        ParameterError: a device fails, or a file that it names is missing; with its place in the list of robots.
        SceneError, PlacementError: see `Simulation`.
    """
    fits = fitted(scene.robots)
    missing = [problem for fit in fits for problem in _missing_files(fit, parameters(fit))]
    if missing:
        raise ParameterError(missing)
    try:
        simulation = Simulation(scene, seed, settings, parameters=parameters)
        devices: list[Device] = []
        for fit in fits:
            device = simulation.robot(fit.robot.name).devices[fit.spec.name]
            _connect_to_nothing(device, fit)
            devices.append(device)
        calls = Calls()
        simulation.advance(settings.tick, calls)
        simulation.progress.steps = 0  # at the tick 0 all sensors are due, at any rates
        for device in devices:
            for method in (device.sense, device.truth, device.evaluate):
                calls.call(device, method)
        simulation.render_state(calls)
        if calls.errors:
            raise _refusal(scene, calls.errors)
        simulation.restore(simulation.snapshot())
    except DeviceError as error:
        raise _refusal(scene, [error]) from error


def _missing_files(fit: Fitted, parameters: DeviceParameters) -> Iterator[tuple[str, str]]:
    described = tuple(parameter.describe() for parameter in fit.declared.parameters.values())
    for short, problem in file_problems(Description(fit.spec.cls, "", parameters=described), parameters.values):
        yield f"{fit.place}.parameters.{short}", problem


def _refusal(scene: Scene, errors: Sequence[DeviceError]) -> ParameterError:
    return ParameterError([(place_of(scene.robots, error.robot, error.device), str(error)) for error in errors])


def _connect_to_nothing(device: Device, fit: Fitted) -> None:
    # Their types are checked here: a port that lacks a part would refuse sound devices.
    inputs: Inputs = {short: _Input(fit.port(short), port) for short, port in fit.declared.inputs.items()}
    outputs: Outputs = {short: _Output(fit.port(short), port) for short, port in fit.declared.outputs.items()}
    vars(device).update(inputs)
    vars(device).update(outputs)
