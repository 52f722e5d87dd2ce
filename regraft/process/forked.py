"""The start of a freshly forked process: its own end if the parent ends, its log, its program."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import io
import json
import logging
import os
import resource
import signal
import sys
from pathlib import Path
from typing import Any, TextIO

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.process.descendants import RUN_VARIABLE
from regraft.process.logs import begin_anew_if_long
from regraft.process.main import EXIT_BAD_ASSIGNMENT, run_component
from regraft.runtime.core.assignment import Assignment

PR_SET_PDEATHSIG = 1
ASSIGNMENT_VARIABLE = "REGRAFT_ASSIGNMENT"

_libc = ctypes.CDLL(None, use_errno=True)


def die_with_parent(parent: int, by: signal.Signals = signal.SIGKILL) -> None:
    """Get a signal, which kills by default, when the parent's thread that forked this process ends, however it ends."""
    _libc.prctl(PR_SET_PDEATHSIG, by)
    if os.getppid() != parent:
        os._exit(EXIT_BAD_ASSIGNMENT)


def open_log(path: str) -> None:
    """Send what the process prints to its log file; a log grown too large is kept as ``.1`` and begun again."""
    begin_anew_if_long(Path(path))
    try:
        log = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    except OSError as error:
        print(f"cannot write {path}: {error}", file=sys.stderr)
        log = os.open(os.devnull, os.O_WRONLY)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.close(log)
    devnull = os.open(os.devnull, os.O_RDONLY)
    os.dup2(devnull, 0)
    os.close(devnull)
    sys.stdout = _log_stream(1)
    sys.stderr = _log_stream(2)
    logging.raiseExceptions = False
    logging.basicConfig(
        level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s", stream=sys.stderr, force=True
    )
    faulthandler.enable()


class _LogFile(io.RawIOBase):
    """Writes what there is room for: a disk that is full must not fail the component that prints."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def write(self, data: Any) -> int:
        with contextlib.suppress(OSError):
            os.write(self._descriptor, data)
        return len(data)


def _log_stream(descriptor: int) -> TextIO:
    raw: Any = _LogFile(descriptor)
    return io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", line_buffering=True)


def limit_files(most: int | None) -> None:
    """Have this process and all that it starts open at most so many files each; no more than it may have anyway."""
    if most is not None:
        _, allowed = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, wanted))


def be_component(plain: dict[str, Any]) -> int:
    """Run the component that ``plain`` (an Assignment) describes; returns the exit code."""
    assignment = codec.from_plain(plain, Assignment)
    os.environ[RUN_VARIABLE] = f"{assignment.name}/{assignment.incarnation}"
    return run_component(assignment)


def _checkpoint_file(name: str, checkpoint: Snapshot, folder: Path) -> str | None:
    """Return the file with a checkpoint; None where the disk is full: what is there may be of an earlier system."""
    state = folder / f"{name}.checkpoint"
    partial = state.with_name(f".{name}.checkpoint")
    try:
        partial.write_bytes(codec.encode(checkpoint))
        partial.replace(state)
    except OSError as error:
        print(f"{name}: cannot write its checkpoint: {error.strerror}", file=sys.stderr)
        with contextlib.suppress(OSError):
            partial.unlink()
        return None
    return str(state)


def be_program(plain: dict[str, Any], command: list[str], folder: Path) -> int:
    """Become any program; it finds its assignment as JSON in ``REGRAFT_ASSIGNMENT``. Returns only if it cannot.

    A checkpoint is in a file in ``folder``, which a later run replaces.
    """
    assignment = codec.from_plain(plain, Assignment)
    readable = {**plain, "checkpoint": None}
    if assignment.checkpoint is not None:
        file = _checkpoint_file(assignment.name, assignment.checkpoint, folder)
        readable |= {"checkpoint_file": file} if file else {}
    run = f"{assignment.name}/{assignment.incarnation}"
    environment = {**os.environ, ASSIGNMENT_VARIABLE: json.dumps(readable), RUN_VARIABLE: run}
    try:
        os.execvpe(command[0], command, environment)
    except OSError as error:
        print(f"{assignment.name}: cannot run {command[0]!r}: {error.strerror}", file=sys.stderr)
    return EXIT_BAD_ASSIGNMENT
