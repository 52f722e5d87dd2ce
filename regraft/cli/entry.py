"""Begins the command line: an interrupt ends it without a traceback, also while it is still imported."""

from __future__ import annotations

import gc
import os
import signal
import sys
from types import FrameType

from regraft.cli.outcomes import INTERRUPTED


def main() -> None:
    """Run the command line of this process."""
    heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if heard:
        signal.signal(signal.SIGINT, _end)
    try:
        # Imported here: this takes most of a second, in which an interrupt may come.
        gc.disable()  # an import leaves hardly any garbage, and looking for it takes an eighth of the time
        from regraft.cli.main import main as run

        gc.freeze()
        gc.enable()
        if heard:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _end(_signal: int, _frame: FrameType | None) -> None:
    """End at once: modules half imported may drop an exception, or show it. Nothing has begun that must end."""
    os._exit(INTERRUPTED)
