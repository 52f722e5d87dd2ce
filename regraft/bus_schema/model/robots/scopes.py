"""Scopes: one robot's names among those of several in one system.

If ``rescuer`` is a scope, the component ``rescuer.navigator`` is in it. Topics and services that it names begin with
``rescuer/``, also those that it calls. A leading ``/`` names what all robots share.
"""

from __future__ import annotations

from collections.abc import Collection

from regraft.bus_schema.model.system_topics import SYSTEM_TOPICS

SHARED = "/"
"""The begin of a name that means the same in every scope."""
OWN_NAME = "{name}"
"""In the name that a class gives a service: the component's own name, without its scope."""


def scope_of(component: str, scopes: Collection[str]) -> str:
    """Return the scope of a component, empty for none: the part of its name before the dot, if that is a scope.

    >>> scope_of("rescuer.navigator", {"rescuer"}), scope_of("rescuer.navigator", {"scout"})
    ('rescuer', '')
    """
    scope = component.rpartition(".")[0]
    return scope if scope in scopes else ""


def in_scope(scope: str, name: str) -> str:
    """Return what the name of a topic, service or mode means in a scope.

    >>> in_scope("rescuer", "scan"), in_scope("rescuer", "/map"), in_scope("", "scan")
    ('rescuer/scan', 'map', 'scan')
    """
    if name.startswith(SHARED):
        return name.removeprefix(SHARED)
    return f"{scope}/{name}" if scope and name not in SYSTEM_TOPICS else name


def service_in_scope(component: str, scope: str, service: str) -> str:
    """Return what a component offers a service as: in its scope, with its own name in place of ``{name}``.

    >>> service_in_scope("rescuer.bandits", "rescuer", "planners/{name}/propose")
    'rescuer/planners/bandits/propose'
    """
    own = component.removeprefix(f"{scope}.") if scope else component
    return in_scope(scope, service.replace(OWN_NAME, own))


def component_in_scope(scope: str, name: str) -> str:
    """Return what the name of a component means in a scope.

    >>> component_in_scope("rescuer", "camera"), component_in_scope("rescuer", "/world")
    ('rescuer.camera', 'world')
    """
    if name.startswith(SHARED):
        return name.removeprefix(SHARED)
    return f"{scope}.{name}" if scope else name
