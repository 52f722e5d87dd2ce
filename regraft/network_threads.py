"""Has one thread read a component's link, instead of Zenoh's two.

While one of two hands a message to Python, and waits for an interpreter that is busy in C code, the other finds that
nothing has been read for a lease, and the link is closed with all that was under way on it (Zenoh 1.10.2: of 300
messages some 200 were lost, in every try). One that waits only reads on afterwards.

Not for a hub: one that waits for room on one link would keep all the others from being read.
"""

from __future__ import annotations

import os

VARIABLE = "ZENOH_RUNTIME"
"""Read by Zenoh when a process opens its first session; what a user has put there stands."""
ONE_READS = "(rx: (worker_threads: 1))"


def have_one_thread_read() -> None:
    """Set this for the process: before its first session is opened, and never where one is a hub."""
    os.environ.setdefault(VARIABLE, ONE_READS)
