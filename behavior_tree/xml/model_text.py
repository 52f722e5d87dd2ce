"""Writes TreeNodesModel: the node types of a registry as Groot2's editor takes them.

The form is that of BehaviorTree.CPP's ``writeTreeNodesModelXML``. The description of a node type is a metadata field.
"""

import re
from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Any, Final, get_args, get_origin
from xml.sax.saxutils import escape, quoteattr

from ..data.values import PortType, number_text, type_name
from ..nodes.manifest import NodeKind, NodeManifest, PortModel
from ..status import Status, status_name

ANY: Final = "BT::AnyTypeAllowed"
"""The type of a port that takes any value, as BehaviorTree.CPP calls it."""
_NAMES: Final[dict[Any, str]] = {float: "double", str: "std::string"}
_UNWRITABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML document may have (XML 1.0, section 2.2)."""


def models_text(manifests: Iterable[NodeManifest]) -> str:
    """Return a document with the models of node types, by ID.

    The type SubTree is left out: a model of a sub-tree describes one tree. A default that text cannot express is left
    out too.
    """
    ordered = sorted(manifests, key=lambda manifest: manifest.type_id)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<root BTCPP_format="4">', "  <TreeNodesModel>"]
    for manifest in ordered:
        if manifest.kind is not NodeKind.SUBTREE:
            lines += _model(manifest)
    return "\n".join([*lines, "  </TreeNodesModel>", "</root>"])


def cpp_type(kind: PortType) -> str:
    """Return how BehaviorTree.CPP's models call a type; other classes keep their name."""
    if kind is None:
        return ANY
    origin: Any = get_origin(kind)
    if origin is list:
        return f"std::vector<{cpp_type(get_args(kind)[0])}>"
    return _NAMES.get(kind) or type_name(kind)


def default_text(port: PortModel) -> str | None:
    """Return a port's default as an attribute would have it; None where there is none, or no text for it."""
    return _value_text(port.default, port.type)


def _value_text(value: Any, kind: PortType) -> str | None:
    if isinstance(value, str) and not isinstance(value, Enum):
        return value
    if kind is Status and isinstance(value, int):
        return status_name(Status(value))
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return number_text(value)
    if isinstance(value, list | tuple):
        items = [_value_text(item, None) for item in value]
        return None if None in items else ";".join(str(item) for item in items)
    return None


def _model(manifest: NodeManifest) -> Iterator[str]:
    tag, name = manifest.kind.value, _quoted(manifest.type_id)
    if not manifest.ports and not manifest.description:
        yield f"    <{tag} ID={name}/>"
        return
    yield f"    <{tag} ID={name}>"
    for port in manifest.ports.values():
        yield f"      {_port(port)}"
    if manifest.description:
        yield f"      <MetadataFields><Metadata description={_quoted(manifest.description)}/></MetadataFields>"
    yield f"    </{tag}>"


def _port(port: PortModel) -> str:
    attributes = f"name={_quoted(port.name)} type={_quoted(cpp_type(port.type))}"
    default = default_text(port)
    if default:
        attributes += f" default={_quoted(default)}"
    tag = port.direction.value
    if not port.description:
        return f"<{tag} {attributes}/>"
    return f"<{tag} {attributes}>{escape(_writable(port.description))}</{tag}>"


def _quoted(text: str) -> str:
    return quoteattr(_writable(text), {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def _writable(text: str) -> str:
    return _UNWRITABLE.sub("\ufffd", text)
