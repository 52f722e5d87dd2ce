"""Settings: each is one thing that should be, as a parameter's value, a port's topic, or a component's state."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage


class Kind(Enum):
    """The kind of a setting."""

    PARAMETER = "parameter"
    PORT = "port"
    TRANSITION = "transition"
    STATE = "state"
    CLASS = "class"
    HOST = "host"
    PRESENCE = "presence"


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing that should be.

    ``member`` is the parameter or port, empty for the other kinds. ``value`` is the parameter's value, or the name of
    the topic, transition, state, class or host. For presence it is False, or the map that a stack file has of the
    component.
    """

    component: str
    kind: Kind
    member: str
    value: PlainValue

    @property
    def subject(self) -> tuple[str, Kind, str]:
        """The thing that the setting is about; settings of one subject with different values exclude each other."""
        kind = Kind.STATE if self.kind is Kind.TRANSITION else self.kind
        return self.component, kind, self.member

    @property
    def content(self) -> str:
        """A text that is equal for equal settings."""
        return json.dumps([self.component, self.kind.value, self.member]) + identity(self.value)


def contradict(one: Sequence[Setting], other: Sequence[Setting]) -> bool:
    """Return whether two sets of settings want different values of one thing."""
    wanted = {setting.subject: identity(setting.value) for setting in one}
    return any(wanted.get(each.subject, identity(each.value)) != identity(each.value) for each in other)


def identity(value: PlainValue) -> str:
    """Return a text that is equal for equal values: 1 is 1.0, but not true.

    >>> identity(1.0), identity(1), identity(True), identity([0.5, "a"])
    ('1', '1', 'true', '[0.5, "a"]')
    """
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return json.dumps(value)
    try:
        return json.dumps(_whole(value), sort_keys=True)
    except TypeError:
        raise BadMessage(f"holds {type(value).__name__}, must be numbers, texts, or lists of them") from None


def _whole(value: PlainValue) -> PlainValue:
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, list | tuple):
        return [_whole(part) for part in value]
    if isinstance(value, dict):
        return {key: _whole(part) for key, part in value.items()}
    return value
