"""The ports of adapt decorators, read afresh whenever they are needed: a tree's logic may rewrite their entries."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

from behavior_tree import Node
from behavior_tree.nodes.text import board_key
from regraft.bus_schema.encoding.records import shape_of
from regraft.bus_schema.model.watched import Condition
from regraft.services.bt_executor.adaptation.port_values.durations import read_duration
from regraft.services.bt_executor.adaptation.port_values.names import read_names
from regraft.services.bt_executor.adaptation.port_values.options import option_space
from regraft.services.bt_executor.adaptation.port_values.policies import Policy, read_policy
from regraft.services.bt_executor.leaves.plain_messages import as_plain, read_json

LOCATIONS: Final = ("subject_location", "adaptation_location")
DURATIONS: Final = ("timeout", "retry_after", "settle", "confirm")
POLICIES: Final = ("on_rejected", "on_rolled_back", "on_stuck", "on_no_answer")
PLANNER: Final = re.compile(r"/?[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)?")
FOR_PLANNERS: Final = ("adaptation_strategy", "decision", "inputs")
"""Ports of which any one, when given, means that a planner decides."""
FOR_STRATEGIES: Final = (
    "adaptation_options", "constraints", "knobs", "settle", "utility", "condition", "context", "planner",
    "task",
)  # fmt: skip
"""Ports that mean something only where a planner decides."""
FOR_RULES: Final = ("confirm", "watch")
"""Ports that mean something only where rules or a plan of its own decide: a planner asks by itself."""


def locations_of(node: Node) -> tuple[str, ...]:
    """Return the components that a node names, none if it names none."""
    given = next((name for name in LOCATIONS if name in node.setup.readers), "")
    return read_names(node.read_port(given)) if given else ()


def subjects_of(node: Node) -> tuple[str, ...]:
    """Return the parameters or other subjects that a node names."""
    return read_names(node.read_port("adaptation_subject")) if "adaptation_subject" in node.setup.readers else ()


def duration_of(node: Node, port: str) -> float:
    """Return a duration in seconds; raises ValueError."""
    seconds: float = _told(port, lambda: read_duration(node.read_port(port)))
    return seconds


def policy_of(node: Node, port: str) -> Policy:
    """Return a policy; raises ValueError."""
    policy: Policy = _told(port, lambda: read_policy(node.read_port(port)))
    return policy


def json_of(node: Node, port: str, kind: type) -> Any:
    """Return the map or list that a port holds as JSON or as a value; raises ValueError."""
    given = node.read_port(port)
    plain = _told(port, lambda: read_json(given)) if isinstance(given, str) else as_plain(given)
    if not isinstance(plain, kind):
        what = "a map, as in json:{...}" if kind is dict else "a list, as in [...]"
        raise ValueError(f"port '{port}' must hold {what}")
    return plain


def conditions_of(node: Node) -> tuple[Condition, ...]:
    """Return what must hold while an adaptation is confirmed; raises ValueError."""
    given = node.read_port("watch")
    is_json = isinstance(given, str) and given.lstrip().startswith(("json:", "["))
    plain = json_of(node, "watch", list) if is_json or not isinstance(given, str) else list(read_names(given))
    shape = shape_of(tuple[Condition, ...])
    conditions: tuple[Condition, ...] = _told("watch", lambda: shape.unpack(plain))
    return conditions


def check_ports(node: Node, *, has_own_plan: bool) -> None:
    """Check what the XML gives as literals, and that exactly one thing decides.

    Raises:
        ValueError: something is wrong; the loader adds the place.
    """
    given = node.setup.attributes
    asking = [name for name in FOR_PLANNERS if name in node.setup.readers]
    deciding = [name for name in ("rules",) if name in node.setup.readers] + asking
    if has_own_plan and deciding:
        raise ValueError(f"{node.type_id} has a plan of its own; it takes no port {' and no '.join(deciding)}")
    if not has_own_plan and (not deciding or ("rules" in deciding and asking)):
        ports = "adaptation_strategy, decision or inputs"
        raise ValueError(f"{node.type_id} needs either the port rules, or the port {ports}")
    if all(name in given for name in LOCATIONS):
        raise ValueError(f"{node.type_id} is given {' and '.join(LOCATIONS)}, which mean the same; give one of them")
    if asking:
        _check_planner(node)
        for port in FOR_RULES:
            if port in given:
                raise ValueError(f"port '{port}' is for rules and plans: a planner asks for the adaptation by itself")
    else:
        idle = [name for name in FOR_STRATEGIES if name in given]
        if idle:
            also = "give adaptation_strategy, decision or inputs as well"
            raise ValueError(f"port '{idle[0]}' is for external strategies; {also}")
    for port in DURATIONS:
        if is_known(node, port):
            duration_of(node, port)
    if is_known(node, "watch"):
        conditions_of(node)
    if "watch" in given and "confirm" not in given:
        raise ValueError("port 'watch' needs the port confirm as well: how long it is watched")
    for port in POLICIES:
        if is_known(node, port):
            policy_of(node, port)


def _check_planner(node: Node) -> None:
    given = node.setup.attributes
    if not any(name in node.setup.readers for name in ("decision", "inputs")) or "adaptation_options" in given:
        _check_options(node)
    if is_known(node, "planner") and not PLANNER.fullmatch(node.read_port("planner")):
        raise ValueError(f"port 'planner': '{node.read_port('planner')}' cannot be a planner's name, such as bandits")
    for port, kind in (("knobs", dict), ("constraints", list), ("inputs", dict)):
        text = given.get(port, "")
        if '"' in text and not node.has_literal(port):
            raise ValueError(f"port '{port}': write json: before {text}, or it is taken for a blackboard key")
        if is_known(node, port):
            json_of(node, port, kind)


def _check_options(node: Node) -> None:
    needed = ["adaptation_subject", "adaptation_options"]
    missing = [name for name in needed if name not in node.setup.readers]
    if not any(name in node.setup.readers for name in LOCATIONS):
        missing.append(LOCATIONS[0])
    if missing:
        raise ValueError(f"{node.type_id} with adaptation_strategy needs the port {', '.join(missing)} as well")
    location = next(name for name in LOCATIONS if name in node.setup.readers)
    if all(is_known(node, port) for port in (*needed, location)):
        option_space(locations_of(node), subjects_of(node), node.read_port("adaptation_options"))


def is_known(node: Node, port: str) -> bool:
    """Return whether a port's value is known at load, given or by default."""
    text = node.setup.attributes.get(port, node.setup.manifest.ports[port].default)
    return text is not None and not (isinstance(text, str) and board_key(text, port))


def _told(port: str, read: Callable[[], Any]) -> Any:
    try:
        return read()
    except ValueError as error:
        raise ValueError(f"port '{port}': {error}") from None
