"""The planners of the system, by what they offer."""

from __future__ import annotations

from collections.abc import Mapping

from regraft.bus_schema.model.robots.planners import planners_with
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.overview import view_of


def planners(manager: Manager, verb: str, robot: str = "", *, current: bool = False) -> Mapping[str, str]:
    """Return the components that offer a planner's service, all or a robot's, by planner; raises Problem.

    They may be a second old, unless they have to be ``current``: an acting route refuses none that was just added.
    """
    kept = None if current else manager.last_architecture()
    architecture = kept or manager.architecture()
    is_meant = view_of(robot, architecture).has_component
    return planners_with(verb, {name: spec for name, spec in architecture.components.items() if is_meant(name)})
