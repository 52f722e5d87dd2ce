"""Components on threads of this process."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from regraft.bus.interface import Bus
from regraft.bus_schema.model.lifecycle import State
from regraft.component.component import Component
from regraft.lockstep.member import Member
from regraft.lockstep.source import SourceLoop, TimeSource
from regraft.runtime import loop
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import RealClock, SteppedClock
from regraft.runtime.runtime import Runtime
from tests.support.waiting import PATIENCE


class ComponentThread:
    """A component with its real runtime, on a thread and a session of its own."""

    def __init__(
        self,
        cls: type[Component],
        assignment: Assignment,
        bus: Bus,
        *,
        built: Callable[[Runtime], object] = lambda _: None,
        ended: Callable[[], object] = lambda: None,
    ) -> None:
        """Begin it; ``built`` is called on its thread before it runs, ``ended`` after it has left."""
        self.bus = bus
        self.failure: BaseException | None = None
        self._cls, self._assignment = cls, assignment
        self._on_built, self._on_ended = built, ended
        self._started = threading.Event()
        self.thread = threading.Thread(target=self._run, name=assignment.name, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        clock = SteppedClock() if self._assignment.simulated else RealClock()
        try:
            self.runtime = Runtime(self._cls, self._assignment, self.bus, clock)
            self._on_built(self.runtime)
            self.runtime.post(self._started.set)
            self._live(clock)
            self.runtime.leave()
        except BaseException as error:
            self.failure = error
        finally:
            self._started.set()
        self._on_ended()

    def _live(self, clock: RealClock | SteppedClock) -> None:
        try:
            if isinstance(clock, RealClock):
                loop.run(self.runtime)
            elif isinstance(self.runtime.component, TimeSource):
                SourceLoop(self.runtime, clock, self.runtime.component).run()
            else:
                Member(self.runtime, clock).run()
        except SystemExit:  # it is killed, and can say no more
            self.bus.close()

    def wait_started(self) -> None:
        """Wait until it handles what comes; raises what kept it from that."""
        assert self._started.wait(PATIENCE), f"{self.thread.name} did not start"
        if self.failure:
            raise self.failure

    @property
    def component(self) -> Any:
        """The author's object; look at it, do not touch it."""
        return self.runtime.component

    def shut_down(self) -> None:
        """Begin to shut it down in order."""
        self.runtime.post(lambda: self.runtime.lifecycle.reach(State.FINALIZED))

    def end(self) -> None:
        """Shut it down in order, and wait for its end; raises what went wrong in it."""
        self.shut_down()
        self.join()
        if self.failure:
            raise self.failure

    def kill(self) -> None:
        """End it at once, in the middle of whatever it does, as its process ends that is killed.

        No thread can be killed, so its heavy work ends first: nothing of a killed process acts any more.
        """
        self.runtime.post(self._die)
        self.join()

    def join(self) -> None:
        """Wait until it has ended."""
        self.thread.join(PATIENCE)
        assert not self.thread.is_alive(), f"{self.thread.name} did not end"

    def _die(self) -> None:
        compute = self.runtime.compute
        if compute.under_way:
            ended = threading.Event()
            compute.submit(ended.set)
            assert ended.wait(PATIENCE), f"{self.thread.name} computes without an end"
        raise SystemExit
