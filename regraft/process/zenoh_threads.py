"""How many of Zenoh's threads read what comes on the links of a process: one in a component, many in a host.

**One** waits for what comes on a component's link and reads it, where Zenoh has three.

By itself Zenoh waits for a socket on one thread and reads it on another, of which there are two. One of the two may
hand a message to Python, and wait for an interpreter busy in C code. The other then finds nothing read for a lease. The
link is closed with all that was under way on it (Zenoh 1.10.2: of 300 messages some 200 were lost, in every try). One
reading thread that waits reads on afterwards. And a thread that reads where it waits needs no other to wake it: a round
trip between two components takes a tenth less time.

A sample that a component hands on here goes into a queue, which always has room.

**Many** in a host, the hub of its components, where Zenoh has two. A thread that reads one link also writes to others,
and waits for room there. It closes links, too. That takes 10 s if the other end has stopped and the kernel has
something left to send by TCP. Two stopped readers would keep all other links from being read.
"""

from __future__ import annotations

import os

VARIABLE = "ZENOH_RUNTIME"
"""Read by Zenoh when a process opens its first session; what a user has put there is kept."""
ONE_READS = "(rx: (handover: app), app: (worker_threads: 1))"
MANY_READ = "(rx: (worker_threads: 16))"


def have_one_thread_read() -> None:
    """Set this for the process: before its first session is opened, and never where one is a hub."""
    os.environ.setdefault(VARIABLE, ONE_READS)


def have_many_threads_read() -> None:
    """Set this for the process of a host: before its first session is opened, and after its zygote has begun.

    Components' processes would inherit it.
    """
    os.environ.setdefault(VARIABLE, MANY_READ)
