"""Further hosts, as a user starts them, and a link to them that can be cut."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

from regraft.bus_schema.messages.protocol.host import HostState
from tests.host.system import ROOT, System
from tests.ports import free_port
from tests.waiting import PATIENCE, wait_until


class Guest:
    """``regraft host --join`` in a process of its own."""

    def __init__(self, endpoint: str, name: str, log: Path, *options: str) -> None:
        self.name = name
        self.log = log
        with log.open("wb") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "regraft.cli", "host", "--join", endpoint, "--name", name, *options],
                stdout=output,
                stderr=output,
                stdin=subprocess.DEVNULL,
                cwd=ROOT,
            )

    def wait_joined(self, system: System) -> None:
        """Wait until the first host has taken it in, and knows what it runs."""

        def joined() -> bool:
            if self.process.poll() is not None:
                raise AssertionError(self.log.read_text())
            return state_of(system, self.name) is HostState.JOINED

        wait_until(joined, f"{self.name} to join")

    def end(self) -> int:
        """End it as Ctrl-C does; returns the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(PATIENCE)
        finally:
            self.process.kill()


def state_of(system: System, host: str) -> HostState | None:
    """Return how the first host sees another."""
    seen = system.client.hosts().get(host)
    return seen.state if seen else None


def wait_state(system: System, host: str, state: HostState) -> None:
    """Wait until the first host sees another so."""
    wait_until(lambda: state_of(system, host) is state, f"{host} to be {state.value}")


class Link:
    """A TCP link that passes everything on, until it is cut: what is then sent is neither delivered nor refused."""

    def __init__(self, target: str) -> None:
        self._target = int(target.rpartition(":")[2])
        self._listening = socket.create_server(("127.0.0.1", free_port()))
        self.endpoint = f"tcp/127.0.0.1:{self._listening.getsockname()[1]}"
        self._whole = threading.Event()
        self._whole.set()
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Deliver nothing any more; neither end is told."""
        self._whole.clear()

    def heal(self) -> None:
        """Deliver again, also what was sent meanwhile."""
        self._whole.set()

    def close(self) -> None:
        """End it."""
        self._whole.set()
        for one in (self._listening, *self._sockets):
            one.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                near.close()
                continue
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                self._whole.wait()
                sink.sendall(data)
        except OSError:
            pass
        for one in (source, sink):
            one.close()


def stop(pid: int) -> None:
    """Stop a process as a debugger or a frozen machine does."""
    os.kill(pid, signal.SIGSTOP)


def go_on(pid: int) -> None:
    """Let it go on."""
    os.kill(pid, signal.SIGCONT)
