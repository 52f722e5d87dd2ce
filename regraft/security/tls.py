"""TLS over any carrier: each end shows a certificate of the same authority, and proves that it has the key.

Each end's messages for the other are *flights*, texts of bytes that may be sent by any carrier.
"""

from __future__ import annotations

import ssl
from typing import Any

from regraft.bus.zenoh_config import Tls

MAX_WORD = 4096


class Exchange:
    """One end of a handshake; raises ssl.SSLError for another end that proves nothing."""

    def __init__(self, context: ssl.SSLContext, *, server: bool) -> None:
        """Begin; the client speaks first."""
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = context.wrap_bio(self._incoming, self._outgoing, server_side=server)
        self.done = False

    def take(self, flight: bytes) -> None:
        """Take what the other end has sent, and continue as far as that suffices."""
        self._incoming.write(flight)
        if not self.done:
            try:
                self._tls.do_handshake()
            except ssl.SSLWantReadError:
                return
            self.done = True

    def flight(self) -> bytes:
        """Return what is to be sent to the other end."""
        return self._outgoing.read()

    def say(self, word: bytes) -> None:
        """Send something with the next flight that nobody but the other end can read or change."""
        self._tls.write(word)

    def heard(self) -> bytes:
        """Return what the other end has sent; empty if nothing."""
        try:
            return self._tls.read(MAX_WORD)
        except ssl.SSLWantReadError:
            return b""

    def peer(self) -> dict[str, Any]:
        """Return the other end's certificate, as ``ssl`` spells it."""
        return self._tls.getpeercert() or {}


def context(tls: Tls, *, server: bool) -> ssl.SSLContext:
    """Return what an end proves itself with, and whom it believes; raises OSError, ssl.SSLError for useless files."""
    made = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER if server else ssl.PROTOCOL_TLS_CLIENT)
    made.check_hostname = False
    made.verify_mode = ssl.CERT_REQUIRED
    made.minimum_version = ssl.TLSVersion.TLSv1_3
    if server:
        made.num_tickets = 0
    made.load_verify_locations(tls.authority)
    made.load_cert_chain(tls.certificate, tls.key, password=_no_password)
    return made


def _no_password() -> str:
    """Refuse in place of a key's password: asking for one would wait for a person."""
    raise OSError("the key is protected by a password")


def common_name(certificate: dict[str, Any]) -> str:
    """Return whose certificate it is; empty if it does not name exactly one."""
    names = [value for part in certificate.get("subject", ()) for kind, value in part if kind == "commonName"]
    return str(names[0]) if len(names) == 1 else ""
