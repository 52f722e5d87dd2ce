"""Looks at the certificates that a host is to show, before it shows them: whose they are, and when they hold."""

from __future__ import annotations

import re
import ssl
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from regraft.bus.zenoh_config import Tls
from regraft.security.tls import Exchange, common_name, context

NO_CHECK_TIME = ssl.VerifyFlags(0x200000)
"""X509_V_FLAG_NO_CHECK_TIME of OpenSSL, for which Python has no name."""

PLACE = re.compile(r"^\[\w+\] | \(_ssl\.c:\d+\)$")
"""Where in Python's own sources an error arose."""


class BadCertificate(Exception):
    """A certificate is of no use; the text states why."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """Whose certificate it is, and from when to when it holds, in seconds since 1970."""

    name: str
    begins: float
    ends: float


def read_own(tls: Tls, *, server: bool) -> Certificate:
    """Return an end's own certificate, as its peer would see it; raises BadCertificate."""
    alone = replace(tls, authority=tls.certificate)
    try:
        ours, peer = context(alone, server=server), context(alone, server=not server)
        peer.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN | NO_CHECK_TIME
        ours.verify_mode = ssl.CERT_NONE
        return certificate_of(_shown(Exchange(ours, server=server), Exchange(peer, server=not server)))
    except ssl.SSLCertVerificationError as error:
        raise BadCertificate(f"{tls.certificate} cannot be used: {error.verify_message}") from None
    except (OSError, ssl.SSLError) as error:
        files = f"{tls.certificate} and {tls.key} must be a certificate and its key, as PEM"
        raise BadCertificate(f"{files}: {reason_of(error)}") from None


def _shown(ours: Exchange, peer: Exchange) -> dict[str, Any]:
    while not (ours.done and peer.done):
        ours.take(peer.flight())
        peer.take(ours.flight())
    return peer.peer()


def reason_of(error: Exception) -> str:
    """Return in words why an operation of ``ssl`` has failed, without the place in its sources."""
    if isinstance(error, ssl.SSLError):
        told = error.reason or PLACE.sub("", str(error.strerror))
        return told.replace("_", " ").lower()
    return str((error.strerror if isinstance(error, OSError) else None) or error)


def certificate_of(told: dict[str, Any]) -> Certificate:
    """Return a certificate that ``ssl`` has reported."""
    begins, ends = (ssl.cert_time_to_seconds(told[key]) for key in ("notBefore", "notAfter"))
    return Certificate(common_name(told), begins, ends)


def why_not_now(certificate: Certificate, present: float) -> str:
    """Return why a certificate does not hold at present, empty if it does."""
    if present > certificate.ends:
        return f"has expired on {_day(certificate.ends)}"
    if present < certificate.begins:
        return f"is not valid before {_day(certificate.begins)}, and it is {_day(present)} here: is the clock right?"
    return ""


def _day(moment: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(moment))


def check_own(tls: Tls, name: str, *, server: bool) -> None:
    """Raise BadCertificate if a host's own certificate is another one's, or does not hold now.

    ``server`` is true for the host that others join.
    """
    own = read_own(tls, server=server)
    again = f"'regraft certificates {Path(tls.certificate).parent} {name}' makes a new one"
    if own.name != name:
        whose = f"of {own.name!r}" if own.name else "of nobody"
        raise BadCertificate(f"{tls.certificate} is the certificate {whose}, host {name!r} needs its own: {again}")
    why = why_not_now(own, time.time())
    if why:
        raise BadCertificate(f"{tls.certificate} {why}; {again}")
    whys = [why_not_now(authority, time.time()) for authority in _authorities(tls)]
    if whys and all(whys):
        raise BadCertificate(f"the authority {tls.authority} {whys[0]}; a new folder gets a new one, for all hosts")


def _authorities(tls: Tls) -> list[Certificate]:
    known = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        known.load_verify_locations(tls.authority)
    except (OSError, ssl.SSLError) as error:
        raise BadCertificate(
            f"{tls.authority} must be certificates of authorities, as PEM: {reason_of(error)}"
        ) from None
    return [certificate_of(told) for told in known.get_ca_certs()]
