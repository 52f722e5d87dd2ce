"""A module that takes its time."""

from __future__ import annotations

import time

from regraft import Component

time.sleep(3600)


class Late(Component):
    """Comes too late."""
