"""Which services a component offers."""

from __future__ import annotations

from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.scopes import service_in_scope


def offered_services(spec: ComponentSpec) -> dict[str, str]:
    """Return the services that a component offers, each with the name that it is offered under."""
    described = spec.description.services if spec.description else ()
    return {offered.name: service_in_scope(spec.name, "", offered.name) for offered in described} | spec.services
