"""The space of options for an external strategy, as the ports of a decorator give it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, Final

from regraft.bus_schema.annotations import PlainValue
from regraft.services.bt_executor.adaptation.port_values.names import read_names

_PORT: Final = "port:"
_LIFECYCLE: Final = "lifecycle"
MAX_LEVELS: Final = 100
"""How deeply an option may be nested. Python's own limit is another where a deep tree has been loaded."""


def option_space(locations: Sequence[str], subjects: Sequence[str], options: Any) -> list[dict[str, PlainValue]]:
    """Return one dimension for each subject, as the planner ``bandits`` takes them.

    Args:
        locations: The components; one for all subjects, or one for each.
        subjects: Parameters, ``port:NAME`` for a port that is to be connected, or ``lifecycle``.
        options: Text such as ``0.10;0.18;0.26 | 1;3``, or a list of values; with several subjects a list of lists.

    Raises:
        ValueError: the numbers of components, subjects and lists of options do not go together.
    """
    lists = _lists(options, len(subjects))
    if not subjects:
        raise ValueError("adaptation_subject is empty; name what is to be adapted")
    if len(lists) != len(subjects):
        raise ValueError(
            f"adaptation_options has {len(lists)} lists, adaptation_subject {len(subjects)} names "
            f"({';'.join(subjects)}); give each subject a list, set off by '|'"
        )
    if len(locations) not in (1, len(subjects)):
        raise ValueError(
            f"subject_location names {len(locations)} components, adaptation_subject {len(subjects)} things; "
            "name one component for all, or one for each"
        )
    components = list(locations) * (len(subjects) if len(locations) == 1 else 1)
    return [_dimension(*each) for each in zip(components, subjects, lists, strict=True)]


def _dimension(component: str, subject: str, values: list[PlainValue]) -> dict[str, PlainValue]:
    if not values:
        raise ValueError(f"adaptation_options has no option for '{subject}'")
    if subject == _LIFECYCLE:
        return {"component": component, "transitions": values}
    if subject.startswith(_PORT):
        return {"component": component, "port": subject.removeprefix(_PORT), "topics": values}
    return {"component": component, "parameter": subject, "values": values}


def _lists(options: Any, subjects: int) -> list[list[PlainValue]]:
    if isinstance(options, str):
        return [[_value(item) for item in read_names(part)] for part in options.split("|")]
    if not isinstance(options, list | tuple):
        raise ValueError(f"adaptation_options is {options!r}; it must be text such as 0.10;0.18;0.26, or a list")
    if subjects == 1 and not all(isinstance(item, list | tuple) for item in options):
        return [list(options)]
    if not all(isinstance(item, list | tuple) for item in options):
        raise ValueError(f"adaptation_options must be a list of {subjects} lists, one for each subject")
    return [list(item) for item in options]


def _value(text: str) -> PlainValue:
    """Return a number, truth value or list where the text reads as one in JSON, else the text."""
    if _levels(text) > MAX_LEVELS:
        raise ValueError("adaptation_options has an option that is nested too deeply")
    try:
        return json.loads(text, parse_constant=str)
    except ValueError:
        return text


def _levels(text: str) -> int:
    """Return how deeply brackets are nested in a text."""
    return max(accumulate((character in "[{") - (character in "]}") for character in text), default=0)


def option_text(value: PlainValue) -> str:
    """Return an option's value as the port ``adaptation_options`` would have it."""
    return value if isinstance(value, str) else json.dumps(value)
