"""The metacontroller that is meant where a system has several."""

from __future__ import annotations

from collections.abc import Collection

from regraft.bus_schema.suggestions import no_such


class NoMetacontroller(ValueError):
    """A system has no metacontroller at all."""


class NoSuchMetacontroller(ValueError):
    """A system has no metacontroller of that name."""


class WhichMetacontroller(ValueError):
    """A system has several metacontrollers, and none of them is named, or a name that several have."""


def metacontroller(known: Collection[str], name: str) -> str:
    """Return the planner that is meant by its name, or by the last part of it; without a name, the only one.

    >>> metacontroller(["rescuer.metacontrol"], "metacontrol"), metacontroller(["metacontrol"], "")
    ('rescuer.metacontrol', 'metacontrol')

    Raises:
        NoMetacontroller: there is none.
        NoSuchMetacontroller: none has that name.
        WhichMetacontroller: several have that name, or there are several and none is named.
    """
    if not known:
        raise NoMetacontroller(
            "the system has no metacontroller: add a component to its stack that offers planners/{name}/objectives/add"
        )
    if name in known:
        return name
    found = sorted(each for each in known if name in ("", each.rpartition(".")[2]))
    if not found:
        raise NoSuchMetacontroller(no_such("metacontroller", name, known))
    if len(found) > 1:
        raise WhichMetacontroller(f"the system has several metacontrollers: {', '.join(found)}: name one of them")
    return found[0]
