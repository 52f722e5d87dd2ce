"""Reads what components may use: ``limits`` of a component, or of the whole stack."""

from __future__ import annotations

import re

from regraft.bus_schema.encoding.codec import from_plain, to_plain
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Limits
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section

UNITS = {"kB": 1e3, "KiB": 2.0**10, "MB": 1e6, "MiB": 2.0**20, "GB": 1e9, "GiB": 2.0**30}
AMOUNT = re.compile(rf"(\d+(?:\.\d+)?) ?({'|'.join(UNITS)})")
MAX_SHOWN_LENGTH = 80


def read_limits(section: Section) -> Limits:
    """Return the limits that ``limits`` gives, none where it is absent."""
    if "limits" not in section:
        return Limits()
    inner = section.section("limits")
    inner.only("memory", "files", "handler_timeout")
    node = inner.node("files")
    files = None if node is None else inner.integer("files", 32, 1, 2**31)
    limits = Limits(read_memory(inner, "memory"), files, inner.number("handler_timeout"))
    try:
        # The bounds are part of the limits' definition, and are checked where they are packed.
        return from_plain(to_plain(limits), Limits)
    except BadMessage as error:
        inner.wrong(".".join(error.where), error.why)
        return Limits()


def read_memory(section: Section, key: str) -> float | None:
    """Return an amount of memory in MiB, None by default; a number is one of MiB, a text has its unit."""
    node = section.node(key)
    if node is None or not isinstance(node.value, str):
        return section.number(key)
    match = AMOUNT.fullmatch(node.value)
    if match is None:
        shown = str(plain(node))[:MAX_SHOWN_LENGTH]
        section.wrong(key, f"must be an amount such as '512 MB' ({', '.join(UNITS)}) or a number of MiB, is {shown!r}")
        return None
    return float(match[1]) * UNITS[match[2]] / UNITS["MiB"]
