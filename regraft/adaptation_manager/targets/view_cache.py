"""The latest answers of components: valid until the next query, since only the manager changes them."""

from __future__ import annotations

import threading

from regraft.bus.interface import Bus, Closable, Presence
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ComponentView


class ViewCache:
    """The last view of each component, while it and its host have been on the bus without a break.

    ``news`` counts the tokens that have come or gone.

    Liveliness tokens go as soon as a process ends, before its host has noticed. A process that hangs keeps its
    token: a request by the remembered view then gets no answer.
    """

    def __init__(self, bus: Bus, system: str) -> None:
        """Watch the tokens of a system; nothing is remembered yet."""
        self._keys = Keys(system)
        self._present: set[str] = set()
        self._views: dict[str, ComponentView] = {}
        self.news = 0
        self._arrived = threading.Condition()
        self._watches: tuple[Closable, ...] = (
            bus.watch(self._keys.alive("*", "*"), self._take),
            bus.watch(self._keys.host("*", "alive"), self._take),
            bus.watch(self._keys.standby("*", "*"), self._take),
        )

    def stands_by(self, component: str, incarnation: int) -> bool:
        """Return whether a component has a standby run, ready to take over or frozen."""
        return self._keys.standby(component, incarnation) in self._present

    def _take(self, presence: Presence) -> None:
        # On a thread of the bus; each line is one operation on a set or dict.
        if presence.present:
            self._present.add(presence.key)
        else:
            self._present.discard(presence.key)
            self._views.clear()
        with self._arrived:
            self.news += 1
            self._arrived.notify_all()

    def wait_for_news(self, known: int, seconds: float) -> None:
        """Wait, on any thread, until there are other ``news`` than are ``known``, for so many seconds at the most."""
        with self._arrived:
            self._arrived.wait_for(lambda: self.news != known, seconds)

    def note(self, view: ComponentView) -> None:
        """Remember a component's answer."""
        self._views[view.component] = view

    def forget(self, component: str) -> None:
        """Rely on nothing that a component answered before."""
        self._views.pop(component, None)

    def view(self, component: str, host: str) -> ComponentView | None:
        """Return a component's last answer, None unless it still holds."""
        view = self._views.get(component)
        if view is None or self._keys.host(host, "alive") not in self._present:
            return None
        return view if self._keys.alive(component, view.incarnation) in self._present else None

    def close(self) -> None:
        """Watch no longer."""
        for watch in self._watches:
            watch.close()
