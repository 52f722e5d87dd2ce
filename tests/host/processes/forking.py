"""A module that starts a process of its own while it is imported, and leaves it to itself."""

from __future__ import annotations

import os
import time

from tests.host.parts import Moody

if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        time.sleep(1000)
    os._exit(0)


class Forking(Moody):
    """Does what it is asked to."""
