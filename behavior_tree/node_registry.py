"""The node types, enumerated names and text conversions that trees are built from."""

from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum
from functools import partial
from typing import Any

from .builtin import BUILTIN_NODES
from .data.values import Converter
from .errors import RegistryError
from .nodes.manifest import NodeManifest, check_port_name, check_type_id
from .nodes.node import Node, NodeSetup
from .nodes.ports import declared_ports
from .substitution import MockAction, MockConfig, Substitution, Substitutions

Factory = Callable[[NodeSetup], Node]


class Registry:
    """All that a tree's XML may refer to; starts with the built-in node types.

    Attributes:
        converters: Functions that make values from text, by class.
        enums: Whole numbers by name, for scripts and Switch nodes.
        substitutions: Rules that put other nodes in place of those that the XML names.
    """

    def __init__(self) -> None:
        self.converters: dict[Any, Converter] = {}
        self.enums: dict[str, int] = {}
        self.substitutions = Substitutions()
        self._factories: dict[str, Factory] = {}
        self._manifests: dict[str, NodeManifest] = {}
        self._given_arguments: dict[str, bool] = {}
        self.register_all(BUILTIN_NODES)

    def register(
        self,
        node_class: type[Node],
        type_id: str = "",
        *,
        manifest: NodeManifest | None = None,
        replace: bool = False,
        **arguments: Any,
    ) -> None:
        """Register a node type.

        Args:
            node_class: The class of its nodes.
            type_id: Its name in XML, by default the name of the class.
            manifest: Kind and ports, for classes that do not declare their ports themselves; its type ID
                counts.
            replace: Whether it takes the place of a type of the same name.
            arguments: Keyword arguments for the constructor, behind the setup.

        Raises:
            RegistryError: The name is taken or ill-formed, or a port is.
        """
        if manifest is None:
            ports = declared_ports(node_class, Node)
            description = (node_class.__doc__ or "").partition("\n")[0]
            manifest = NodeManifest(type_id or node_class.__name__, node_class.kind, ports, description)
        check_type_id(manifest.type_id)
        for port in manifest.ports:
            check_port_name(port)
        if manifest.type_id in self._manifests and not replace:
            raise RegistryError(f"node type '{manifest.type_id}' is registered already")
        self._factories[manifest.type_id] = partial(node_class, **arguments)
        self._given_arguments[manifest.type_id] = bool(arguments)
        self._manifests[manifest.type_id] = manifest

    def register_all(self, node_classes: Iterable[type[Node]]) -> None:
        """Register classes under their own names; see `register`."""
        for node_class in node_classes:
            self.register(node_class)

    def register_enum(self, enum_class: type[IntEnum]) -> None:
        """Make the members of an enumeration known to scripts and Switch nodes by their names."""
        self.enums.update({name: int(member) for name, member in enum_class.__members__.items()})

    def register_converter(self, value_class: type[Any], converter: Converter) -> None:
        """Report how values of a class are made from text, for literals and for text on a blackboard."""
        self.converters[value_class] = converter

    def substitute(self, pattern: str, substitution: Substitution) -> None:
        """Put another node in place of every one that a pattern fits; see `Substitutions`.

        Args:
            pattern: An instance name, a type ID, or a path with wildcards.
            substitution: Another registered type, or what an action in its place does.
        """
        self.substitutions.add(pattern, substitution)

    def copy(self) -> "Registry":
        """Return a registry with the same contents, which may go its own way."""
        result = Registry.__new__(Registry)
        result.converters = dict(self.converters)
        result.enums = dict(self.enums)
        result.substitutions = self.substitutions.copy()
        result._factories = dict(self._factories)
        result._manifests = dict(self._manifests)
        result._given_arguments = dict(self._given_arguments)
        return result

    @property
    def manifests(self) -> Mapping[str, NodeManifest]:
        """The registered node types by ID."""
        return self._manifests

    def is_given_arguments(self, type_id: str) -> bool:
        """Return whether a node type was registered with arguments, and so may act on what is outside the tree."""
        return self._given_arguments[type_id]

    def build(self, setup: NodeSetup) -> Node:
        """Make a node of a registered type."""
        return self._factories[setup.manifest.type_id](setup)

    def build_substitute(self, setup: NodeSetup, substitution: Substitution) -> Node:
        """Make the node that takes the place of one.

        Raises:
            RegistryError: There is no such node type.
        """
        if isinstance(substitution, MockConfig):
            return MockAction(setup, substitution)
        factory = self._factories.get(substitution)
        if factory is None:
            raise RegistryError(f"there is no node type '{substitution}' to take the place of '{setup.path}'")
        return factory(setup)
