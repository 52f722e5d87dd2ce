"""Connects the ports of a node: makes the functions that read and write them."""

from collections.abc import Callable, Mapping
from typing import Any

from ..data.blackboard import Blackboard
from ..data.values import from_text, to_type, type_name
from ..errors import BlackboardError, PortError
from ..nodes.manifest import NodeManifest, PortModel
from ..nodes.text import board_key
from .document import Element

Reader = Callable[[], Any]
Writer = Callable[[Any], None]


def bind_ports(
    element: Element, manifest: NodeManifest, texts: Mapping[str, str], board: Blackboard, path: str
) -> tuple[dict[str, Reader], dict[str, Writer]]:
    """Return the readers and the writers of a node's ports, declaring the entries that they refer to.

    Args:
        element: Where the node comes from.
        manifest: Its ports.
        texts: Their attributes.
        board: The blackboard of the keys.
        path: The node's path, for messages.

    Raises:
        LoadError: A literal does not fit its port, or a key is used with two types.
    """
    readers: dict[str, Reader] = {}
    writers: dict[str, Writer] = {}
    for name, port in manifest.ports.items():
        given = texts.get(name, port.default)
        if given is None:
            continue
        key = board_key(given, name) if isinstance(given, str) else None
        if key is None:
            if port.is_input:
                readers[name] = _constant(element, port, given, board)
            continue
        # Only what the XML states gives an entry its type: BehaviorTree.CPP passes over defaults here.
        kind = port.type if name in texts else None
        try:
            board.declare(key, kind)
        except BlackboardError as error:
            raise element.error(f"port '{name}': {error.message}") from error
        if port.is_input:
            readers[name] = _reader(port, key, board, path)
        if port.is_output:
            writers[name] = _writer(port, key, board, path)
    return readers, writers


def _constant(element: Element, port: PortModel, given: Any, board: Blackboard) -> Reader:
    value = given
    if isinstance(given, str) and port.type is not None:
        try:
            value = from_text(given, port.type, board.converters)
        except ValueError as error:
            raise element.error(f"port '{port.name}' is of type {type_name(port.type)}: {error}") from error
    return lambda: value


def _reader(port: PortModel, key: str, board: Blackboard, path: str) -> Reader:
    name, kind, converters = port.name, port.type, board.converters

    def read() -> Any:
        try:
            return to_type(board.get(key), kind, converters)
        except (BlackboardError, ValueError) as error:
            raise PortError(f"input '{name}' from entry '{key}': {error}", node=path) from error

    return read


def _writer(port: PortModel, key: str, board: Blackboard, path: str) -> Writer:
    name, kind, converters = port.name, port.type, board.converters

    def write(value: Any) -> None:
        try:
            board.set(key, to_type(value, kind, converters), kind)
        except (BlackboardError, ValueError) as error:
            raise PortError(f"output '{name}' to entry '{key}': {error}", node=path) from error

    return write
