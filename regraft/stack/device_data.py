"""Gives the devices of robots what their classes take from their robot, and absolute paths."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

from regraft.bus_schema.model.description import PATH
from regraft.bus_schema.model.robots.robot_view import ROBOTS
from regraft.stack.assembly.expansion import RobotData
from regraft.stack.classes import parameters_at
from regraft.stack.relative_paths import is_relative
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.problems import Report


@dataclass(slots=True)
class DeviceData:
    """Completes the robots among the parameters of worlds, and of all else that takes them.

    ``robots`` have the parameters of robots, by name. ``stated`` are the parameters that components have: a world's may
    be those of a device. Modules that are ``refused`` are not imported.
    """

    robots: Mapping[str, RobotData]
    stated: Collection[str]
    report: Report
    refused: Collection[str]
    _noted: set[str] = field(default_factory=set)

    def completed(self, component: str, node: Node) -> Node:
        """Return a component whose robots have devices with all parameters that robots give; one that lacks is noted.

        Relative paths are looked for from the folders of the files that have them.
        """
        fields = _map(node)
        given = _map(fields.get("parameters"))
        listed = given.get(ROBOTS)
        if listed is None or not isinstance(listed.value, tuple):
            return node
        place = f"components.{component}.parameters.{ROBOTS}"
        robots = tuple(self._robot(robot, f"{place}.{index}") for index, robot in enumerate(listed.value))
        parameters = Node(given | {ROBOTS: Node(robots, listed.location)}, fields["parameters"].location)
        return Node(fields | {"parameters": parameters}, node.location)

    def _robot(self, node: Node, place: str) -> Node:
        fields = _map(node)
        devices = fields.get("devices")
        if devices is None or not isinstance(devices.value, tuple):
            return node
        name = _text(fields.get("name"))
        items = (self._device(name, item, f"{place}.devices.{index}") for index, item in enumerate(devices.value))
        return Node(fields | {"devices": Node(tuple(items), devices.location)}, node.location)

    def _device(self, robot: str, node: Node, place: str) -> Node:
        fields = _map(node)
        path = _text(fields.get("class"))
        given = fields.get("parameters", Node({}, node.location))
        if path.partition(":")[0] in self.refused or not isinstance(given.value, dict):
            return node
        values = dict(given.value)
        for name, parameter in parameters_at(path).items():
            if parameter.from_robot and robot in self.robots and name not in values:
                in_world = f"{robot}/{_text(fields.get('name'))}_{name}".removeprefix("/")
                self._take(in_world, parameter.from_robot, self.robots[robot], values, f"{place}.parameters.{name}")
            value = values.get(name)
            if value is not None and parameter.describe().unit == PATH and is_relative(value.value):
                values[name] = Node(str(value.location.folder / str(value.value)), value.location)
        return Node(fields | {"parameters": Node(values, given.location)}, node.location)

    def _take(self, in_world: str, datum: str, data: RobotData, values: dict[str, Node], place: str) -> None:
        """Add the robot's parameter to the values of a device; several components take the same robots."""
        if datum in data.parameters:
            values[place.rpartition(".")[2]] = data.parameters[datum]
        elif in_world not in self.stated and in_world not in self._noted:
            self._noted.add(in_world)
            self.report.add_at(data.location, place, data.lacks(datum))


def stated_parameters(components: Iterable[Node]) -> frozenset[str]:
    """Return the names of all parameters that a stack gives its components."""
    return frozenset(name for node in components for name in _map(_map(node).get("parameters")))


def _text(node: Node | None) -> str:
    return node.value if node is not None and isinstance(node.value, str) else ""


def _map(node: Node | None) -> dict[str, Node]:
    return node.value if node is not None and isinstance(node.value, dict) else {}
