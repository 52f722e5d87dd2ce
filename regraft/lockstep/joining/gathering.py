"""Waits for members before time starts: for those that live as long as it takes, for the others a moment."""

from __future__ import annotations

import threading
from collections.abc import Callable, Set

from regraft.bus.known_runs import runs_shown
from regraft.patience import Patience
from regraft.runtime.runtime import Runtime

TOKENS_TIMEOUT = 5.0
LIST_INTERVAL = 0.5
"""Seconds between two lists of the runs that live."""


class _Alive:
    """The names of the components that show a liveliness token in one of the last two lists; None until there are two.

    A list without this component itself is of a lost link, and means nothing.
    """

    def __init__(self, runtime: Runtime) -> None:
        """List them from now on, on a thread of its own: a busy bus takes its time."""
        self.names: Set[str] | None = None
        self.over = threading.Event()
        self._runtime = runtime
        threading.Thread(target=self._list, name="who-lives", daemon=True).start()

    def _list(self) -> None:
        bus, key = self._runtime.bus, self._runtime.keys.alive("*", "*")
        before: Set[str] = set()
        while not self.over.is_set():
            names = set(runs_shown(bus.present(key, TOKENS_TIMEOUT)))
            if self._runtime.assignment.name in names & before:  # a list of a session that just began may lack some
                self.names = names | before
            before = names
            self.over.wait(LIST_INTERVAL)


def wait_for_members(
    wanted: Set[str],
    joined: Callable[[], Set[str]],
    runtime: Runtime,
    pump: Callable[[], object],
    within: Patience,
    without_sign: Patience,
) -> list[str]:
    """Wait until all that are ``wanted`` have ``joined``; returns those that are missing in the end.

    The time for members ``without_sign`` of life is over only when it is known who lives.
    """
    if wanted <= joined():
        return []
    alive = _Alive(runtime)
    try:
        while missing := wanted - joined():
            hopeless = without_sign.is_over() and alive.names is not None and not missing & alive.names
            if hopeless or within.is_over():
                return sorted(missing)
            pump()
        return []
    finally:
        alive.over.set()
