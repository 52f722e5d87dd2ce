"""How a host is."""

from __future__ import annotations

from enum import Enum


class HostState(Enum):
    """How a host is for the one that it joined.

    ``absent`` until it joins, ``silent`` while it gives no sign of life, ``left`` after it has ended in good order.
    ``lost`` once it has been silent for so long that its components may be started elsewhere.
    """

    ABSENT = "absent"
    JOINED = "joined"
    SILENT = "silent"
    LOST = "lost"
    LEFT = "left"
