"""The link of a member to the source of time on its machine."""

from __future__ import annotations

import socket
from collections.abc import Callable
from functools import partial

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import Ack
from regraft.lockstep.step_links.packets import is_of_this_user, packet_socket, receive, send
from regraft.runtime.runtime import Runtime


class MemberLink:
    """At most one link, to the source that listens at the assigned path. ``take`` is called with each packet."""

    def __init__(self, runtime: Runtime, take: Callable[[bytes], object]) -> None:
        self._path = runtime.assignment.step_socket
        self._inbox = runtime.socket_inbox
        self._take = take
        self._link: socket.socket | None = None

    def renew(self) -> None:
        """Connect to the source that listens now: one that had a link to this run would have used it."""
        self.close()
        if self._inbox is None:
            return
        connecting = packet_socket()
        try:
            connecting.connect(self._path)
            trusted = is_of_this_user(connecting)
        except OSError:
            trusted = False
        if not trusted:
            connecting.close()
            return
        self._link = connecting
        self._inbox.watch(connecting, self._read)

    def send(self, ack: Ack) -> bool:
        """Send an acknowledgement; returns whether there is a link, and it took it."""
        return self._link is not None and send(self._link, codec.encode(ack))

    def close(self) -> None:
        """End the link; what was sent still arrives."""
        if self._link is not None and self._inbox is not None:
            self._inbox.forget(self._link)
            self._link.close()
            self._link = None

    def _read(self) -> Callable[[], object] | None:
        assert self._link is not None
        packet = receive(self._link)
        if packet:
            return partial(self._take, packet)
        if packet is not None:
            self.close()
        return None
