"""A process with the command line imported, forked into commands: importing it takes five times what a start takes.

A command does the same as ever. Only the interpreter's own start is left out, and that of FROG's classes where FROG is
to run. A command is reparented to the process that runs the tests, which is its subreaper, so that it is waited for
like any child.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from tests.support.machine.processes import send
from tests.support.paths import ROOT

PR_SET_CHILD_SUBREAPER = 36
MAX_ORDER = 2**20


class Process:
    """A command that was forked; like ``subprocess.Popen``."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return the exit code if it has ended: of a signal, the negative number."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; returns the exit code, or raises ``subprocess.TimeoutExpired``."""
        if self.poll() is None:
            ended = os.pidfd_open(self.pid)
            try:
                select.select([ended], [], [], timeout)
            finally:
                os.close(ended)
        code = self.poll()
        if code is None:
            raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
        return code

    def send_signal(self, signum: signal.Signals) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            send(self.pid, signum)

    def terminate(self) -> None:
        """Send SIGTERM, unless it has ended."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL, unless it has ended."""
        self.send_signal(signal.SIGKILL)


class Launcher:
    """The tests' end."""

    def __init__(self, stack: str = "") -> None:
        """Start it; the classes of the installed ``stack`` are imported as well."""
        self._lock = threading.Lock()
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.support.launcher", str(theirs.fileno()), stack],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
            )
        atexit.register(self.close)

    def fork(
        self, words: tuple[str, ...], streams: tuple[int, int, int], cwd: Path, environment: Mapping[str, str]
    ) -> Process:
        """Fork a command; ``streams`` are its standard input, output and errors."""
        order = json.dumps({"words": words, "cwd": str(cwd), "environment": dict(environment)})
        with self._lock:  # threads of a test start commands at once, and each needs the number of its own
            socket.send_fds(self._socket, [order.encode()], list(streams))
            return Process(int(self._socket.recv(MAX_ORDER)))

    def close(self) -> None:
        """End it; its commands go on."""
        self._socket.close()
        self._process.wait()


@cache
def launcher(stack: str = "") -> Launcher:
    """Return this process's launcher that has the classes of ``stack`` imported."""
    return Launcher(stack)


def _serve(orders: socket.socket) -> dict[str, Any] | None:
    """Fork for each order; returns it in the command's process, and None at the end in the launcher's."""
    while True:
        data, streams, _, _ = socket.recv_fds(orders, MAX_ORDER, 3)
        if not data:
            return None
        told, tell = os.pipe()
        between = os.fork()
        if between == 0:
            command = os.fork()
            if command == 0:
                orders.close()
                os.close(told)
                os.close(tell)
                for number, stream in enumerate(streams):
                    os.dup2(stream, number)
                    os.close(stream)
                order: dict[str, Any] = json.loads(data)
                return order
            os.write(tell, str(command).encode())
            os._exit(0)
        os.waitpid(between, 0)  # now the command is a child of the subreaper
        orders.send(os.read(told, 20))
        for used in (told, tell, *streams):
            os.close(used)


def _prepare_host() -> None:
    """Do what a host does before it forks, and import what each host runs: each system would do it again."""
    from regraft.adaptation_manager.manager import AdaptationManager
    from regraft.process.common_types import compile_common_types
    from regraft.process.unrepeatable import find_uses

    AdaptationManager.preload()
    compile_common_types()
    find_uses()


def _build_commands() -> None:
    """Import what a command imports first, which each would do again."""
    from typer.main import get_command

    from regraft.cli.extensions import add_extensions
    from regraft.cli.main import build

    app = build()
    add_extensions(app)
    get_command(app).make_context("regraft", ["ps"], resilient_parsing=True)


def _import_classes(stack: str) -> None:
    from regraft.process.main import load_class
    from regraft.process.unrepeatable import find_uses
    from regraft.stack import load
    from regraft.stack.installed import stack_file

    for component in load(stack_file(Path(stack))).architecture.components.values():
        load_class(component.cls)
    find_uses()


def _begin(order: dict[str, Any]) -> None:
    """Make this process what ``python -m regraft.cli`` would be."""
    os.chdir(order["cwd"])
    os.environ.clear()
    os.environ.update(order["environment"])
    sys.argv = [str(ROOT / "regraft" / "cli" / "__main__.py"), *order["words"]]
    added = order["environment"].get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:] = [order["cwd"], *filter(None, added), *(path for path in sys.path[1:] if path not in added)]


if __name__ == "__main__":
    from regraft.cli.main import main

    _build_commands()
    _prepare_host()
    given = None
    with suppress(KeyboardInterrupt):
        if sys.argv[2]:
            _import_classes(sys.argv[2])
        gc.collect()
        gc.freeze()
        given = _serve(socket.socket(fileno=int(sys.argv[1])))
    if given is not None:
        _begin(given)
        main()
