"""Successors that wait in the middle of a swap until the test makes a file."""

from __future__ import annotations

from pathlib import Path

from regraft import Parameter
from tests.handover.parts import Totaller
from tests.host.parts import KeepingSink
from tests.support.waiting import SECONDS, wait_until


def _wait(said: str, until: str) -> None:
    print(said, flush=True)
    wait_until(Path(until).exists, until)


class HeldTotaller(Totaller):
    """Waits when it gets ready."""

    handler_timeout = SECONDS
    until = Parameter("", "the file that is waited for", unit="path")

    def on_configure(self) -> None:
        super().on_configure()
        _wait("gets ready", self.until)


class HeldTaking(Totaller):
    """Waits when it is to go on."""

    handler_timeout = SECONDS
    until = Parameter("", "the file that is waited for", unit="path")

    def on_activate(self) -> None:
        _wait("takes its time", self.until)


class HeldSink(KeepingSink):
    """Waits when it is to go on."""

    handler_timeout = SECONDS
    until = Parameter("", "the file that is waited for", unit="path")

    def on_activate(self) -> None:
        _wait("takes its time", self.until)
