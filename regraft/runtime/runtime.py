"""One component, running: its parts, and what acts on them. Loops (``loop``, ``stepped``) decide when it works."""

from __future__ import annotations

import time
from collections.abc import Container
from typing import Any

from regraft.bus.interface import Bus
from regraft.bus_schema.encoding.envelope import is_marker
from regraft.component.component import Component, declared
from regraft.patience import Patience
from regraft.runtime.control import Control
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import Clock
from regraft.runtime.handover.protocol import HandoverProtocol
from regraft.runtime.handover.standby import Standby
from regraft.runtime.handover.transfer import Transfer
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.checkpoints import Checkpoints
from regraft.runtime.lifecycle.connections import Connections
from regraft.runtime.lifecycle.fence import Fence
from regraft.runtime.lifecycle.lifecycle import Lifecycle
from regraft.runtime.lifecycle.measuring import Measuring
from regraft.runtime.lifecycle.periodic import PeriodicCalls
from regraft.runtime.lifecycle.port_rewiring import Rewiring
from regraft.runtime.lifecycle.runtime_kit import RuntimeKit
from regraft.runtime.parts import Parts

MARK_PAUSES = (0.05, 0.2, 0.75)
"""Seconds between the markers that are put on a new link."""
MARK_TIMEOUT = 30.0
"""Seconds for which readers that are known later are looked for."""


class Runtime(Parts):
    """One component, running. Nothing below knows it: they take `Parts`, and each other in the order of this list."""

    def __init__(self, cls: type[Component], assignment: Assignment, bus: Bus, clock: Clock) -> None:
        """Build the component; nothing is declared on the bus yet.

        Raises:
            ParameterError: the assignment's parameters do not fit the class.
            BadMessage: it is to take over from another run, and is a source of time.
        """
        super().__init__(cls, assignment, bus, clock)
        self._unread: set[str] = set()
        self._patience = Patience(MARK_TIMEOUT)
        self.component.kit = RuntimeKit(self)
        of_class = declared(cls)
        # Where the class has the declarations, the instance has the live ports.
        vars(self.component).update({name: self.inputs[name] for name in of_class.inputs})
        vars(self.component).update({name: self.outputs[name] for name in of_class.outputs})
        self.checkpoints = Checkpoints(self)
        self.checkpoint = self.checkpoints.publish
        self.connections = Connections(self)
        self.rewiring = Rewiring(self, self.connections)
        self.marker_listeners.append(self.rewiring.saw_marker)
        measuring = Measuring(self)
        periodic = PeriodicCalls(self, self.checkpoints.publish, measuring)
        self.lifecycle = Lifecycle(self, self.connections, self.rewiring, self.checkpoints, periodic)
        self.fail = self.lifecycle.fail
        self.answering = Answering(self)
        self.fence = Fence(self)
        standing = Standby(self, self.lifecycle, self.answering, self.rewiring.saw_marker, self.take)
        transfer = Transfer(self, self.lifecycle, self.checkpoints)
        self.handover = HandoverProtocol(
            self, self.lifecycle, self.connections, transfer, self.answering, self.fence, standing, self.take
        )
        self.control = Control(
            self,
            self.lifecycle,
            self.rewiring,
            self.handover,
            self.checkpoints,
            self.answering,
            self.fence,
            measuring,
            periodic.retime,
        )
        self.fetching.answer = self.control.answer_meanwhile
        bus.when_renewed(lambda: self.post(self._session_renewed))
        self.presence.link_renewed = lambda: self.post(self._mark)
        self.component.__init__()  # type: ignore[misc]

    def end_goals_of(self, members: tuple[str, ...]) -> None:
        """End the goals of members whose run has ended, and of clients outside of the clock that listen no longer."""
        for server in self.servers:
            server.end_goals_of(members)
        self.end_goals_of_nobody(self.inbound.from_outside)

    def end_goals_of_nobody(self, among: Container[str] | None = None) -> None:
        """End the goals whose clients listen to their replies no longer, of all or ``among`` some."""
        for server in self.servers:
            if server.goals:
                server.end_goals_of_nobody(time.monotonic(), among)

    # --- start and end ---

    def declare(self) -> None:
        """Appear on the bus."""
        self.presence.declare()

    def leave(self) -> None:
        """Disappear from the bus, from any state."""
        self.handover.leave()
        self.presence.disappear()
        self.lifecycle.disconnect()
        self.writers.close_all()
        self.reporter.close()
        self.inbox.close()
        self.compute.close()

    # --- work ---

    def take(self, item: Any) -> None:
        """Take one item from the inbox: a sample, a query, or something to be called on this thread."""
        if callable(item):
            item()
            return
        sample = self.bus.open_sample(item)
        if sample is not None:
            if self.direct and sample.key in self.direct:
                self.direct[sample.key](sample)
            else:
                self.inbound.arrive(sample)
            return
        query = self.bus.open_query(item)
        if query is not None:
            self.control.take(query)
            self.fail_if_wanted()

    def take_unless_data(self, item: Any) -> None:
        """Take one item from the inbox, but drop a topic's message: markers, requests and queries still count."""
        sample = self.bus.open_sample(item)
        if sample is None or self.keys.topic_of(sample.key) is None or is_marker(sample.attachment):
            self.take(item)

    def fire(self) -> None:
        """Call the timers that are due, in order of declaration, then wake the sleepers that are due."""
        now = self.clock.now()
        for timer in self.timers.take_due(now):
            if not self.timers.is_running(timer):
                continue  # the component has failed in one before it
            self.guarded(timer.name, timer.call)
            self.work()
            self.reporter.beat_if_due()  # many timers take long, and only one that does not return hangs
        self.timers.wake_sleepers(now)
        self.work()

    def _session_renewed(self) -> None:
        """Make good what the broken link has lost: publish how far all that is written has come, ask for what is read.

        In lockstep there is no need: each step has how far to read.
        """
        if not self.stepped:
            self._mark()
            self.repair.catch_up(self.inbound.reliable_streams())

    def _mark(self) -> None:
        """Put markers more than once: until readers are known on the new link, what is put reaches nobody."""
        self._unread, self._patience = self.writers.mark_all(), Patience(MARK_TIMEOUT)
        self.spawn("marking", self._mark_for_a_while())

    async def _mark_for_a_while(self) -> None:
        for pause in MARK_PAUSES:
            await self.component.kit.sleep(pause)
            self.writers.mark_all()

    def mark_for_late_readers(self) -> None:
        """Put a marker once a reader is known, also if the author's tasks were cancelled; called at each heartbeat."""
        if self._unread:
            self._unread = set() if self._patience.is_over() else self.writers.mark_all(self._unread)
