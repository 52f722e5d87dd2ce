"""Planners by name: each is asked by two services, in the scope of its component."""

from __future__ import annotations

import re

from regraft.bus_schema.model.robots.scopes import in_scope

PROPOSE, DESCRIBE = "propose", "describe"
"""The services of a planner."""
_OFFER = re.compile(rf"(?:([^/]+)/)?planners/([^/]+)/{PROPOSE}")


def planner_service(planner: str, verb: str) -> str:
    """Return the name under which a planner offers one of its services.

    >>> planner_service("bandits", PROPOSE), planner_service("rescuer.bandits", DESCRIBE)
    ('planners/bandits/propose', 'rescuer/planners/bandits/describe')
    """
    scope, _, own = planner.rpartition(".")
    return in_scope(scope, f"planners/{own}/{verb}")


def planner_of(service: str) -> str | None:
    """Return the name of the planner that is asked for proposals by a service, None for any other service.

    >>> planner_of("rescuer/planners/bandits/propose"), planner_of("detect")
    ('rescuer.bandits', None)
    """
    match = _OFFER.fullmatch(service)
    return None if match is None else ".".join(filter(None, match.groups()))
