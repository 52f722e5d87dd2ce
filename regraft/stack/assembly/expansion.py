"""Turns the robots of a stack into what the stack runs of them, and the list that worlds take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from regraft.bus_schema.suggestions import instead_of
from regraft.stack.assembly.included_files import IncludedFiles
from regraft.stack.assembly.references import NEVER_PARAMETERS, REFERENCE, ROBOT, References
from regraft.stack.assembly.robots import PASSED_ON, PLACES, Use
from regraft.stack.relative_paths import RUN_FOLDER
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.problems import Report

MAPS = ("parameters", "devices", "topics", "components", "rules")
OF_DEVICES = ("class", "parameters", "connect")
OF_WORLDS = ("parameters", "model", *PASSED_ON, *PLACES, "devices")
"""The fields that a stack does not have: the list of the robots has them."""


@dataclass(frozen=True, slots=True)
class RobotData:
    """The parameters of a robot as a stack uses it; ``path`` is where the stack has them, ``location`` their file."""

    path: str
    location: Location
    parameters: dict[str, Node]

    def lacks(self, datum: str) -> str:
        """Return what is wrong where a class takes a parameter that the robot does not have."""
        hint = instead_of(datum, self.parameters)
        add = f"add it to {self.path}, or set it here"
        return f"comes from the robot, which has no parameter {datum!r}: {add}; {hint}"


@dataclass(slots=True)
class Robot:
    """One use of a robot, with ``references`` that know its parameters."""

    use: Use
    references: References
    report: Report
    _parameters: dict[str, Node] = field(default_factory=dict)

    @property
    def data(self) -> RobotData:
        """Its parameters, once the list for worlds is made."""
        return RobotData(f"{self.use.path}.parameters", self.use.whole, self._parameters)

    def for_worlds(self, files: IncludedFiles) -> Node:
        """Return the robot as worlds take it: a record with name, model, place and devices."""
        fields = {key: self._resolved(key) for key in OF_WORLDS if key in self.use.fields}
        parameters = fields.get("parameters")
        self._parameters = parameters.value if parameters and isinstance(parameters.value, dict) else {}
        found = {"name": Node(self.use.name, self.use.location), "model": self._model(fields.get("model"), files)}
        found |= {key: fields[key] for key in (*PASSED_ON, *PLACES) if key in fields}
        for key in PLACES:
            if key in found and not isinstance(found[key].value, dict):
                self._wrong(found[key], key, f"must be a map with x and y, is {found[key].kind}")
        devices = fields.get("devices")
        named = devices.value if devices and isinstance(devices.value, dict) else {}
        items = tuple(self._device(name, device) for name, device in named.items())
        found["devices"] = Node(items, devices.location if devices else self.use.whole)
        return Node(found, self.use.location)

    def for_stack(self) -> dict[str, Node]:
        """Return the fields that a stack has too."""
        return {key: self._resolved(key) for key in self.use.fields if key not in OF_WORLDS}

    def _resolved(self, field: str) -> Node:
        return self.references.resolved(self.use.fields[field], field)

    def _wrong(self, node: Node, path: str, problem: str) -> None:
        self.report.add_at(node.location, f"{self.use.path}.{path}", problem)

    def _model(self, node: Node | None, files: IncludedFiles) -> Node:
        if node is None:
            problem = "has no 'model': must name the robot's MJCF file"
            self.report.add_at(self.use.whole, self.use.path, problem)
            return Node("", self.use.whole)
        file = files.target(node, f"{self.use.path}.model")
        return Node(str(file.absolute()) if file else "", node.location)

    def _device(self, name: str, node: Node) -> Node:
        fields = node.value if isinstance(node.value, dict) else {}
        if not isinstance(node.value, dict):
            self._wrong(node, f"devices.{name}", f"must be a map with 'class' and 'parameters', is {node.kind}")
        elif "class" not in fields:
            self._wrong(node, f"devices.{name}", "has no 'class': must name one as module:Class")
        for key, part in fields.items():
            if key not in OF_DEVICES:
                hint = instead_of(key, OF_DEVICES)
                self._wrong(part, f"devices.{name}.{key}", f"there is no such field; {hint}")
        cls = fields.get("class")
        if cls is not None and not (isinstance(cls.value, str) and cls.value):
            self._wrong(cls, f"devices.{name}.class", f"must be a text, is {cls.kind}")
        for key in ("parameters", "connect"):
            given = fields.get(key)
            if given is not None and not isinstance(given.value, dict):
                self._wrong(given, f"devices.{name}.{key}", f"must be a map, is {given.kind}")
        usual = {"class": Node("", node.location), "parameters": Node({}, node.location)}
        return Node({"name": Node(name, node.location), **usual, **fields}, node.location)


def robot_of(use: Use, known: Mapping[str, Node], report: Report) -> Robot:
    """Return a robot with its parameters as references; what is no robot is noted."""
    for key in MAPS:
        node = use.fields.get(key)
        if node is not None and not isinstance(node.value, dict):
            report.add_at(node.location, f"{use.path}.{key}", f"must be a map, is {node.kind}")
    modes = use.fields.get("modes")
    if modes is not None and not isinstance(modes.value, dict | str):
        problem = f"must be a map, or a file of system_modes, is {modes.kind}"
        report.add_at(modes.location, f"{use.path}.modes", problem)
    constraints = use.fields.get("constraints")
    if constraints is not None and not isinstance(constraints.value, tuple):
        report.add_at(constraints.location, f"{use.path}.constraints", f"must be a list, is {constraints.kind}")
    parameters = use.fields.get("parameters")
    given = parameters.value if parameters and isinstance(parameters.value, dict) else {}
    for name, node in given.items():
        if name in NEVER_PARAMETERS or f"${name}" == RUN_FOLDER or not REFERENCE.fullmatch(f"${name}"):
            problem = f"cannot name a parameter of a robot: ${name} must be a reference of its own"
            report.add_at(node.location, f"{use.path}.parameters.{name}", f"{name!r} {problem}")
    own = {ROBOT: Node(use.name, use.location)}
    return Robot(use, References(report, {**known, **own}, given, use.path), report)
