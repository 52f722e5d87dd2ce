"""The planners of the system, by what they offer."""

from __future__ import annotations

from collections.abc import Mapping

from regraft.bus_schema.model.robots.planners import planners_with
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.overview import view_of


def planners(manager: Manager, verb: str, robot: str = "") -> Mapping[str, str]:
    """Return the components that offer a planner's service, all or a robot's, by planner; raises Problem."""
    architecture = manager.last_architecture() or manager.architecture()
    is_meant = view_of(robot, architecture).has_component
    return planners_with(verb, {name: spec for name, spec in architecture.components.items() if is_meant(name)})
