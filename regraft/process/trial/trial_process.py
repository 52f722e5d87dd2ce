"""The process of a trial: it imports modules, and looks at what each has left behind."""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

from regraft.process.descendants import LOOK_INTERVAL, adopt_orphans, descendants
from regraft.process.forked import die_with_parent
from regraft.process.main import how_it_ended
from regraft.process.modules import CannotImport, imported, line_of
from regraft.process.shutdown import ASKING
from regraft.process.trial.trial_notes import Notes

SETTLE_TIMEOUT = 0.5
"""Seconds in which threads and processes that an import has started may end of themselves, and copies come back."""
HEARD = (*ASKING, signal.SIGCHLD, signal.SIGALRM)
"""Signals by which commands and hosts are asked, or woken, or would be ended."""


def be_trial(modules: Sequence[str], notes: Notes, parent: int) -> NoReturn:
    """Import modules up to the first with a problem, note that, and end. It is a freshly forked process."""
    code = 1
    try:
        _leave_terminal(parent)
        for index, module in enumerate(modules):
            notes.at = index
            problem = _problem(module, notes)
            if problem:
                notes.note_problem(problem)
                break
        else:
            notes.finish()
        code = 0
    finally:
        os._exit(code)


def _leave_terminal(parent: int) -> None:
    """Let neither Ctrl-C nor what modules print or ask for reach or leave this process."""
    for signum in ASKING:
        signal.signal(signum, _unheard)  # a handler, not SIG_IGN: programs that modules start do not inherit it
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING)
    adopt_orphans()
    die_with_parent(parent)
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        os.dup2(nothing, descriptor)
    os.close(nothing)
    atexit._clear()  # the command's own are none of the trial's


def _unheard(*_: object) -> None:
    pass


def _problem(module: str, notes: Notes) -> str:
    """Import a module; return why a command cannot, empty if it can."""
    before, registered = _Surroundings.now(), atexit._ncallbacks()
    try:
        imported(module, in_copy=notes.note_copy)
    except CannotImport as error:
        return str(error)
    except BaseException as error:
        return f"importing {module!r} failed: {type(error).__name__}: {line_of(error)}"
    changes = _left_running(before, notes) or before.changes()
    if changes:
        return f"importing {module!r} {changes}"
    return _exit_problem(module, notes) if atexit._ncallbacks() != registered else ""


def _exit_problem(module: str, notes: Notes) -> str:
    """Run what modules have registered for the end of the process, in a copy: this process continues."""
    notes.note_exit()
    pid = os.fork()
    if pid == 0:
        try:
            atexit._run_exitfuncs()
            notes.note_return()
        finally:
            os._exit(0)
    _, status = os.waitpid(pid, 0)
    if notes.returned:
        return ""
    return f"what {module!r} registers with atexit ends the process: {how_it_ended(os.waitstatus_to_exitcode(status))}"


@dataclass(frozen=True, slots=True)
class _Surroundings:
    """State that an import may not change, because the rest of the process depends on it."""

    folder: str
    handlers: dict[int, Any]
    blocked: frozenset[int]
    streams: tuple[object, object, object]
    descriptors: dict[int, tuple[int, int]]
    threads: frozenset[threading.Thread]
    processes: frozenset[int]

    @staticmethod
    def now() -> _Surroundings:
        return _Surroundings(
            _folder(),
            {signum: signal.getsignal(signum) for signum in HEARD},
            _blocked(),
            (sys.stdin, sys.stdout, sys.stderr),
            _descriptors(),
            frozenset(threading.enumerate()),
            frozenset(descendants(os.getpid())),
        )

    def changes(self) -> str:
        """Return what an import has changed, as the end of a sentence; empty if nothing."""
        folder = _folder()
        if folder != self.folder:
            return f"changes the working directory to {folder!r}: no import may"
        for signum, handler in self.handlers.items():
            if signal.getsignal(signum) != handler:
                return f"takes {signal.Signals(signum).name} for itself: no import may"
        if _blocked() != self.blocked:
            names = ", ".join(sorted(signal.Signals(signum).name for signum in _blocked() ^ self.blocked))
            return f"blocks or unblocks {names}: no import may"
        if signal.getitimer(signal.ITIMER_REAL)[0]:
            return "leaves an alarm behind, which would end the process: no import may"
        now = _descriptors()
        closed = sorted(number for number, file in self.descriptors.items() if now.get(number) != file)
        if closed:
            return f"closes the file descriptor {closed[0]}, which it has not opened: no import may"
        for name, stream in zip(("stdin", "stdout", "stderr"), self.streams, strict=True):
            if getattr(sys, name, None) is not stream:
                return f"replaces sys.{name}: no import may"
        return ""


def _left_running(before: _Surroundings, notes: Notes) -> str:
    """Return which thread or copy of the process an import has left; both have a moment to end."""
    until = time.monotonic() + SETTLE_TIMEOUT
    while True:
        threads = [thread for thread in threading.enumerate() if not thread.daemon and thread not in before.threads]
        processes = descendants(os.getpid()) - before.processes
        if notes.copied:
            return "forks the process, and the copy comes back from the import: it must end by os._exit"
        if not (threads or processes) or time.monotonic() > until:
            break
        time.sleep(LOOK_INTERVAL)
    if not threads:
        return ""  # a process that goes its own way ends with the system
    return f"leaves a thread running that is no daemon, {threads[0].name!r}: start it in on_configure"


def _folder() -> str:
    try:
        return os.getcwd()
    except OSError:
        return ""


def _blocked() -> frozenset[int]:
    return frozenset(signal.pthread_sigmask(signal.SIG_BLOCK, ())) & frozenset(HEARD)


def _descriptors() -> dict[int, tuple[int, int]]:
    """Return the file that each open descriptor represents."""
    found = {}
    for number in map(int, os.listdir("/proc/self/fd")):
        with contextlib.suppress(OSError):
            status = os.fstat(number)
            found[number] = (status.st_dev, status.st_ino)
    return found
