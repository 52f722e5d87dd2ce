"""The capacity of a machine: more components than it can hold are refused before the first one starts.

The needs are those of a component that does nothing, measured with 200 of them (Python 3.11, Zenoh 1.10.2): what is
refused cannot run. Whether there is enough for what components do is not judged.
"""

from __future__ import annotations

import math
import os
import resource
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from regraft.bus_schema.model.architecture import ComponentSpec

COMPONENT_MEMORY, PROGRAM_MEMORY = 9.0, 1.0
"""MiB of a component's process (8.2 of its own, 0.8 in its host), and of a program's such as ``sleep``."""
COMPONENT_THREADS, PROGRAM_THREADS = 6, 1
COMPONENT_LINKS = 2
"""Files that a host has open for each component's link to its hub."""
LEASE_FILES = 2
"""Files that a joined host has open besides for each component: its lease, and the memory of that."""
OWN_FILES = 32
"""Files that a host has open besides."""
MIN_FILES = 64
"""Files that a process of Regraft may have open at least: below, Zenoh and Python's imports fail in odd ways."""
MEBIBYTE = 2**20
PROC, GROUPS = Path("/proc"), Path("/sys/fs/cgroup")
MEMORY_CONTROL = (("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes"))
"""The files of a control group's limit and use, in version 2 and 1."""
PIDS_CONTROL = (("pids.max", "pids.current"),)
CACHES = ("inactive_file", "active_file", "total_inactive_file", "total_active_file")


class TooMany(Exception):
    """A host cannot hold its components; the text has the arithmetic."""


@dataclass(frozen=True, slots=True)
class Room:
    """A machine's free capacity: ``memory`` in MiB, ``threads``, and ``files`` that this process may have open."""

    memory: float = math.inf
    threads: float = math.inf
    files: float = math.inf


def check(specs: Iterable[ComponentSpec], room: Room | None = None, *, joined: bool = False) -> None:
    """Do nothing if there is room for components, by default on this machine now; raises TooMany.

    On a ``joined`` host each of them holds a lease.
    """
    counted = list(specs)
    programs = sum(not spec.cls for spec in counted)
    links = COMPONENT_LINKS + (LEASE_FILES if joined else 0)
    short = list(_short(len(counted) - programs, programs, links, room or room_here()))
    if short:
        raise TooMany(f"{len(counted)} components are more than this machine can hold: {'; '.join(short)}")


def check_files() -> None:
    """Do nothing if this process may have as many files open as any needs; raises TooMany."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if files != resource.RLIM_INFINITY and files < MIN_FILES:
        raise TooMany(f"only {files} files may be open at once, and {MIN_FILES} are needed: raise 'ulimit -n'")


def _short(components: int, programs: int, links: int, room: Room) -> Iterator[str]:
    memory = components * COMPONENT_MEMORY + programs * PROGRAM_MEMORY
    if memory > room.memory:
        each = f"{COMPONENT_MEMORY:g} each"
        yield f"they need {memory:.0f} MiB of memory, {each}, and {room.memory:.0f} MiB are available"
    threads = components * COMPONENT_THREADS + programs * PROGRAM_THREADS
    if threads > room.threads:
        yield f"they need {threads} threads, {COMPONENT_THREADS} each, and {room.threads:.0f} may be started"
    files = components * links + OWN_FILES
    if files > room.files:
        yield (
            f"their host needs {files} open files, {links} each and {OWN_FILES} more, and may have "
            f"{room.files:.0f} (ulimit -n)"
        )


def room_here(proc: Path = PROC, groups: Path = GROUPS) -> Room:
    """Return what this machine has left, and the control groups of this process; what cannot be read is no bound."""
    memory = [_available(proc), *(left / MEBIBYTE for left in _left(proc, groups, "memory", MEMORY_CONTROL))]
    threads = [*_threads(proc), *_left(proc, groups, "pids", PIDS_CONTROL)]
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return Room(min(memory), min(threads), math.inf if files == resource.RLIM_INFINITY else files)


def _available(proc: Path) -> float:
    """Return the MiB that can be had without taking any from others, swap included."""
    found = _table(proc / "meminfo")
    if "MemAvailable:" not in found:
        return math.inf
    return (found["MemAvailable:"] + found.get("SwapFree:", 0.0)) / 1024


def _threads(proc: Path) -> Iterator[float]:
    """Yield how many threads may be started, by the kernel's bounds and this user's."""
    try:
        running = int((proc / "loadavg").read_text().split()[3].partition("/")[2])
    except (OSError, IndexError, ValueError):
        running = 0
    for name in ("threads-max", "pid_max"):
        most = _number(proc / "sys" / "kernel" / name)
        yield math.inf if most is None else max(0.0, most - running)
    allowed, _ = resource.getrlimit(resource.RLIMIT_NPROC)
    # The kernel does not hold the superuser to it.
    if allowed != resource.RLIM_INFINITY and os.geteuid() != 0:
        yield max(0.0, allowed - _threads_of_user(proc, os.geteuid()))


def _threads_of_user(proc: Path, user: int) -> float:
    tables = (_table(process / "status") for process in proc.iterdir() if process.name.isdigit())
    return sum(table.get("Threads:", 0.0) for table in tables if table.get("Uid:") == user)


def _left(proc: Path, groups: Path, controller: str, control: Iterable[tuple[str, str]]) -> Iterator[float]:
    """Yield what each control group around this process has left of something."""
    for folder in _folders(proc, groups, controller):
        for limit, use in control:
            most, used = _number(folder / limit), _number(folder / use)
            if most is not None and used is not None:
                yield max(0.0, most - used + (_cached(folder) if controller == "memory" else 0.0))


def _folders(proc: Path, groups: Path, controller: str) -> Iterator[Path]:
    """Yield the folders of this process's control groups, from its own to the outermost."""
    try:
        lines = (proc / "self" / "cgroup").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        number, controllers, path = line.split(":", 2)
        if number != "0" and controller not in controllers.split(","):
            continue
        top = groups if number == "0" else groups / controller
        own = top / path.strip("/")
        yield from (folder for folder in (own, *own.parents) if folder.is_relative_to(top))


def _cached(folder: Path) -> float:
    """Return the bytes of a group that the kernel takes back when they are needed: files that it keeps in memory."""
    found = _table(folder / "memory.stat")
    total = "total_inactive_file" in found
    return sum(found.get(name, 0.0) for name in CACHES if name.startswith("total_") == total)


def _table(file: Path) -> dict[str, float]:
    """Return the first number of each line, by the line's first word; empty if there is no such file."""
    try:
        lines = (line.split() for line in file.read_text(errors="replace").splitlines())
    except OSError:
        return {}
    return {line[0]: float(line[1]) for line in lines if len(line) > 1 and line[1].isdigit()}


def _number(file: Path) -> float | None:
    """Return the number in a file, None if it has none, such as ``max``."""
    try:
        return float(int(file.read_text()))
    except (OSError, ValueError):
        return None
