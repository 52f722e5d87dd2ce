"""Turns the robots of a stack into what the stack runs of them, and the list that worlds take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from regraft.bus_schema.suggestions import instead_of
from regraft.stack.assembly.included_files import IncludedFiles
from regraft.stack.assembly.references import NEVER_PARAMETERS, REFERENCE, ROBOT, References
from regraft.stack.assembly.robots import PLACE, Use
from regraft.stack.sections.components import RUN_FOLDER
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.problems import Report

MAPS = ("parameters", "devices", "topics", "components", "modes")
OF_DEVICES = ("class", "settings")
OF_WORLDS = ("parameters", "model", PLACE, "devices")
"""The fields that a stack does not have: the list of the robots has them."""


@dataclass(slots=True)
class Robot:
    """One use of a robot, with ``references`` that know its parameters."""

    use: Use
    references: References
    report: Report

    def for_worlds(self, files: IncludedFiles) -> Node:
        """Return the robot as worlds take it: ``{name, model, place, devices: [{name, class, settings}]}``."""
        fields = {key: self._resolved(key) for key in OF_WORLDS if key in self.use.fields}
        found = {"name": Node(self.use.name, self.use.location), "model": self._model(fields.get("model"), files)}
        place = fields.get(PLACE)
        if place is not None:
            if not isinstance(place.value, dict):
                self._wrong(place, PLACE, f"must be a map such as {{x: 0.5, y: 0.0}}, is {place.kind}")
            found[PLACE] = place
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
            self._wrong(node, f"devices.{name}", f"must be a map with 'class' and 'settings', is {node.kind}")
        elif "class" not in fields:
            self._wrong(node, f"devices.{name}", "has no 'class': must name one as module:Class")
        for key, part in fields.items():
            if key not in OF_DEVICES:
                hint = instead_of(key, OF_DEVICES)
                self._wrong(part, f"devices.{name}.{key}", f"there is no such field; {hint}")
        cls, settings = fields.get("class"), fields.get("settings")
        if cls is not None and not (isinstance(cls.value, str) and cls.value):
            self._wrong(cls, f"devices.{name}.class", f"must be a text, is {cls.kind}")
        if settings is not None and not isinstance(settings.value, dict):
            self._wrong(settings, f"devices.{name}.settings", f"must be a map, is {settings.kind}")
        usual = {"class": Node("", node.location), "settings": Node({}, node.location)}
        return Node({"name": Node(name, node.location), **usual, **fields}, node.location)


def robot_of(use: Use, known: Mapping[str, Node], report: Report) -> Robot:
    """Return a robot with its parameters as references; what is no robot is noted."""
    for field in MAPS:
        node = use.fields.get(field)
        if node is not None and not isinstance(node.value, dict):
            report.add_at(node.location, f"{use.path}.{field}", f"must be a map, is {node.kind}")
    constraints = use.fields.get("constraints")
    if constraints is not None and not isinstance(constraints.value, tuple):
        report.add_at(constraints.location, f"{use.path}.constraints", f"must be a list, is {constraints.kind}")
    parameters = use.fields.get("parameters")
    given = parameters.value if parameters and isinstance(parameters.value, dict) else {}
    for name, node in given.items():
        if name in NEVER_PARAMETERS or f"${name}".startswith(RUN_FOLDER) or not REFERENCE.fullmatch(f"${name}"):
            problem = f"cannot name a parameter of a robot: ${name} must be a reference of its own"
            report.add_at(node.location, f"{use.path}.parameters.{name}", f"{name!r} {problem}")
    own = {ROBOT: Node(use.name, use.location)}
    return Robot(use, References(report, {**known, **own}, given, use.path), report)
