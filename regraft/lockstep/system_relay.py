"""The source of time publishes members' reports on themselves: so these have their place among all messages.

The reports come in acknowledgements, which are the same in every run. Nothing is published where nobody reads.
"""

from __future__ import annotations

from regraft.bus.interface import Closable, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.messages.management.system import SystemFault, SystemFaultKind, SystemNews
from regraft.bus_schema.messages.protocol.host import HostStatus
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.system_topics import HOSTS, SYSTEM_TOPICS
from regraft.lockstep.membership import Membership
from regraft.lockstep.step_dispatch import Moment
from regraft.runtime.data.own_news import OwnNews
from regraft.runtime.data.system_view import SystemView
from regraft.runtime.runtime import Runtime


class SystemRelay:
    """The writer of the topics ``system/...`` under simulated time."""

    def __init__(self, runtime: Runtime, membership: Membership, moment: Moment) -> None:
        self._runtime = runtime
        self._membership = membership
        self._moment = moment
        self._view = SystemView()
        self._own = runtime.reporter.news = OwnNews()
        self._topics = {runtime.keys.topic(topic): topic for topic in SYSTEM_TOPICS}
        self._hosts: Closable | None = None
        self._read: tuple[str, ...] = ()

    @property
    def _now(self) -> float:
        return self._moment.time / 1e9

    def take(self, news: SystemNews | None) -> None:
        """Take a member's report from its acknowledgement."""
        if news is not None:
            self._view.take(news, self._now)

    def ended(self, name: str, incarnation: int, kind: SystemFaultKind, why: str) -> None:
        """Take the end of a member's run."""
        self._view.take_fault(SystemFault(self._now, name, incarnation, kind, f"{name}: {why}"))

    def left(self, name: str) -> None:
        """Forget a member that was released, and is no part of the system any more, or of another name's run."""
        self._view.remove(name)

    # --- publishing ---

    def open(self) -> None:
        """Declare the topics that members read; markers then connect the readers.

        Where others are read than before, every member has a step: it learns from it what to report.
        """
        read = tuple(key for key in self._topics if self._membership.readers(key))
        if read == self._read:
            return
        self._read = self._membership.relayed = read
        for member in self._membership.members.values():
            member.due = True
        for key, topic in self._topics.items():
            if key in read and key not in self._runtime.writers.open_keys:
                self._runtime.writers.open(key, type_named(SYSTEM_TOPICS[topic]).encoding)
                if topic == HOSTS:
                    self._listen_to_hosts()

    def connected(self, key: str) -> None:
        """Have a reader that is connected now get the present state at once."""
        topic = self._topics.get(key)
        if topic is not None:
            self._view.changed.add(topic)

    def publish(self) -> None:
        """Publish what is new, in the order of the topics' names."""
        runtime = self._runtime
        self._own.want([self._topics[key] for key in self._read])
        self.take(self._own.take(runtime.reporter.status))
        for topic in sorted(self._view.changed):
            key = runtime.keys.topic(topic)
            writer = runtime.writers.open_keys.get(key)
            if writer is None or key not in self._read:
                self._view.pass_over(topic)
            else:
                try:
                    writer.put(codec.encode(self._view.message(topic, self._now)))
                except SchemaError as error:  # together, news may be larger than a message may be
                    runtime.reporter.fault(topic, error)

    def _listen_to_hosts(self) -> None:
        runtime, key = self._runtime, self._runtime.keys.host(LOCAL, "status")
        runtime.direct[key] = self._take_status
        self._hosts = runtime.bus.subscribe(key, runtime.inbox.put)

    def _take_status(self, sample: Sample) -> None:
        try:
            self._view.take_hosts(codec.decode(sample.payload, HostStatus).others)
        except BadMessage as error:
            self._runtime.reporter.refused(sample.key, "the first host", str(error))
