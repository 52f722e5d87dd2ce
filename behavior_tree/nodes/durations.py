"""Times in milliseconds, as the ports of timing nodes give them."""

from typing import Final

from ..errors import PortError
from .node import Node

MAX_MSEC: Final = 2**32 - 1
"""The greatest unsigned number of 32 bits, the type of such ports in BehaviorTree.CPP: 49 days."""


def read_duration(node: Node, port: str) -> float:
    """Return a port's time in seconds.

    Raises:
        PortError: The port cannot be read, or its number is negative or beyond `MAX_MSEC`.
    """
    milliseconds: int = node.read_port(port)
    if not 0 <= milliseconds <= MAX_MSEC:
        raise PortError(f"input '{port}' is {milliseconds}: must be from 0 to {MAX_MSEC} milliseconds", node=node.path)
    return milliseconds / 1000.0
