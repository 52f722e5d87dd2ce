"""Ticks that stop at breakpoints, while the component that ticks continues to answer.

A tick is one call through all nodes. With breakpoints it runs as a greenlet: a stop leaves it as it is, in the middle
of its calls, on the same thread.
"""

from __future__ import annotations

from collections.abc import Callable

from greenlet import getcurrent, greenlet

from behavior_tree import Breakpoint, Breakpoints, Position, Status, Stop, Tree


class Debugging:
    """The breakpoints of the present tree, and the tick that has stopped at one.

    Attributes:
        stop: Where the tick has stopped, None if it has not.
    """

    def __init__(self, note_stop: Callable[[Stop], None]) -> None:
        """Begin without breakpoints; ``note_stop`` is called when a tick stops."""
        self.stop: Stop | None = None
        self._note_stop = note_stop
        self._breakpoints: Breakpoints | None = None
        self._tick: greenlet | None = None

    def follow(self, tree: Tree) -> None:
        """Debug another tree, which has no breakpoints yet."""
        self._breakpoints = Breakpoints(tree, self._stop)

    @property
    def breakpoints(self) -> tuple[Breakpoint, ...]:
        """The breakpoints in the order of the tree's nodes."""
        return self._breakpoints.all if self._breakpoints is not None else ()

    def set(self, wanted: Breakpoint) -> None:
        """Set a breakpoint of the present tree, in place of one at the same place."""
        assert self._breakpoints is not None
        self._breakpoints.set(wanted)

    def remove(self, uid: int, position: Position) -> bool:
        """Remove the breakpoint at a place; return whether there was one."""
        return self._breakpoints is not None and self._breakpoints.remove(uid, position)

    def clear(self) -> None:
        """Remove all breakpoints; a tick that has stopped stays so."""
        if self._breakpoints is not None:
            self._breakpoints.clear()

    def run(self, work: Callable[[], None]) -> None:
        """Run a tick to its end, or to where it stops."""
        if self._breakpoints is None or not self._breakpoints.installed:
            work()
            return
        self._tick = greenlet(work)
        self._switch()

    def resume(self, forced: Status | None, *, to_next: bool = False) -> None:
        """Continue the tick that has stopped, to its end or to where it stops again; ``forced`` is the node's result.

        With ``to_next`` that is before the next node that runs, in this tick or a later one.
        """
        assert self._breakpoints is not None
        self._breakpoints.stepping = to_next
        self._switch(forced)

    def stop_at_next(self) -> None:
        """Stop before the next node that runs."""
        assert self._breakpoints is not None
        self._breakpoints.stepping = True

    def abandon(self) -> None:
        """Forget the tick that has stopped, or that ends now: its nodes see an exit, and run their ``finally``."""
        tick, self._tick, self.stop = self._tick, None, None
        if self._breakpoints is not None:
            self._breakpoints.stepping = False
        if tick is None or tick is getcurrent():
            return
        tick.parent = getcurrent()
        tick.throw()

    def _switch(self, *given: Status | None) -> None:
        tick = self._tick
        assert tick is not None
        self.stop = None
        tick.parent = getcurrent()
        try:
            tick.switch(*given)
        finally:
            if tick.dead:
                self._tick = None

    def _stop(self, stop: Stop) -> Status | None:
        tick = self._tick
        if tick is None:  # it was abandoned, and a node runs on in spite of the exit
            return None
        assert self._breakpoints is not None
        assert tick.parent is not None
        self._breakpoints.stepping = False
        self.stop = stop
        self._note_stop(stop)
        forced: Status | None = tick.parent.switch()
        return forced
