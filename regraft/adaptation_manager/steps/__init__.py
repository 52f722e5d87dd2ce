"""One file per kind of change: how it changes the architecture, and its steps with their inverses.

A further kind of change is a file here with a ``plan`` function, and a line in ``PLANNERS``; if it needs a
new kind of action, that is a class in ``actions`` and a line in ``regraft.adaptation_manager.execution.perform``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from regraft.adaptation_manager.steps import add, connect, move, parameters, remove, swap, transition
from regraft.adaptation_manager.steps.draft import Draft

PLANNERS: dict[str, Callable[[Draft, Any], None]] = {
    "set_parameters": parameters.plan,
    "connect": connect.plan,
    "transition": transition.plan,
    "add": add.plan,
    "remove": remove.plan,
    "swap": swap.plan,
    "move": move.plan,
}
OF_PROCESSES = frozenset({"add", "remove", "move"})
"""Changes whose component need not exist yet, or not speak the lifecycle."""
