"""Lets a moment of a world pass before anything starts, to find what would fail."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.component.component import declared
from regraft.component.parameters import ParameterError
from regraft.sim_service.devices.core.calling import Calls, DeviceError
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.device_kit import DeviceParameters
from regraft.sim_service.devices.core.fitting import Fitted, place_of
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.simulation import Simulation, SimulationSettings


class _Input:
    """An input to which nothing has come."""

    latest = None


class _Output:
    """An output whose messages must fit its type, and go nowhere."""

    wanted = True

    def __init__(self, message: type) -> None:
        self._message = message

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
        ParameterError: a device fails; with its place in the list of robots.
        SceneError, PlacementError: see `Simulation`.
    """
    try:
        simulation = Simulation(scene, seed, settings, parameters=parameters)
        devices = [device for robot in simulation.robots.values() for device in robot.devices.values()]
        for device in devices:
            _connect_to_nothing(device)
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


def _refusal(scene: Scene, errors: Sequence[DeviceError]) -> ParameterError:
    return ParameterError([(place_of(scene.robots, error.robot, error.device), str(error)) for error in errors])


def _connect_to_nothing(device: Device) -> None:
    ports = declared(type(device))
    vars(device).update(dict.fromkeys(ports.inputs, _Input()))
    vars(device).update({name: _Output(port.message) for name, port in ports.outputs.items()})
