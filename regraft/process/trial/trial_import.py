"""Tries authors' modules in a process of their own, before a command imports them itself.

A module may do anything while it is imported: hang, end its process, crash, leave a thread. Only a module that leaves
the trial's process as it was is imported by the command.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from regraft.patience import Patience
from regraft.process import printed
from regraft.process.descendants import LOOK_INTERVAL, kill, nothing_left_behind
from regraft.process.main import NoSuchClass, how_it_ended
from regraft.process.modules import CannotImport
from regraft.process.shutdown import ASKING, ShutdownRequest
from regraft.process.trial.trial_notes import Notes
from regraft.process.trial.trial_process import be_trial

IMPORT_TIMEOUT = 20.0
"""Seconds that importing a module may take: as long as a host gives it for a class that is to be added."""
TELL_TIMEOUT = 2.0
"""Seconds after which the waiting person is shown which module is imported."""

OURS = frozenset({"behavior_tree", "regraft"})
"""The project's own packages, whose imports are known to leave a process as it is."""

Notice = Callable[[str], object]


@dataclass(slots=True)
class Tried:
    """The result of a trial: why modules cannot be imported, and those that were not tried after a time-out."""

    problems: dict[str, str] = field(default_factory=dict)
    untried: list[str] = field(default_factory=list)


def check_classes(paths: Iterable[str], notice: Notice = lambda _: None) -> None:
    """Try the modules of the classes at ``module:Class``; raises NoSuchClass."""
    modules = {path.partition(":")[0]: path for path in paths}
    for module, problem in try_imports(modules, notice).problems.items():
        raise NoSuchClass(f"{modules[module]!r}: {problem}")


def check_imports(modules: Iterable[str], notice: Notice = lambda _: None) -> None:
    """Try modules; raises CannotImport."""
    for problem in try_imports(modules, notice).problems.values():
        raise CannotImport(problem)


def try_imports(modules: Iterable[str], notice: Notice = lambda _: None) -> Tried:
    """Import modules in a process of its own, which has ended with all that they started when this returns.

    ``notice`` gets a line about a module that takes long. Modules that this process has imported, and those of the
    project and of Python itself, are left out. Call it with one thread running.

    Raises:
        KeyboardInterrupt: SIGINT, SIGTERM or SIGHUP came meanwhile.
    """
    tried = Tried()
    waiting = [module for module in dict.fromkeys(modules) if _needs_trial(module)]
    while waiting and not tried.untried:
        notes = Notes()
        code = _try(waiting, notes, notice)
        if code == 0 and notes.finished:
            break
        module = waiting[notes.at]
        tried.problems[module] = notes.problem or _end_in_words(module, notes, code)
        waiting = waiting[notes.at + 1 :]
        if code is None:
            tried.untried = waiting  # they may wait for the same
    return tried


def _needs_trial(module: str) -> bool:
    """Return whether importing a module runs an author's code."""
    package = module.partition(".")[0]
    if module in sys.modules or package in OURS or package in sys.stdlib_module_names:
        return False
    try:
        return package in sys.modules or importlib.util.find_spec(package) is not None
    except (ImportError, ValueError):
        return True


def _end_in_words(module: str, notes: Notes, code: int | None) -> str:
    what = f"what {module!r} registers with atexit" if notes.at_exit else f"importing {module!r}"
    if code is None:
        return f"{what} has not ended within {IMPORT_TIMEOUT:g} s"
    return f"{what} ends the process: {how_it_ended(code)}"


def _try(modules: Sequence[str], notes: Notes, notice: Notice) -> int | None:
    """Return the exit code of a process that imports modules up to the first problem; None if it took too long."""
    with _interruptible(), nothing_left_behind():
        printed.write_out()
        parent = os.getpid()
        signal.pthread_sigmask(signal.SIG_BLOCK, ASKING)  # none may raise in the child before it ends by itself
        pid = -1
        try:
            pid = os.fork()
            if pid == 0:
                be_trial(modules, notes, parent)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING)
            return _wait(pid, modules, notes, notice)
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING)
            _end(pid)


def _end(pid: int) -> None:
    if pid > 0:
        with contextlib.suppress(ChildProcessError):  # it has ended, and its number may be another's by now
            if os.waitpid(pid, os.WNOHANG) == (0, 0):
                kill(pid)
                os.waitpid(pid, 0)


def _wait(pid: int, modules: Sequence[str], notes: Notes, notice: Notice) -> int | None:
    at, began, patience, told = -1, 0.0, Patience(IMPORT_TIMEOUT), False
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if notes.at != at:
            at, began, patience, told = notes.at, time.monotonic(), Patience(IMPORT_TIMEOUT), False
        if patience.is_over():
            return None
        if not told and time.monotonic() - began > TELL_TIMEOUT:
            told = True
            notice(f"importing {modules[at]!r} takes long; it is given {IMPORT_TIMEOUT:g} s, Ctrl-C ends it")
        time.sleep(LOOK_INTERVAL)


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """Have the signals that ask for an end raise KeyboardInterrupt, so that the trial's processes end first."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {signum: signal.getsignal(signum) for signum in ASKING}
    ending = ShutdownRequest()
    ending.hear_signals()
    try:
        with ending.interrupting():
            yield
    finally:
        for signum, handler in before.items():
            if handler is not None:  # None is a handler that Python has not set
                signal.signal(signum, handler)
