"""Keeps strangers off a system's bus: sessions prove that they belong to it, links beyond loopback are encrypted.

Mutual TLS: both ends show a certificate that the lab's own authority (``ca.pem``) has signed. A folder holds them:
``ca.pem``, the secret that all hosts share (``bus.secret``), and for each host ``NAME.pem``, a certificate of NAME, and
``NAME.key``; ``regraft certificates`` makes one.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass
from pathlib import Path

from regraft.bus.interface import BusError
from regraft.bus.zenoh_config import Tls, address_of, host_and_port, on_loopback
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.security import system_secret
from regraft.security.credentials import BadCertificate, check_own
from regraft.security.system_secret import BadSecret

PROTOCOLS = ("tcp", "tls")


class NotSecure(Exception):
    """A link that strangers could use, or that cannot be made safe; the text states what would be right."""


@dataclass(frozen=True, slots=True)
class Guard:
    """How links beyond this machine are to be kept safe: by certificates, or knowingly unencrypted.

    ``secret_file`` holds the secret of the system; without one it is in the folder of the certificates.
    """

    folder: Path | None = None
    insecure: bool = False
    secret_file: Path | None = None

    def secret(self) -> str:
        """Return the secret that hosts share beforehand, empty if there is none; raises NotSecure."""
        file = self.secret_file or (self.folder / system_secret.FILE if self.folder else None)
        try:
            return system_secret.read(file) if file else ""
        except BadSecret as error:
            raise NotSecure(f"{error}{self._how_made(file)}") from None

    def _how_made(self, file: Path | None) -> str:
        if self.secret_file or self.folder is None or file is None or file.exists():
            return ""
        return f"; 'regraft certificates {self.folder} NAME' makes it: copy it to every host"

    def tls(self, name: str) -> Tls | None:
        """Return the certificates of a host; raises NotSecure if the folder has none of it that holds now."""
        if self.folder is None:
            return None
        files = [self.folder / file for file in ("ca.pem", f"{name}.pem", f"{name}.key")]
        missing = ", ".join(file.name for file in files if not file.is_file())
        if missing:
            made = f"regraft certificates {self.folder} {name}"
            raise NotSecure(f"{self.folder} has no {missing}, which host {name!r} needs: make it with '{made}'")
        tls = Tls(*(str(file.resolve()) for file in files))
        try:
            check_own(tls, name, server=name == LOCAL)
        except BadCertificate as error:
            raise NotSecure(str(error)) from None
        return tls

    def check(self, endpoint: str) -> None:
        """Raise NotSecure if a link by an endpoint would not be safe, or if it is no endpoint."""
        protocol = endpoint.partition("/")[0]
        try:
            inside = on_loopback(endpoint)
            if protocol in PROTOCOLS:
                host_and_port(endpoint)
        except BusError as error:
            raise NotSecure(str(error)) from None
        if protocol not in PROTOCOLS:
            raise NotSecure(f"{endpoint}: {protocol!r} is not supported: must be one of {', '.join(PROTOCOLS)}")
        if protocol == "tls" and self.folder is None:
            raise NotSecure(f"{endpoint} needs certificates: name their folder with --tls FOLDER")
        if protocol == "tcp" and self.folder is not None:
            raise NotSecure(
                f"{endpoint} is not encrypted, so --tls has no effect: did you mean tls/{address_of(endpoint)}?"
            )
        if not inside and protocol != "tls" and not self.insecure:
            raise NotSecure(
                f"{endpoint} is open to the network: whoever listens in can command the robot. Use "
                f"tls/{address_of(endpoint)} with --tls FOLDER, or --insecure in a network where everybody is trusted"
            )


def as_reached(endpoint: str) -> str:
    """Return an endpoint as other machines reach it: one that listens everywhere is reached by this one's name."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    return f"{protocol}/{socket.gethostname()}:{port}" if host in ("0.0.0.0", "[::]") else endpoint
