"""Reads TreeNodesModel: the manifests of node types and of sub-trees that files carry for editors."""

from typing import Any, Final

from ..errors import RegistryError
from ..nodes.manifest import Direction, NodeKind, NodeManifest, PortModel, check_port_name
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
    "unsigned int": int,
    "long": int,
    "unsigned long": int,
    "int64_t": int,
    "uint64_t": int,
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


def read_manifests(text: str, file: str = "") -> dict[str, NodeManifest]:
    """Return the node types that a document's TreeNodesModel describes, by ID.

    Ports of C++ types without a Python counterpart take any value, and what is no node type is passed over.

    Raises:
        LoadError: The document is not well-formed, or a model is without ID or has an impossible port.
    """
    return {
        manifest.type_id: manifest
        for model in parse_document(text, file).children_of("TreeNodesModel")
        for manifest in manifests_of(model)
    }


def manifests_of(model: Element) -> list[NodeManifest]:
    """Return the node types of a TreeNodesModel element.

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
        ports = [_port(child) for child in element.children if child.tag in _DIRECTIONS]
        manifests.append(NodeManifest(type_id, kind, {port.name: port for port in ports}))
    return manifests


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
