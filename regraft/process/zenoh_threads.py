"""Has one thread wait for what comes on a component's link and read it, where Zenoh has three.

By itself Zenoh waits for a socket on one thread and reads it on another, of which there are two. One of the two may
hand a message to Python, and wait for an interpreter busy in C code. The other then finds nothing read for a lease. The
link is closed with all that was under way on it (Zenoh 1.10.2: of 300 messages some 200 were lost, in every try). One
reading thread that waits reads on afterwards. And a thread that reads where it waits needs no other to wake it: a round
trip between two components takes a tenth less time.

Not for a hub: one that waits for room on one link would keep all the others from being read. A sample that a component
hands on here goes into a queue, which always has room.
"""

from __future__ import annotations

import os

VARIABLE = "ZENOH_RUNTIME"
"""Read by Zenoh when a process opens its first session; what a user has put there is kept."""
ONE_READS = "(rx: (handover: app), app: (worker_threads: 1))"


def have_one_thread_read() -> None:
    """Set this for the process: before its first session is opened, and never where one is a hub."""
    os.environ.setdefault(VARIABLE, ONE_READS)
