"""Values of ports and blackboard entries, and the conversions between their types.

A type is a Python class, ``list[...]`` of one, or None for "any". Text converts to whole numbers, reals, truth values,
statuses, enumerations and lists. It also converts to every class that has a converter in the registry.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from enum import Enum
from functools import partial
from typing import Any, Final, NewType, get_args, get_origin

from ..status import STATUS_NAMES, Status, status_from_name

PortType = Any
"""A class, a ``list[...]`` of one, ``Status``, or None for any type."""

Converter = Callable[[str], Any]
"""Makes a value from text; raises ValueError where the text means none."""

INT64_MIN: Final = -(2**63)
INT64_MAX: Final = 2**63 - 1
UInt8 = NewType("UInt8", int)
UInt16 = NewType("UInt16", int)
UInt32 = NewType("UInt32", int)
UInt64 = NewType("UInt64", int)
"""The types of ports that take no negative numbers; their values are of type int."""

UNSIGNED_MAX: Final[dict[Any, int]] = {UInt8: 2**8 - 1, UInt16: 2**16 - 1, UInt32: 2**32 - 1, UInt64: INT64_MAX}
"""The largest number of each; scripts and blackboards have signed numbers of 64 bits, so UInt64 ends there too."""
UNSIGNED_NAMES: Final[dict[Any, str]] = {
    UInt8: "uint8_t",
    UInt16: "uint16_t",
    UInt32: "unsigned int",
    UInt64: "uint64_t",
}
TRUTH_VALUES: Final = {
    "0": False, "false": False, "False": False, "FALSE": False,
    "1": True, "true": True, "True": True, "TRUE": True,
}  # fmt: skip
_MAX_DIGITS: Final = 100
"""Characters of a whole number, leading zeros included; 64 bits need 20."""
_INT: Final = re.compile(r"[+-]?\d+")
_WHOLE: Final = re.compile(r"([+-]?\d+)\.0*")
_INFINITY: Final = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)
_REAL: Final = re.compile(r"[+-]?(\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?")


def type_name(kind: PortType) -> str:
    """Return how messages call a type."""
    if kind is None:
        return "any"
    if kind is Status:
        return "NodeStatus"
    if kind in UNSIGNED_NAMES:
        return UNSIGNED_NAMES[kind]
    if get_origin(kind) is not None:
        return str(kind)
    return str(getattr(kind, "__name__", kind))


def parse_int(text: str) -> int:
    """Read a decimal 64-bit integer.

    Raises:
        ValueError: The text is something else.
    """
    text = text.strip()
    # Python refuses to read more than 4,300 digits, in words of its own.
    if len(text) > _MAX_DIGITS or not _INT.fullmatch(text) or not INT64_MIN <= int(text) <= INT64_MAX:
        raise ValueError(f"'{text}' is not a whole number of 64 bits")
    return int(text)


def parse_real(text: str) -> float:
    """Read a decimal number.

    Raises:
        ValueError: The text is something else, or too large or too close to zero for a real of 64 bits.
    """
    text = text.strip()
    found = _REAL.fullmatch(text)
    if not found:
        raise ValueError(f"'{text}' is not a number")
    value = float(text)
    if math.isinf(value) or (value == 0.0 and found.group(1).strip("0.")):
        raise ValueError(f"'{text}' does not fit into a real of 64 bits")
    return value


def parse_bool(text: str) -> bool:
    """Read a truth value: 0, 1, or true and false in one case.

    Raises:
        ValueError: The text is something else.
    """
    try:
        return TRUTH_VALUES[text.strip()]
    except KeyError:
        raise ValueError(f"'{text}' is not a truth value; use true, false, 1 or 0") from None


def whole_from_text(text: str) -> int:
    """Read a port's whole number, which may be written with a fraction of zero, as in 5.0.

    Raises:
        ValueError: The text is something else.
    """
    fraction = _WHOLE.fullmatch(text.strip())
    return parse_int(fraction.group(1) if fraction else text)


def unsigned(value: int, kind: PortType) -> int:
    """Return a whole number if a type without negative numbers has it.

    Raises:
        ValueError: It has not.
    """
    most = UNSIGNED_MAX[kind]
    if not 0 <= value <= most:
        raise ValueError(f"{value} is not a whole number from 0 to {most}")
    return value


def real_from_text(text: str) -> float:
    """Read a port's number, which may be infinite, as in inf or -infinity.

    Raises:
        ValueError: The text is something else.
    """
    return float(text) if _INFINITY.fullmatch(text.strip()) else parse_real(text)


def literal_value(text: str) -> int | float | str:
    """Return text as a whole number if it reads as one, else as a real, else as it is."""
    for parse in (parse_int, parse_real):
        try:
            return parse(text)
        except ValueError:
            continue
    return text


def number_text(value: float) -> str:
    """Return a number as text, reals with six decimals as C++ does."""
    return f"{value:.6f}" if isinstance(value, float) else str(int(value))


def exact_int(value: float) -> int:
    """Return a number as a whole 64-bit number.

    Raises:
        ValueError: That would change its value.
    """
    if isinstance(value, float) and not value.is_integer():
        raise ValueError(f"{value} is not a whole number")
    whole = int(value)
    if not INT64_MIN <= whole <= INT64_MAX:
        raise ValueError(f"{value} does not fit into 64 bits")
    return whole


def from_text(text: str, kind: PortType, converters: Mapping[Any, Converter]) -> Any:
    """Make a value of a type from text.

    Raises:
        ValueError: The text means no value of this type, or the type has no converter.
    """
    converter = converters.get(kind) or _BUILT_IN.get(kind)
    if converter is not None:
        return converter(text)
    origin: Any = get_origin(kind)
    if origin is list:
        return _list_from_text(text, get_args(kind)[0], converters)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return _enum_from_text(text, kind)
    raise ValueError(f"there is no conversion from text to {type_name(kind)}; register a converter for it")


def split_list(text: str) -> list[str]:
    """Return the items of a list in text, separated by semicolons; one may be at the end."""
    return text.removesuffix(";").split(";") if text else []


def to_type(value: Any, kind: PortType, converters: Mapping[Any, Converter]) -> Any:
    """Convert a value to a type without loss.

    Raises:
        ValueError: The value has no equivalent of this type.
    """
    if kind is None or type(value) is kind:
        return value
    if isinstance(value, str):
        return from_text(value, kind, converters)
    if isinstance(value, bool | int | float):
        return _number_to_type(value, kind)
    origin: Any = get_origin(kind)
    plain = kind if origin is None else origin
    if isinstance(plain, type) and isinstance(value, plain):
        return value
    raise ValueError(f"a value of type {type(value).__name__} is not a {type_name(kind)}")


def _number_to_type(value: float, kind: PortType) -> Any:
    convert = _FROM_NUMBER.get(kind)
    if convert is not None:
        return convert(value)
    if isinstance(kind, type) and isinstance(value, kind):
        return value
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(value)
    raise ValueError(f"{value} is not a {type_name(kind)}")


def _truth_of_number(value: float) -> bool:
    if value not in (0, 1):
        raise ValueError(f"{value} is not a truth value; use 0 or 1")
    return bool(value)


def _status_of_number(value: float) -> Status:
    if value not in range(len(STATUS_NAMES)):
        raise ValueError(f"{value} is not a status; use 0 to {len(STATUS_NAMES) - 1}")
    return Status(int(value))


def _unsigned_of_number(value: float, kind: PortType) -> int:
    return unsigned(exact_int(value), kind)


def _unsigned_from_text(text: str, kind: PortType) -> int:
    return unsigned(whole_from_text(text), kind)


def _list_from_text(text: str, item: PortType, converters: Mapping[Any, Converter]) -> list[Any]:
    if text.startswith("json:"):
        try:
            parsed = json.loads(text.removeprefix("json:"))
        except RecursionError:
            raise ValueError("the JSON is nested too deeply") from None
        if not isinstance(parsed, list):
            raise ValueError(f"'{text}' is not a list")
        if item in (str, int, float):
            # Text and numbers convert to each other elsewhere; in JSON the one is not written for the other.
            for entry in parsed:
                if isinstance(entry, str) != (item is str) or (item is float and isinstance(entry, bool)):
                    raise ValueError(f"{json.dumps(entry)} in '{text}' is not a {type_name(item)}")
        return [to_type(entry, item, converters) for entry in parsed]
    return [from_text(entry, item, converters) for entry in split_list(text)]


def _enum_from_text(text: str, kind: type[Enum]) -> Enum:
    name = text.strip()
    if name in kind.__members__:
        return kind[name]
    return kind(literal_value(name))


_BUILT_IN: Final[dict[Any, Converter]] = {
    str: str,
    int: whole_from_text,
    float: real_from_text,
    bool: parse_bool,
    Status: status_from_name,
    **{kind: partial(_unsigned_from_text, kind=kind) for kind in UNSIGNED_MAX},
}
_FROM_NUMBER: Final[dict[Any, Callable[[Any], Any]]] = {
    str: number_text,
    int: exact_int,
    float: float,
    bool: _truth_of_number,
    Status: _status_of_number,
    **{kind: partial(_unsigned_of_number, kind=kind) for kind in UNSIGNED_MAX},
}
