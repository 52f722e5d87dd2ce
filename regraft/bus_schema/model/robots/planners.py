"""Planners by name: each is asked by two services, in the scope of its component."""

from __future__ import annotations

import re
from collections.abc import Mapping

from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.robots.scopes import in_scope

PROPOSE, DESCRIBE = "propose", "describe"
"""The services of a planner."""
_OFFER = re.compile(r"(?:([^/]+)/)?planners/([^/]+)/(.+)")


def planner_service(planner: str, verb: str) -> str:
    """Return the name under which a planner offers one of its services.

    >>> planner_service("bandits", PROPOSE), planner_service("rescuer.bandits", DESCRIBE)
    ('planners/bandits/propose', 'rescuer/planners/bandits/describe')
    """
    scope, _, own = planner.rpartition(".")
    return in_scope(scope, f"planners/{own}/{verb}")


def planner_of(service: str, verb: str = PROPOSE) -> str | None:
    """Return the name of the planner that offers a service as its ``verb``, None for any other service.

    >>> planner_of("rescuer/planners/bandits/propose"), planner_of("detect")
    ('rescuer.bandits', None)
    >>> planner_of("planners/metacontrol/objectives/add", "objectives/add")
    'metacontrol'
    """
    match = _OFFER.fullmatch(service)
    if match is None or match[3] != verb:
        return None
    return ".".join(filter(None, match.groups()[:2]))


def planners_with(verb: str, components: Mapping[str, ComponentSpec]) -> dict[str, str]:
    """Return the components that offer a planner's service, by the names of the planners."""
    offers = ((name, service) for name in sorted(components) for service in offered_services(components[name]).values())
    found = ((planner_of(service, verb), name) for name, service in offers)
    return {planner: name for planner, name in found if planner is not None}
