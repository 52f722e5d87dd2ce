"""The role that each acting route needs. A route that is not listed here is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import (
    AdaptationRequest,
    Add,
    EnterMode,
    Move,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.robots.planners import planner_of
from regraft.bus_schema.suggestions import instead_of
from regraft.dashboard_api.http.authentication import Caller
from regraft.security.tokens import Role

READING_METHODS: Final = ("GET", "HEAD", "OPTIONS")
WEBSOCKET: Final = "WEBSOCKET"
"""In place of the method of a WebSocket, which could act and needs a role like any acting route."""
OPERATE, ADMINISTER = Role.OPERATE, Role.ADMINISTER

ROLES: Final[Mapping[tuple[str, str], Role | None]] = {
    # Asks a question that needs a body, and touches nothing: open to all, as reading is.
    ("POST", "/components/{name}/qualities"): None,
    # Whether its changes need more, the body decides: see needed_for.
    ("POST", "/adaptations"): OPERATE,
    ("PATCH", "/components/{name}/parameters"): OPERATE,
    ("POST", "/components/{name}/transition"): OPERATE,
    ("POST", "/components/{name}/swap"): ADMINISTER,
    ("POST", "/components/{name}/move"): ADMINISTER,
    ("POST", "/adaptations/{id}/undo"): OPERATE,
    ("POST", "/adaptations/{id}/confirm"): OPERATE,
    ("DELETE", "/adaptations/{id}"): OPERATE,
    ("POST", "/mission/start"): OPERATE,
    ("POST", "/mission/pause"): OPERATE,
    ("POST", "/mission/step"): OPERATE,
    ("POST", "/mission/halt"): OPERATE,
    ("POST", "/mission/continue"): OPERATE,
    ("POST", "/mission/next"): OPERATE,
    ("POST", "/mission/breakpoints"): OPERATE,
    ("DELETE", "/mission/breakpoints"): OPERATE,
    ("DELETE", "/mission/counts"): OPERATE,
    ("PATCH", "/mission/blackboard"): OPERATE,
    ("POST", "/mission/load"): ADMINISTER,
    ("POST", "/mission/swap"): ADMINISTER,
    # Makes the nodes of a tree, as loading does.
    ("POST", "/mission/check"): ADMINISTER,
    # Configures the planner, by its inputs; a planner may ask for any change.
    ("POST", "/planners/{name}/propose"): ADMINISTER,
    # Choose among realizations that the robot's files allow, as entering a mode does.
    ("POST", "/objectives"): OPERATE,
    ("DELETE", "/objectives"): OPERATE,
    ("DELETE", "/objectives/{name}"): OPERATE,
    ("POST", "/objectives/{name}/progress"): OPERATE,
    ("PUT", "/planners/{name}/context"): OPERATE,
}

BY_BODY: Final = frozenset({("POST", "/adaptations"), ("PATCH", "/components/{name}/parameters")})
"""Routes where some bodies need the role administer."""
BY_BODY_TEXT: Final = (
    "`administer` to add, remove, swap or move a component, and to set parameters of a planner, "
    "parameters that name a file, parameters that the component lacks until other changes are done, "
    "the executor's `mission` and `main`, and a `BtNavigator`'s `behavior_tree`"
)

STRUCTURE = (Add, Remove, Swap, Move)
MISSION_COMMAND: Final = "mission/command"
NAVIGATE: Final = "navigate_to_pose"
TREE_PARAMETERS: Final = {MISSION_COMMAND: frozenset({"mission", "main"}), NAVIGATE: frozenset({"behavior_tree"})}
"""The parameters that choose the tree by which a robot acts, by a service of the components that have them."""


def require_for(changes: Iterable[Any], caller: Caller, architecture: Callable[[], Architecture]) -> None:
    """Raise Problem (403) if the caller's role does not suffice for all changes.

    ``architecture`` is asked for only if the answer depends on it.
    """
    if caller.role is ADMINISTER:
        return
    parameters: list[SetParameters] = []
    modes: list[str] = []
    for change in changes:
        if isinstance(change, STRUCTURE):
            caller.require(ADMINISTER, f"the change {change.change!r} of {change.component!r}")
        elif isinstance(change, SetParameters):
            parameters.append(change)
        elif isinstance(change, EnterMode):
            modes.append(change.mode)
    if parameters:
        now = architecture()
        others = {name for mode in modes for name in _brought_by(mode, now)}
        known = {name: spec for name, spec in now.components.items() if name not in others}
        for change in parameters:
            _require_for_parameters(change, caller, known.get(change.component))


def _brought_by(mode: str, now: Architecture) -> set[str]:
    """Return the components that a mode adds, or gives another class; none if it is one that the manager refuses."""
    try:
        changes = codec.from_plain({"changes": now.modes.get(mode, [])}, AdaptationRequest).changes
    except BadMessage:
        return set()
    present = {name: ("", spec.cls) for name, spec in now.components.items()}
    return {
        change.component
        for change in changes
        if isinstance(change, Add)
        or (isinstance(change, Swap) and change.cls not in present.get(change.component, ("",)))
    }


def _require_for_parameters(change: SetParameters, caller: Caller, spec: ComponentSpec | None) -> None:
    """Raise Problem (403) if the caller may not set these; ``spec`` is None if it is not known whose they are then."""
    for name in sorted(change.parameters):
        if spec is None:
            caller.require(ADMINISTER, f"parameter {name!r} of {change.component!r}, whose class is not known yet,")
        elif configures(spec, name):
            caller.require(ADMINISTER, f"parameter {name!r} of {change.component!r}{_hint(spec, name)}")


def _hint(spec: ComponentSpec, parameter: str) -> str:
    """Return what may have been meant by a parameter that a class lacks; empty if it has it."""
    names = [known.name for known in spec.description.parameters] if spec.description else [parameter]
    return "" if parameter in names else f", which has none of that name now ({instead_of(parameter, names)}),"


def configures(spec: ComponentSpec, parameter: str) -> bool:
    """Return whether a parameter is a planner's, names a file, or chooses a tree; true if that is not known.

    The class may be another once it is set, by an adaptation that waits. Then a parameter that the present class lacks
    may be any, and one that it has would be kept.
    """
    described = spec.description.parameter(parameter) if spec.description else None
    if described is None:
        return True
    services = offered_services(spec)
    offered = {*services, *services.values()}
    if any(planner_of(service) is not None for service in offered):
        return True
    if any(parameter in TREE_PARAMETERS[service] for service in offered & TREE_PARAMETERS.keys()):
        return True
    return described.unit == "path"
