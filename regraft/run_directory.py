"""Where a running system keeps its files: ``~/.regraft/SYSTEM`` or ``$REGRAFT_HOME/SYSTEM``.

``run.json`` has how to reach it, and its secret, so only its user may read it. ``lock`` is held while it runs,
``logs/`` has a file per component, and the checkpoints of programs; ``journal.sqlite`` is the adaptation manager's.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO

from regraft.bus.zenoh_config import Endpoints

HOME = "REGRAFT_HOME"
STEP_SOCKET = "steps.sock"
"""Where the source of simulated time exchanges steps with the members on its machine."""

LOOKERS_TIMEOUT = 20
"""Hundredths of a second that a lock is tried for: a command that looks whether a system runs holds it for a moment."""


class AlreadyRunning(Exception):
    """A system of that name is running."""


class NotRunning(Exception):
    """No system of that name is running, or it is not clear which one is meant."""


class NoHome(Exception):
    """There is no folder for the systems' files; the text states what would be right."""


class NoRoom(Exception):
    """The systems' files cannot be read or written; the text states why."""


@dataclass(frozen=True, slots=True)
class RunInfo:
    """How to reach a running system; ``join`` is the endpoint for further hosts, ``host`` the one that wrote this.

    Nobody waits for what comes at ``tools_endpoint``: it gets less if it is too slow. It is empty where there is none.

    ``secret`` proves to its hub that a session belongs to the system.
    """

    system: str
    run: str
    pid: int
    endpoint: str
    stack: str
    simulated: bool
    gateway: str | None = None
    join: str = ""
    host: str = "local"
    secret: str = field(default="", repr=False)
    tools_endpoint: str = ""

    @property
    def hub(self) -> Endpoints:
        """How a session reaches the system's hub, and is admitted."""
        return Endpoints(connect=(self.endpoint,), secret=self.secret)

    @property
    def hub_for_tools(self) -> Endpoints:
        """The same for one that nobody is to wait for."""
        return Endpoints(connect=(self.tools_endpoint or self.endpoint,), secret=self.secret)


def home() -> Path:
    """Return the folder of all systems' folders; raises NoHome."""
    try:
        return Path(os.environ.get(HOME) or Path.home() / ".regraft").absolute()
    except RuntimeError:
        raise NoHome("there is no home folder for the systems' files: set REGRAFT_HOME to a folder, or HOME") from None


def keep_home() -> None:
    """Have a process that is about to change its working folder, and its children, find the same files as before."""
    if os.environ.get(HOME):
        os.environ[HOME] = str(home())


def folder(system: str) -> Path:
    """Return the folder of one system."""
    return home() / system


def lock(system: str) -> IO[str]:
    """Take the system's lock, held until the file is closed or the process ends; raises AlreadyRunning, NoRoom.

    No information of a former run is left then.
    """
    place = folder(system)
    try:
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        place.chmod(0o700)
        (place / "logs").mkdir(exist_ok=True, mode=0o700)
        held = (place / "lock").open("a+")
    except OSError as error:
        raise _no_room("write", place, error) from None
    if not _locked(held):
        held.close()
        info = read_info(system)
        where = f" (process {info.pid}, {info.stack})" if info else ""
        raise AlreadyRunning(
            f"a system named {system!r} is already running{where}: end it with 'regraft down {system}', "
            "or start this one under another name with --system"
        )
    forget_info(system)  # of a run that was killed: a reader would take it for this one
    return held


def unlock(held: IO[str]) -> None:
    """Give a system's lock back, though a process that has just been killed may still have the file open."""
    fcntl.flock(held, fcntl.LOCK_UN)
    held.close()


def _locked(held: IO[str]) -> bool:
    """Take the lock, waiting a moment for those who only look whether somebody holds it."""
    for _ in range(LOOKERS_TIMEOUT):
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except OSError:
            time.sleep(0.01)
    return False


def write_info(info: RunInfo) -> None:
    """Write how to reach the system; raises NoRoom, leaving what was written before."""
    path = folder(info.system) / "run.json"
    fresh = path.with_suffix(".new")
    try:
        fresh.unlink(missing_ok=True)
        with open(fresh, "x", opener=_private) as out:
            out.write(json.dumps(asdict(info), indent=2) + "\n")
        fresh.replace(path)
    except OSError as error:
        fresh.unlink(missing_ok=True)
        raise _no_room("write", path, error) from None


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)


def _no_room(do: str, path: Path, error: OSError) -> NoRoom:
    return NoRoom(f"cannot {do} {path}: {error.strerror}; REGRAFT_HOME names another place")


def forget_info(system: str) -> None:
    """Report that the system has ended."""
    for name in ("run.json", STEP_SOCKET):
        (folder(system) / name).unlink(missing_ok=True)


def read_info(system: str) -> RunInfo | None:
    """Return how to reach a system, None if its file has nothing."""
    try:
        info = RunInfo(**json.loads((folder(system) / "run.json").read_text()))
    except (OSError, ValueError, TypeError, RecursionError):
        return None
    # A signal to process 0 would reach its sender, and one to -1 every process.
    return info if isinstance(info.pid, int) and info.pid > 0 else None


def is_running(system: str) -> bool:
    """Return whether somebody holds the system's lock."""
    try:
        with (folder(system) / "lock").open("a+") as held:
            fcntl.flock(held, fcntl.LOCK_SH | fcntl.LOCK_NB)
            return False
    except FileNotFoundError:
        return False
    except OSError:
        return True


def continues(info: RunInfo) -> bool:
    """Return whether that run of a system has not ended; another one of its name does not count.

    A run has no information in its last moment. Another one has none in its first moments, and counts as this one then.
    """
    now = read_info(info.system)
    return (now is None or now.run == info.run) and is_running(info.system)


def known() -> list[str]:
    """Return the names of the systems that run or have died without a farewell; raises NoRoom."""
    place = home()
    try:
        names = sorted(os.listdir(place))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise _no_room("read", place, error) from None
    return [name for name in names if os.path.exists(place / name / "run.json")]  # False for another user's


def running() -> list[RunInfo]:
    """Return all running systems, by name; raises NoRoom."""
    infos = [read_info(name) for name in known() if is_running(name)]
    return [info for info in infos if info is not None]


def find(system: str | None = None) -> RunInfo:
    """Return the system of that name, or the only one that runs; raises NotRunning, NoRoom."""
    infos = running()
    if system is not None:
        found = next((info for info in infos if info.system == system), None)
        if found is None:
            names = ", ".join(info.system for info in infos) or "none"
            raise NotRunning(f"no system named {system!r} is running; running: {names}")
        return found
    if len(infos) == 1:
        return infos[0]
    if not infos:
        raise NotRunning("no system is running: start one with 'regraft up STACK'")
    names = ", ".join(info.system for info in infos)
    raise NotRunning(f"several systems are running ({names}): choose one with --system")
