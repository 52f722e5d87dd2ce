"""The request to shut down: from a signal, or from the code that supervises the run."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class ShutdownRequest:
    """A request to shut down what this process runs. Once made it stays.

    An exception alone would not do. Python drops one that a signal raises inside a callback, as after a fork, and loses
    the signal with it.
    """

    def __init__(self) -> None:
        self.wanted = False
        self._interrupts = False
        self._tell: Callable[[], object] | None = None

    def want(self) -> None:
        """Make the request."""
        self.wanted = True
        if self._tell is not None:
            self._tell()

    def when_wanted(self, tell: Callable[[], object]) -> None:
        """Have ``tell`` called with each request, wherever the main thread then is; at once if there was one."""
        self._tell = tell
        if self.wanted:
            tell()

    def hear_signals(self) -> None:
        """Take SIGINT, SIGTERM and SIGHUP, from now on and in the main thread, for the request.

        A SIGHUP that is ignored stays so: that is what ``nohup`` is for.
        """
        for signum in ASKING:
            if signum != signal.SIGHUP or signal.getsignal(signum) is not signal.SIG_IGN:
                signal.signal(signum, self._take)

    def _take(self, signum: int, frame: FrameType | None) -> None:
        self.want()
        if self._interrupts:
            raise KeyboardInterrupt

    @contextmanager
    def interrupting(self) -> Iterator[None]:
        """Do not let a signal wait for what happens here: it raises KeyboardInterrupt.

        So does one that came before, and at the end one whose exception was dropped.
        """
        self._interrupts = True
        try:
            self.check()
            yield
        finally:
            self._interrupts = False
        self.check()

    def check(self) -> None:
        """Raise KeyboardInterrupt if the request was made."""
        if self.wanted:
            raise KeyboardInterrupt
