"""The names in a script."""

import dataclasses
from collections.abc import Collection, Iterator

from ..status import STATUS_NAMES
from .parser import parse
from .syntax import Assignment, Name


def entries_read(text: str, enums: Collection[str], *, extensions: bool = False) -> tuple[str, ...]:
    """Return the entries that a script reads and never assigns, in the order of its text; see `compile_script`.

    Raises:
        ScriptError: The script is not well-formed.
    """
    parts = _parts_in(text, extensions)
    known = {*enums, *(STATUS_NAMES if extensions else ()), *entries_assigned(text, extensions=extensions)}
    return tuple(dict.fromkeys(part.name for part in parts if isinstance(part, Name) and part.name not in known))


def entries_assigned(text: str, *, extensions: bool = False) -> tuple[str, ...]:
    """Return the entries that a script assigns; see `entries_read`."""
    return tuple(dict.fromkeys(part.name for part in _parts_in(text, extensions) if isinstance(part, Assignment)))


def _parts_in(text: str, extensions: bool) -> Iterator[object]:
    """Yield the parts of a script in the order of its text; a long sum is nested too deeply for recursion."""
    pending: list[object] = list(reversed(parse(text, extensions=extensions)))
    while pending:
        part = pending.pop()
        if isinstance(part, tuple):
            pending.extend(reversed(part))
        elif dataclasses.is_dataclass(part):
            yield part
            pending.extend(getattr(part, field.name) for field in reversed(dataclasses.fields(part)))
