"""A component that holds what only one process can hold, really: a TCP port and a locked file."""

from __future__ import annotations

import fcntl
import socket
from pathlib import Path

from regraft import Parameter, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import Resources
from tests.handover.parts import Ask, Item, Totaller


class Holder(Totaller):
    """Adds up, and holds a port and a lock while it is configured."""

    exclusive = True

    port = Parameter(0, minimum=0, maximum=65535, read_only=True)
    lock = Parameter("", unit="path", read_only=True)

    def on_configure(self) -> None:
        super().on_configure()
        self._file = Path(self.lock).open("a")  # noqa: SIM115
        self._socket = socket.socket()
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._socket.bind(("127.0.0.1", self.port))
            self._socket.listen()
        except OSError:
            self._release()
            raise

    def on_cleanup(self) -> None:
        self._release()

    def on_shutdown(self) -> None:
        if hasattr(self, "_file"):
            self._release()

    def on_error(self) -> None:
        self._release()

    def _release(self) -> None:
        self._file.close()
        self._socket.close()

    @service("held")
    def held(self, ask: Ask) -> Item:
        """Say which port it holds."""
        return Item(self._socket.getsockname()[1])


class Arm(Holder):
    """Holds the same, and says so by naming a device."""

    exclusive = False
    resources = Resources(devices=("arm",))


class Lame(Holder):
    """Takes hold, and then cannot be activated."""

    def on_activate(self) -> None:
        raise RuntimeError("cannot get up")


class Clumsy(Holder):
    """Does not let go as it should."""

    def on_cleanup(self) -> None:
        self._release()
        raise RuntimeError("dropped it")


class Mute(Holder):
    """Goes on from a state, and gives none."""

    def snapshot(self) -> PlainValue:
        raise RuntimeError("cannot say how I am")
