"""Ends a process so that it writes where its main thread is: faulthandler does so on SIGABRT."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal

_tgkill = getattr(ctypes.CDLL(None), "tgkill", None)


def abort(pid: int) -> None:
    """Send SIGABRT to a process's main thread, also to one that is stopped: it is continued.

    Any thread may take a signal to the whole process. The main thread of a stopped one would run on until it does.
    A C library without ``tgkill`` (glibc before 2.30, musl) leaves no other way.
    """
    with contextlib.suppress(PermissionError):  # it is another user's by now, as what sudo runs
        if _tgkill is None:
            os.kill(pid, signal.SIGABRT)
        else:
            _tgkill(pid, pid, signal.SIGABRT)
        os.kill(pid, signal.SIGCONT)
