"""Zenoh's files in ``/dev/shm``: removed by the last process that used them, which Zenoh leaves to the next one.

Every process that has a file open holds a shared lock on it; the kernel drops the locks of dead processes. A file that
can be locked exclusively is therefore out of use, whichever system or container its users belonged to.
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import os
from functools import cache
from pathlib import Path

FOLDER = Path("/dev/shm")
PATTERN = "*.zenoh"


@cache
def remove_at_exit() -> None:
    """Remove what nobody uses any more when this process exits; not if it is killed, nor by ``os._exit``."""
    atexit.register(_remove_if_still, os.getpid())


def _remove_if_still(pid: int) -> None:
    if os.getpid() == pid:  # a forked child shares the locks of its parent
        remove_unused()


def remove_unused() -> None:
    """Close this process's files, then remove all of this user's that no process uses. Sessions must be closed."""
    for descriptor in _own():
        with contextlib.suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_UN)
    for path in FOLDER.glob(PATTERN):
        with contextlib.suppress(OSError):
            _remove_if_unused(path)


def _own() -> list[int]:
    found = []
    with contextlib.suppress(OSError):
        for name in os.listdir("/proc/self/fd"):
            with contextlib.suppress(OSError):
                if Path(os.readlink(f"/proc/self/fd/{name}")).match(f"{FOLDER}/{PATTERN}"):
                    found.append(int(name))
    return found


def _remove_if_unused(path: Path) -> None:
    """Remove a file if it can be locked; raises OSError if it is in use, gone, or cannot be opened."""
    descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        file = os.fstat(descriptor)
        # A file without a size is being made: its maker may not have locked it yet.
        if file.st_uid != os.getuid() or not file.st_size:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(file, path.lstat()):
            path.unlink()
    finally:
        os.close(descriptor)
