"""Reads TreeNodesModel: the manifests of node types and of sub-trees that files carry for editors."""

from dataclasses import replace
from typing import Any, Final

from ..data.values import UInt8, UInt16, UInt32, UInt64, from_text, type_name
from ..errors import RegistryError
from ..nodes.manifest import Direction, NodeKind, NodeManifest, PortModel, check_port_name
from ..nodes.text import board_key
from ..status import Status
from .document import Element, parse_document

_KINDS: Final = {kind.value: kind for kind in NodeKind}
_DIRECTIONS: Final = {
    **{direction.value: direction for direction in Direction},
    "bidirectional_port": Direction.INOUT,  # as Nav2's models have it
}
_TYPES: Final[dict[str, Any]] = {
    "bool": bool,
    "int": int,
    "long": int,
    "int64_t": int,
    "uint8_t": UInt8,
    "unsigned char": UInt8,
    "uint16_t": UInt16,
    "unsigned short": UInt16,
    "uint32_t": UInt32,
    "unsigned": UInt32,
    "unsigned int": UInt32,
    "uint64_t": UInt64,
    "unsigned long": UInt64,
    "size_t": UInt64,
    "float": float,
    "double": float,
    "string": str,
    "std::string": str,
    "NodeStatus": Status,
    "BT::NodeStatus": Status,
    "std::vector<int>": list[int],
    "std::vector<float>": list[float],
    "std::vector<double>": list[float],
    "std::vector<std::string>": list[str],
}


def read_manifests(text: str, file: str = "", warnings: list[str] | None = None) -> dict[str, NodeManifest]:
    """Return the node types that a document's TreeNodesModel describes, by ID.

    Ports of C++ types without a Python counterpart take any value, and what is no node type is passed over.

    Args:
        text: The document.
        file: Its name, for messages.
        warnings: Takes the doubts, each with its place; see `manifests_of`.

    Raises:
        LoadError: The document is not well-formed, or a model is without ID or has an impossible port.
    """
    doubts = [] if warnings is None else warnings
    return {
        manifest.type_id: manifest
        for model in parse_document(text, file).children_of("TreeNodesModel")
        for manifest in manifests_of(model, doubts)
    }


def manifests_of(model: Element, warnings: list[str]) -> list[NodeManifest]:
    """Return the node types of a TreeNodesModel element.

    A default that its type cannot read, such as an expression of C++, is a warning and left out.
    Sub-tree ports such as Groot2's ``_collapsed`` are an editor's own notes and left out.

    Raises:
        LoadError: A model is without ID or has an impossible port.
    """
    manifests = []
    for element in model.children:
        kind = _KINDS.get(element.tag)
        if kind is None:
            continue
        type_id = element.attributes.get("ID", "")
        if not type_id:
            raise element.error(f"<{element.tag}> in TreeNodesModel needs an ID")
        children = [child for child in element.children if child.tag in _DIRECTIONS]
        if kind is NodeKind.SUBTREE:
            ports = [_port(child) for child in children if not child.attributes.get("name", "").startswith("_")]
        else:
            ports = [_readable(child, _port(child), warnings) for child in children]
        manifests.append(NodeManifest(type_id, kind, {port.name: port for port in ports}))
    return manifests


def _readable(element: Element, port: PortModel, warnings: list[str]) -> PortModel:
    if port.default is None or port.type is None or board_key(port.default, port.name) is not None:
        return port
    try:
        from_text(port.default, port.type, {})
    except ValueError as error:
        kind = type_name(port.type)
        warnings.append(f"{element.place}: the default of port '{port.name}' of type {kind} is ignored: {error}")
        return replace(port, default=None)
    return port


def _port(element: Element) -> PortModel:
    name = element.attributes.get("name", "")
    try:
        check_port_name(name)
    except RegistryError as error:
        raise element.error(error.message) from None
    return PortModel(
        name,
        _DIRECTIONS[element.tag],
        _TYPES.get(element.attributes.get("type", "")),
        element.attributes.get("default") or None,  # Editors write an empty one where there is none.
        element.text.strip(),
    )
