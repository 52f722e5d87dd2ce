"""The user at the other end of a connection, as the kernel reports it: the owner of the client's socket."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Final

from starlette.types import Scope

from regraft.dashboard_api.http.client_connection import CONNECTION
from regraft.dashboard_api.http.sockets import End, Owner, owner

LOOKS: Final = 3
"""How often the kernel is asked: in its list a socket can be missed while others come and go."""
ESTABLISHED, FIN_WAIT1, FIN_WAIT2, CLOSE_WAIT = 1, 4, 5, 8
LINKED: Final = {ESTABLISHED: {ESTABLISHED, FIN_WAIT1, FIN_WAIT2}, CLOSE_WAIT: {FIN_WAIT1, FIN_WAIT2}}
"""The states that the client's end can have, by the state of ours: open, or the client has nothing more to send."""


def user_of(scope: Scope, look: Callable[[End, End], Owner | None] = owner) -> int | None:
    """Return the uid of the user at the other end of a connection, None if the kernel does not know."""
    connection, client, server = scope.get(CONNECTION), scope.get("client"), scope.get("server")
    if connection is None or not client or not server:
        return None
    for _ in range(LOOKS):
        found = look((client[0], client[1]), (server[0], server[1]))
        # Our end is looked at last: a client that has hung up since could have left its address to somebody else.
        if found is not None and found.state in LINKED.get(_state_of(connection), ()):
            return found.uid
    return None


def _state_of(connection: socket.socket) -> int:
    """Return the state of our end of a connection, 0 if it is gone."""
    try:
        return connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0]
    except OSError:
        return 0
