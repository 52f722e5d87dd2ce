"""A manager that takes over compares the architecture with what the components run: a difference is reported."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from regraft.adaptation_manager.execution.restoration import values_of
from regraft.adaptation_manager.execution.verify import differences
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.architecture import Architecture


def tell_differences(
    architecture: Architecture, views: Mapping[str, ComponentView], tell: Callable[[str, str], object]
) -> None:
    """Make an event for every component whose values or connections are not those of the architecture.

    Nothing is set: the readers of the events decide what to do.
    """
    scopes = architecture.scopes
    for name, view in views.items():
        spec = architecture.components.get(name)
        wrong = differences(view, values_of(spec, scopes)) if spec is not None else []
        if wrong:
            text = f"{'; '.join(wrong)} (revision {architecture.revision}): set it again, or restart the component"
            tell("architecture.differs", text)
