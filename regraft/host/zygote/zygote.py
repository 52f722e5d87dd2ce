"""The zygote: a process with everything imported and nothing running, forked into components within milliseconds.

It is forked before the host opens its session, keeps to one thread, and reports how its children end: the host is not
their parent. However the host ends, the zygote notices. It then kills all that was started below it, also what has left
its group and its parent. A kill of the zygote kills the components.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from regraft import run_directory
from regraft.host.zygote import frames
from regraft.host.zygote.describe_process import be_describer
from regraft.host.zygote.estimate_process import be_estimator
from regraft.patience import Patience
from regraft.process import forked, printed
from regraft.process.abort import abort
from regraft.process.descendants import END_TIMEOUT, LOOK_INTERVAL, adopt_orphans, end_descendants, end_run
from regraft.process.main import EXIT_FAULT

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that ask a process to end: the zygote ignores them, its children do not."""
LOOK_AFTER_PARENT_INTERVAL = 1.0
"""Seconds after which the zygote looks whether its host lives, should nothing else have shown it."""


class Zygote:
    """The host's end of the line to the zygote."""

    def __init__(self, line: socket.socket, pid: int) -> None:
        """Take over the line; use ``start_zygote``."""
        self.pid = pid
        self._line = line

    def spawn(
        self, assignment: dict[str, Any], folder: str, log: str, command: list[str] | None, files: int | None = None
    ) -> None:
        """Start a component or program in ``folder``; ``started`` and ``ended`` are reported to the reader.

        Each of its processes may have so many ``files`` open; None leaves it at what this process may have.
        """
        order = {"assignment": assignment, "folder": folder, "log": log, "command": command, "files": files}
        frames.send(self._line, order)

    def describe(self, name: str, order: dict[str, Any], folder: str, log: str) -> None:
        """Start a process of ``regraft.host.zygote.describe_process``; it is reported as a component is."""
        assignment = {"name": name, "incarnation": 0}
        frames.send(self._line, {"assignment": assignment, "describe": order, "folder": folder, "log": log})

    def signal(self, pid: int, signum: int) -> None:
        """Send a signal to a child, unless it has ended; a zygote that is gone has none."""
        with contextlib.suppress(OSError):
            frames.send(self._line, {"signal": signum, "pid": pid})

    def abort(self, pid: int) -> None:
        """Have a child write where it is and end, unless it has ended; this is reported. See ``process.abort``."""
        with contextlib.suppress(OSError):
            frames.send(self._line, {"abort": pid})

    def reports(self, take: Callable[[dict[str, Any]], object]) -> None:
        """Hand every report to ``take`` until the zygote is gone; for a thread of its own."""
        while (report := frames.receive(self._line)) is not None:
            take(report)

    def close(self) -> None:
        """End the zygote and, before it, all that was started below it and still runs. Again does nothing."""
        if not self.pid:
            return
        pid, self.pid = self.pid, 0
        with contextlib.suppress(OSError):
            self._line.shutdown(socket.SHUT_RDWR)  # closing alone would leave the reader waiting
        self._line.close()
        with contextlib.suppress(ProcessLookupError, ChildProcessError):
            patience = Patience(END_TIMEOUT + 1.0)
            while os.waitpid(pid, os.WNOHANG) == (0, 0):
                if patience.is_over():
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
                    return
                time.sleep(LOOK_INTERVAL)


def start_zygote() -> Zygote:
    """Fork the zygote. Call it with one thread running and no session open."""
    ours, theirs = socket.socketpair()
    parent = os.getpid()
    printed.write_out()
    pid = os.fork()
    if pid:
        theirs.close()
        return Zygote(ours, pid)
    code = 1
    try:
        ours.close()
        adopt_orphans()
        signal.signal(signal.SIGCHLD, lambda *_: None)
        forked.die_with_parent(parent, by=signal.SIGCHLD)  # wakes it, and it finds the line closed
        try:
            _serve(theirs, parent)
        finally:
            end_descendants()
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def _serve(line: socket.socket, parent: int) -> None:
    for ignored in ENDING:
        signal.signal(ignored, signal.SIG_IGN)
    wake_reader, wake_writer = os.pipe()
    os.set_blocking(wake_writer, False)
    os.set_blocking(wake_reader, False)
    signal.set_wakeup_fd(wake_writer, warn_on_full_buffer=False)
    alive: dict[int, tuple[str, int]] = {}
    sources: list[Any] = [line, wake_reader]
    while True:
        readable, _, _ = select.select(sources, [], [], LOOK_AFTER_PARENT_INTERVAL)
        if os.getppid() != parent:
            return
        if wake_reader in readable:
            _drain(wake_reader)
            _reap(line, alive)
        if line in readable:
            order = frames.receive(line)
            if order is None:
                return
            _obey(order, line, alive, (wake_reader, wake_writer))


def _obey(order: dict[str, Any], line: socket.socket, alive: dict[int, tuple[str, int]], pipe: tuple[int, int]) -> None:
    if "signal" in order:
        if order["pid"] in alive:
            with contextlib.suppress(PermissionError):  # it is another user's by now, as what sudo runs
                os.kill(order["pid"], order["signal"])
        return
    if "abort" in order:
        if order["abort"] in alive:
            abort(order["abort"])
            name, incarnation = alive[order["abort"]]
            frames.send(line, {"aborted": order["abort"], "name": name, "incarnation": incarnation})
        return
    assignment = order["assignment"]
    name, incarnation = assignment["name"], assignment["incarnation"]
    zygote = os.getpid()
    printed.write_or_drop()
    # A child may be asked to end before it hears signals: an ignored one would be lost, a blocked one waits.
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        pid = os.fork()
    except OSError as error:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        sys.stderr.write(f"cannot start {name}: {error.strerror}\n")
        frames.send(line, {"ended": 0, "name": name, "incarnation": incarnation, "code": EXIT_FAULT})
        return
    if pid == 0:
        _be_child(order, line, zygote, pipe)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    alive[pid] = (name, incarnation)
    frames.send(line, {"started": pid, "name": name, "incarnation": incarnation})


def _be_child(order: dict[str, Any], line: socket.socket, zygote: int, pipe: tuple[int, int]) -> None:
    code = 1
    try:
        signal.set_wakeup_fd(-1)
        for fallback in (*ENDING, signal.SIGCHLD):
            signal.signal(fallback, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        forked.die_with_parent(zygote)
        os.setpgid(0, 0)
        line.close()
        for descriptor in pipe:
            os.close(descriptor)
        order["log"] = os.path.abspath(order["log"])
        forked.open_log(order["log"])
        run_directory.keep_home()
        os.chdir(order["folder"])
        forked.limit_files(order.get("files"))
        code = _act(order)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _act(order: dict[str, Any]) -> int:
    if "describe" in order:
        asked = order["describe"]
        return be_estimator(asked) if "estimate" in asked else be_describer(asked)
    if order["command"]:
        return forked.be_program(order["assignment"], order["command"], Path(order["log"]).parent)
    return forked.be_component(order["assignment"])


def _drain(reader: int) -> None:
    try:
        while os.read(reader, 4096):
            pass
    except BlockingIOError:
        pass


def _reap(line: socket.socket, alive: dict[int, tuple[str, int]]) -> None:
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if pid == 0:
            return
        if pid not in alive:  # it had lost its own parent
            continue
        name, incarnation = alive.pop(pid)
        _end_group(pid)
        if _has_adopted(alive):
            end_run(f"{name}/{incarnation}", os.getpid())
        code = os.waitstatus_to_exitcode(status)
        frames.send(line, {"ended": pid, "name": name, "incarnation": incarnation, "code": code})


def _end_group(leader: int) -> None:
    """End what a program started and left behind: every child leads a process group of its own."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)


def _has_adopted(alive: dict[int, tuple[str, int]]) -> bool:
    """Return whether there are children that this process has not started itself; also if that is unknown."""
    try:
        found = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    except OSError:
        return True
    return not alive.keys() >= set(map(int, found))
