"""The presence of one run on the bus: its liveliness token, and what it listens to as long as it lives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from regraft.bus import interface
from regraft.bus.inbox import Inbox
from regraft.bus.interface import Bus, Closable
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.quality import Quality
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.data.inbound import Inbound
from regraft.runtime.data.status_reporter import StatusReporter
from regraft.runtime.requests.request_client import RequestClient
from regraft.runtime.requests.request_server import Server


class Presence:
    """The presence of one run on the bus.

    Attributes:
        requirements: how each quality requirement is met, by the key of the query that asks for it.
        link_renewed: called, on some thread, when a host is there again: the link to it was broken.
    """

    def __init__(
        self,
        assignment: Callable[[], Assignment],
        bus: Bus,
        inbox: Inbox,
        inbound: Inbound,
        requests: RequestClient,
        servers: list[Server],
        reporter: StatusReporter,
        *,
        stepped: bool,
    ) -> None:
        self.requirements: dict[str, Quality] = {}
        self.link_renewed: Callable[[], object] = lambda: None
        self._assignment = assignment
        self._bus = bus
        self._keys = Keys(assignment().system)
        self._inbox = inbox
        self._inbound = inbound
        self._requests = requests
        self._servers = servers
        self._reporter = reporter
        self._stepped = stepped
        self._declared: list[Closable] = []
        self._replies: tuple[str, Closable] | None = None
        self._token: Closable | None = None
        self._seen_as: int | None = None
        self._gone_hosts: set[str] = set()

    def declare(self) -> None:
        """Appear on the bus: control queries, replies, services, the token, the first status."""
        self.listen_for_control()
        self.watch_hosts()
        self.listen_for_replies()
        self.listen_for_requests()
        self._reporter.update(revision=self._assignment().revision)
        self.appear()

    def listen_for_control(self) -> None:
        """Answer the control queries of this incarnation."""
        assignment = self._assignment()
        key = self._keys.control(assignment.name, assignment.incarnation, "*")
        self._declared.append(self._bus.serve(key, self._inbox.put))

    def watch_hosts(self) -> None:
        """See hosts come back. In lockstep there is no need: each step has how far to read."""
        if not self._stepped:
            self._declared.append(self._bus.watch(self._keys.host("*", "alive"), self._see_host))

    def _see_host(self, presence: interface.Presence) -> None:
        if not presence.present:
            self._gone_hosts.add(presence.key)
        elif presence.key in self._gone_hosts:
            self._gone_hosts.discard(presence.key)
            self.link_renewed()

    def listen_for_replies(self) -> None:
        """Read the replies to this component's requests, under the name by which it asks now, and under no other.

        The goals of a client whose replies nobody reads are ended.
        """
        if self._replies is not None:
            key, subscription = self._replies
            self._inbound.remove(key)
            subscription.close()
        key = self._keys.reply("**", self._requests.client)
        self._inbound.add(key, self._requests)
        self._replies = key, self._bus.subscribe(key, self._inbox.put)

    def listen_for_requests(self) -> None:
        """Read the requests to this component's services."""
        for server in self._servers:
            key = self._keys.request(server.name)
            self._inbound.add(key, server)
            self._declared.append(self._bus.subscribe(key, self._inbox.put))

    def appear(self) -> None:
        """Show the liveliness token of this incarnation instead of the previous one."""
        assignment = self._assignment()
        if assignment.incarnation == self._seen_as:
            return
        former = self._token
        self._token = self._bus.announce(self._keys.alive(assignment.name, assignment.incarnation))
        self._seen_as = assignment.incarnation
        if former is not None:
            former.close()

    def report_quality(self, quality: Quality) -> None:
        """Publish how a quality requirement is met, and answer queries for it from now on."""
        self._answer_for(quality)
        self._reporter.quality(quality)

    def take_over(self, qualities: tuple[Quality, ...]) -> None:
        """Answer queries for what the run before has reported; here the tasks do not run yet."""
        for quality in qualities:
            self._answer_for(replace(quality, active=False))

    def _answer_for(self, quality: Quality) -> None:
        key = self._keys.quality(quality.requirement)
        if key not in self.requirements:
            self._declared.append(self._bus.serve(key, self._inbox.put))
        self.requirements[key] = quality

    def disappear(self) -> None:
        """Take the token and all that was declared off the bus."""
        if self._token is not None:
            self._token.close()
        if self._replies is not None:
            self._replies[1].close()
        for closable in reversed(self._declared):
            closable.close()
        self._declared.clear()
