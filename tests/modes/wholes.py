"""The modes that an architecture has all of."""

from __future__ import annotations

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.modes.modes import is_in_force


def whole_modes(architecture: Architecture) -> list[str]:
    """Return the modes all of whose changes an architecture has."""
    return [
        name
        for name, changes in architecture.modes.items()
        if is_in_force(codec.from_plain({"changes": changes}, AdaptationRequest).changes, architecture)
    ]
