"""The links of the source of time to the members on its machine."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable
from functools import partial
from pathlib import Path

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.clock import Ack, Step
from regraft.lockstep.step_links.packets import is_of_this_user, packet_socket, receive, send
from regraft.runtime.runtime import Runtime


class SourceLinks:
    """The links over which members have acknowledged, each for one run of a member.

    Args:
        runtime: of the source, whose inbox watches the links.
        take: called with each acknowledgement.
        lost: called with the name of each member whose link has ended.
    """

    def __init__(self, runtime: Runtime, take: Callable[[Ack], object], lost: Callable[[str], object]) -> None:
        self._reporter = runtime.reporter
        self._inbox = runtime.socket_inbox
        self._take = take
        self._lost = lost
        self._listening: socket.socket | None = None
        self._open: set[socket.socket] = set()
        self._links: dict[str, tuple[int, socket.socket]] = {}
        self._linked: dict[str, int] = {}

    def listen(self, path: str) -> None:
        """Have members connect at ``path``. Where nobody can listen, they are all reached over the bus."""
        if self._inbox is None:
            return
        listening = packet_socket()
        try:
            Path(path).unlink(missing_ok=True)  # that of a source that was killed
            listening.bind(path)
            os.chmod(path, 0o600)
            listening.listen()
        except OSError:
            listening.close()
            return
        listening.setblocking(False)
        self._listening = listening
        self._inbox.watch(listening, self._accept)

    def send(self, member: str, step: Step) -> bool:
        """Send a step; returns whether there is a link to that run of the member, and it took the step."""
        incarnation, link = self._links.get(member, (0, None))
        return link is not None and incarnation == step.incarnation and send(link, codec.encode(step))

    def reaches(self, member: str, incarnation: int) -> bool:
        """Return whether there is a link to a run of a member."""
        return self._links.get(member, (0, None))[0] == incarnation

    def may_be_elsewhere(self, member: str, incarnation: int) -> bool:
        """Return whether a run of a member may be on another machine: it has never had a link to this source."""
        return self._listening is not None and self._linked.get(member) != incarnation

    def close(self) -> None:
        """Admit nobody any more, and end all links."""
        self._links.clear()  # no step is under way any more that could get lost
        for link in self._open.copy():
            self._end(link)
        if self._listening is not None and self._inbox is not None:
            self._inbox.forget(self._listening)
            self._listening.close()

    def _accept(self) -> None:
        assert self._listening is not None
        assert self._inbox is not None
        with contextlib.suppress(OSError):  # who wanted to connect may have gone
            link, _ = self._listening.accept()
            if not is_of_this_user(link):
                link.close()
                return
            self._open.add(link)
            self._inbox.watch(link, lambda: self._read(link))

    def _read(self, link: socket.socket) -> Callable[[], None] | None:
        packet = receive(link)
        if packet:
            return partial(self._opened, link, packet)
        if packet is not None:
            self._end(link)
        return None

    def _opened(self, link: socket.socket, packet: bytes) -> None:
        try:
            ack = codec.decode(packet, Ack)
        except BadMessage as error:
            self._reporter.refused("step link", "a member", str(error))
            return
        if link in self._open:
            self._links[ack.member] = (ack.incarnation, link)
            self._linked[ack.member] = ack.incarnation
        self._take(ack)

    def _end(self, link: socket.socket) -> None:
        assert self._inbox is not None
        self._inbox.forget(link)
        link.close()
        self._open.discard(link)
        for name in [name for name, kept in self._links.items() if kept[1] is link]:
            del self._links[name]
            self._lost(name)
