"""A node type as known without an instance: its kind and its ports."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from ..data.values import PortType
from ..errors import RegistryError

CONDITION_ATTRIBUTES: Final = (
    "_failureIf",
    "_successIf",
    "_skipIf",
    "_while",
    "_onHalted",
    "_onFailure",
    "_onSuccess",
    "_post",
)
RESERVED_PORT_NAMES: Final = frozenset({"name", "ID", "_autoremap", *CONDITION_ATTRIBUTES})
_FORBIDDEN: Final = re.compile(r"[\x00-\x20\x7f<>&\"'/\\:*?.|]")
_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f]")


class NodeKind(Enum):
    """The five kinds of nodes; the values are the long-form XML tags."""

    ACTION = "Action"
    CONDITION = "Condition"
    CONTROL = "Control"
    DECORATOR = "Decorator"
    SUBTREE = "SubTree"


class Direction(Enum):
    """Which way data flows through a port, seen from the node."""

    INPUT = "input_port"
    OUTPUT = "output_port"
    INOUT = "inout_port"


@dataclass(frozen=True, slots=True)
class PortModel:
    """A port of a node type.

    Attributes:
        name: The XML attribute.
        direction: Which way data flows.
        type: The type of the values, None for any.
        default: The value of an input if the attribute is absent: a value, or text as the attribute would have
            it; None means no default.
        description: The purpose of the port.
    """

    name: str
    direction: Direction = Direction.INPUT
    type: PortType = None
    default: Any = None
    description: str = ""

    @property
    def is_input(self) -> bool:
        """Whether the node reads the port."""
        return self.direction is not Direction.OUTPUT

    @property
    def is_output(self) -> bool:
        """Whether the node writes the port."""
        return self.direction is not Direction.INPUT


@dataclass(frozen=True, slots=True)
class NodeManifest:
    """A node type: its ID, kind, ports by name, and what it does."""

    type_id: str
    kind: NodeKind
    ports: Mapping[str, PortModel] = field(default_factory=dict)
    description: str = ""


def check_type_id(type_id: str) -> None:
    """Check that a node type may be called so.

    Raises:
        RegistryError: The name is empty, reserved, or has a character that BehaviorTree.CPP refuses.
    """
    found = _FORBIDDEN.search(type_id)
    if found:
        raise RegistryError(f"node type '{type_id}': the character {found.group()!r} is not allowed")
    if not type_id or type_id == "root":
        raise RegistryError(f"node type '{type_id}': this name is reserved or empty; choose another")


def check_port_name(name: str) -> None:
    """Check that a port may be called so.

    Raises:
        RegistryError: The name is reserved, does not start with a letter, or has a refused character.
    """
    found = _FORBIDDEN.search(name)
    if found:
        raise RegistryError(f"port '{name}': the character {found.group()!r} is not allowed")
    if name in RESERVED_PORT_NAMES:
        raise RegistryError(f"port '{name}': this name is reserved")
    if not name or not name[0].isalpha():
        raise RegistryError(f"port '{name}': a port's name starts with a letter")


def has_control_character(name: str) -> bool:
    """Return whether an instance name has a character that no name may have."""
    return _CONTROL.search(name) is not None
