"""Gives the components and devices of a stack what their classes take from their robot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from regraft.stack.assembly.expansion import RobotData
from regraft.stack.classes import taken_from_robot
from regraft.stack.device_data import DeviceData, stated_parameters
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.problems import Report


def with_robot_data(
    document: Node, robots: Mapping[str, RobotData], report: Report, refused: Collection[str] = ()
) -> Node:
    """Return a stack's document in which components and devices have the parameters that their robots give.

    A component `rescuer.navigator` is of the robot `rescuer`; one without a scope is of the single robot. A value that
    the stack has stays. A robot that lacks one is noted. Modules that are ``refused`` are not imported.
    """
    assert isinstance(document.value, dict)
    components = document.value.get("components")
    if components is None or not isinstance(components.value, dict):
        return document
    devices = DeviceData(robots, stated_parameters(components.value.values()), report, refused)
    completed = {name: devices.completed(name, node) for name, node in components.value.items()}
    given = dict(_completed(completed, robots, report, refused))
    return Node(document.value | {"components": Node(given, components.location)}, document.location)


def _completed(
    components: Mapping[str, Node], robots: Mapping[str, RobotData], report: Report, refused: Collection[str]
) -> Iterator[tuple[str, Node]]:
    for name, node in components.items():
        robot = robots.get(name.rpartition(".")[0])
        cls = node.value.get("class") if isinstance(node.value, dict) else None
        path = cls.value if cls is not None and isinstance(cls.value, str) else ""
        if robot is None or not path or path.partition(":")[0] in refused:
            yield name, node
        else:
            yield name, _with_values(name, node, robot, taken_from_robot(path), report)


def _with_values(component: str, node: Node, robot: RobotData, taken: Mapping[str, str], report: Report) -> Node:
    assert isinstance(node.value, dict)
    parameters = node.value.get("parameters", Node({}, node.location))
    if parameters.value is None:
        parameters = Node({}, parameters.location)
    if not isinstance(parameters.value, dict):
        return node
    found: dict[str, Node] = {}
    for name, datum in taken.items():
        if name in parameters.value:
            continue
        if datum in robot.parameters:
            found[name] = robot.parameters[datum]
        else:
            report.add_at(robot.location, f"components.{component}.parameters.{name}", robot.lacks(datum))
    if not found:
        return node
    completed = Node(found | parameters.value, parameters.location)
    return Node(node.value | {"parameters": completed}, node.location)
