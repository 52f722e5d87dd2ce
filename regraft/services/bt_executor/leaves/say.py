"""The leaf that publishes an event."""

from __future__ import annotations

import re
from typing import Any, Final

from behavior_tree import SUCCESS, Input, Node, NodeSetup, Status, SyncAction
from regraft.services.bt_executor.leaves.asking_leaf import require_ports
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.plain_values import shown

_PLACE: Final = re.compile(r"\{(@?\w+)\}")

TAKEN: Final = ("kind", "text", "node")
"""Names of what each event of the leaf has."""


class Say(SyncAction):
    """Puts an event on the bus; ``{key}`` within its text represents the value of a blackboard entry."""

    text = Input(str, description="the text of the event")
    event = Input(str, default="mission.said", description="the kind of event, dotted")
    details = Input(str, default="", description="keys of entries that go with the event as values, set off by blanks")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self._context = context

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "text")
        taken = [key for key in self._keys() if key in TAKEN] if self.has_literal("details") else []
        if taken:
            raise ValueError(f"port 'details' names {taken[0]!r}, which the event has of its own")

    def tick(self) -> Status:
        """Publish the event; an empty entry is shown as '?'."""
        text = _PLACE.sub(lambda place: self._text(place.group(1)), self.text)
        details = {name: shown(self._value(key)) for name, key in self._keys().items() if name not in TAKEN}
        self._context.kit.event(self.event, text, node=self.path, **details)
        return SUCCESS

    def _keys(self) -> dict[str, str]:
        """Return the keys of the entries that go with the event, by the names of their values."""
        return {key.removeprefix("@"): key for key in self.details.split()}

    def _value(self, key: str) -> Any:
        entry = self.blackboard.find(key)
        return entry.value if entry else None

    def _text(self, key: str) -> str:
        value = self._value(key)
        if isinstance(value, float):
            return f"{value:.4g}"
        return "?" if value is None else str(value)
