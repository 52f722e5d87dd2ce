"""The meaning of names that one robot among several uses, also in the changes that its mission asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from regraft.bus_schema.annotations import Connections
from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    Connect,
    EnterMode,
    Remove,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.robots.scopes import component_in_scope, in_scope
from regraft.bus_schema.model.watched import Condition


@dataclass(frozen=True, slots=True)
class Names:
    """The meaning, in the whole system, of names that are used in a scope."""

    scope: str = ""

    def component(self, name: str) -> str:
        """Return a component's name."""
        return component_in_scope(self.scope, name)

    def topic(self, name: str) -> str:
        """Return the name of a topic, service or mode."""
        return in_scope(self.scope, name)

    def change(self, change: Change) -> Change:
        """Return a change with all its names.

        >>> Names("rescuer").change(Connect("detector", "image", "/corner_camera/image"))
        Connect(component='rescuer.detector', port='image', topic='corner_camera/image')
        """
        if isinstance(change, EnterMode):
            return replace(change, mode=self.topic(change.mode))
        component = self.component(change.component)
        if isinstance(change, Connect):
            return replace(change, component=component, topic=self._topic(change.topic))
        if isinstance(change, Swap):
            connections, services = self._connections(change.connections), self._services(change.services)
            return replace(change, component=component, connections=connections, services=services)
        if isinstance(change, Remove):
            return replace(change, component=component, topics=tuple(map(self.topic, change.topics)))
        if isinstance(change, Add):
            topics = tuple(replace(topic, name=self.topic(topic.name)) for topic in change.topics)
            return replace(change, component=component, spec=self._spec(change.spec), topics=topics)
        return replace(change, component=component)

    def condition(self, condition: Condition) -> Condition:
        """Return a condition with the names of its components; a requirement's name is the mission's own.

        >>> Names("rescuer").condition(Condition(require="camera.rate < 3.0")).require
        'rescuer.camera.rate < 3.0'
        """
        if condition.require:
            return replace(condition, require=Expression(condition.require).renamed(self.component))
        if condition.quality:
            return replace(condition, quality=self.component(condition.quality))
        return replace(condition, component=self.component(condition.component)) if condition.component else condition

    def _spec(self, spec: ComponentSpec) -> ComponentSpec:
        return replace(
            spec,
            name=self.component(spec.name) if spec.name else "",
            connections=self._connections(spec.connections),
            services=self._services(spec.services),
        )

    def _topic(self, name: str | None) -> str | None:
        return None if name is None else self.topic(name)

    def _connections(self, topics: Mapping[str, str | None]) -> Connections:
        return {port: self._topic(name) for port, name in topics.items()}

    def _services(self, names: Mapping[str, str]) -> dict[str, str]:
        return {key: self.topic(name) for key, name in names.items()}
