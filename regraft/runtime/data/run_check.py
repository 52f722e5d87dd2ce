"""Finds out which run of a source is its newest, where messages of two runs contradict each other.

A message of a newer run mutes all former ones. If the former continues, it has not ended yet, or the message was false.
The hosts know.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from regraft.bus.interface import Bus, BusError
from regraft.bus.known_runs import ask_hosts, newest_run, runs_shown
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.keys import Keys, component_name

ANSWER_TIMEOUT = 1.0
CHECK_INTERVAL = 1.0
"""Seconds between two checks of one source."""
MAX_SOURCES = 1000
ONLY_RUN = 1
"""The incarnation of programs that no host runs."""
BESIDE = "+"
"""Behind a component's name: a run that does not speak for it."""


class RunCheck:
    """Asks hosts for the runs of sources. ``post`` has something called on the component's thread."""

    def __init__(self, bus: Bus, keys: Keys, name: str, post: Callable[[Callable[[], object]], object]) -> None:
        self._bus = bus
        self._keys = keys
        self._post = post
        self._log = logging.getLogger(name)
        self._next: dict[str, float] = {}
        self.disbelieve: Callable[[str, int], object] = lambda *_: None

    def doubt(self, source: str) -> None:
        """A former run of a source continues: have what comes from runs that there are not disbelieved."""
        now = time.monotonic()
        if now < self._next.get(source, 0.0):
            return
        if len(self._next) >= MAX_SOURCES:
            self._next.clear()
        self._next[source] = now + CHECK_INTERVAL
        threading.Thread(target=self._check, args=(source,), name="run-check", daemon=True).start()

    def _check(self, source: str) -> None:
        try:
            newest = self._newest(source.removesuffix(BESIDE))
        except BusError as error:
            self._log.warning("which run of %s is the newest could not be found out: %s", source, error)
            return
        if newest is not None:
            self._post(lambda: self.disbelieve(source, newest))

    def _newest(self, component: str) -> int | None:
        """Return the newest run of a component that hosts know, else that shows a token. None if no host answers."""
        told = ask_hosts(self._bus, self._keys, ANSWER_TIMEOUT)
        if not told:
            return None
        newest = newest_run(told, component)
        return max(self._shown(component), default=ONLY_RUN) if newest is None else newest

    def _shown(self, component: str) -> set[int]:
        try:
            key = self._keys.alive(component_name(component), "*")
        except SchemaError:
            return set()
        return runs_shown(self._bus.present(key, ANSWER_TIMEOUT)).get(component, set())
