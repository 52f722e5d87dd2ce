"""Checks a parameter's value against its description: in the component, and wherever its class is not at hand."""

from __future__ import annotations

import math
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import Description, ParameterDescription

INT64 = 2**63


def parameter_problem(parameter: ParameterDescription, value: PlainValue) -> str | None:
    """Return what is wrong with ``value`` and what would be right, None if it fits the JSON Schema.

    The keywords that parameters use are understood: ``type``, ``items.type`` (one, or several), ``minimum``,
    ``maximum`` (which hold for every number of an array) and ``enum``.
    """
    schema = parameter.schema
    wanted = schema.get("type")
    items = schema.get("items")
    item = items.get("type") if isinstance(items, dict) else None
    if wanted == "integer" and isinstance(value, float) and abs(value) >= INT64:
        return f"{_shown(value)}: must be finite and fit into 64 bits"
    if not _has_type(value, wanted):
        return f"{_shown(value)}: must be {_a(str(wanted))}{_form(items)}"
    if wanted == "array" and not all(_has_type(part, item) for part in value):
        items_wanted = "s and ".join(item) if isinstance(item, list) else item
        return f"{_shown(value)}: must be an array of {items_wanted}s"
    numbers = [part for part in (value if wanted == "array" else [value]) if _is_number(part)]
    if not all(_can_travel(number) for number in numbers):
        return f"{_shown(value)}: must be finite and fit into 64 bits"
    return _range_problem(parameter, value, numbers) or _choice_problem(schema.get("enum"), value)


def effective_parameter(description: Description, values: dict[str, PlainValue], name: str) -> PlainValue:
    """Return the value that a component starts with: the given one or the default, None without either."""
    parameter = description.parameter(name)
    return values.get(name, parameter.default if parameter else None)


def _range_problem(parameter: ParameterDescription, value: PlainValue, numbers: list[float]) -> str | None:
    low, high = parameter.schema.get("minimum"), parameter.schema.get("maximum")
    unit = f" {parameter.unit}" if parameter.unit else ""
    if low is not None and any(number < low for number in numbers):
        return f"{_shown(value)}: must be at least {low}{unit}"
    if high is not None and any(number > high for number in numbers):
        return f"{_shown(value)}: must be at most {high}{unit}"
    return None


def _choice_problem(choices: PlainValue, value: PlainValue) -> str | None:
    if not isinstance(choices, list | tuple) or any(_alike(value, choice) for choice in choices):
        return None
    return f"{_shown(value)}: must be one of: {', '.join(map(str, choices))}"


def _alike(one: PlainValue, other: PlainValue) -> bool:
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return list(one) == list(other)
    return bool(one == other)


def _is_number(value: PlainValue) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _has_type(value: PlainValue, wanted: Any) -> bool:
    if isinstance(wanted, list | tuple):
        return any(_has_type(value, each) for each in wanted)
    if wanted == "number":
        return _is_number(value)
    if wanted == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    types: dict[Any, Any] = {"boolean": bool, "string": str, "array": list | tuple, "object": dict}
    return wanted not in types or isinstance(value, types[wanted])


def _can_travel(number: float) -> bool:
    return -INT64 <= number < INT64 if isinstance(number, int) else math.isfinite(number)


def _form(items: PlainValue) -> str:
    """Return how the records of an array are written."""
    fields = items.get("properties") if isinstance(items, dict) else None
    return f" such as [{{{', '.join(f'{name}: ...' for name in fields)}}}]" if isinstance(fields, dict) else ""


def _shown(value: PlainValue) -> str:
    text = "null" if value is None else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _a(noun: str) -> str:
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"
