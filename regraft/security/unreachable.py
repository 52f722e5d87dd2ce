"""Finds out why there is no link to an endpoint, after an attempt has failed: in words, from what is seen there now."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Callable

from regraft.bus.interface import BusError
from regraft.bus.zenoh_config import Endpoints, Tls, host_and_port
from regraft.security import system_secret
from regraft.security.credentials import NO_CHECK_TIME, certificate_of, reason_of, why_not_now

LOOK_TIMEOUT = 2.0
NOT_YET_VALID, EXPIRED, OTHER_NAME, OTHER_ADDRESS = 9, 10, 62, 64
"""OpenSSL's codes for faults of a certificate: X509_V_ERR_..."""
BY_ALERT = {
    "UNKNOWN_CA": "it does not know the authority that has signed it",
    "DECRYPT_ERROR": "it does not know the authority that has signed it",
    "CERTIFICATE_EXPIRED": "it has expired by the clock there",
    "UNSUPPORTED_CERTIFICATE": "it is not made for a client",
    "BAD_CERTIFICATE": "is it valid by the clock there?",
}
"""TLS's alerts about a refused certificate of ours."""


def explained(error: BusError, endpoints: Endpoints) -> BusError:
    """Return an error of the bus with the reason, where it is known."""
    endpoint = endpoints.connect[0]
    why = why_unreachable(endpoint, endpoints.tls)
    return BusError(f"cannot reach {endpoint}: {why}") if why else error


def why_unreachable(endpoint: str, tls: Tls | None) -> str:
    """Return in words why there is no link to an endpoint, as far as it can be found from here; empty if it cannot."""
    protocol = endpoint.partition("/")[0]
    if protocol not in ("tcp", "tls"):
        return ""
    try:
        host, port = host_and_port(endpoint)
    except BusError as error:
        return str(error)

    def connected() -> socket.socket:
        return socket.create_connection((host, port), LOOK_TIMEOUT)

    try:
        link = connected()
    except TimeoutError:
        return f"nothing answers there within {LOOK_TIMEOUT:g} s"
    except OSError as error:
        return f"nobody listens there ({error.strerror or error})"
    with link:
        if protocol == "tcp":
            return (
                "a program listens there, but does not admit this one: it is of a system with another secret, "
                "a tls/ endpoint, or no hub at all"
            )
        return _why_no_handshake(link, host, tls, connected) if tls else ""


def _why_no_handshake(link: socket.socket, host: str, tls: Tls, again: Callable[[], socket.socket]) -> str:
    try:
        context = ssl.create_default_context(cafile=tls.authority)
        context.load_cert_chain(tls.certificate, tls.key)
    except (OSError, ssl.SSLError) as error:
        return f"our own certificate {tls.certificate} cannot be used: {reason_of(error)}"
    shaken = False
    try:
        with context.wrap_socket(link, server_hostname=host) as safe:
            shaken = True
            # A refusal of our certificate comes after the handshake; a peer that accepts it waits for us to send.
            safe.settimeout(LOOK_TIMEOUT)
            if not safe.recv(1):
                return "it closes the link right after the TLS handshake: is the system just starting or ending?"
    except ssl.SSLCertVerificationError as error:
        return _why_not_believed(error, host, tls, again)
    except TimeoutError:
        if not shaken:
            return f"it does not answer the TLS handshake within {LOOK_TIMEOUT:g} s"
    except ConnectionResetError:
        return "it resets the link during the TLS handshake"
    except (ssl.SSLEOFError, ssl.SSLZeroReturnError):
        return "it closes the link during the TLS handshake"
    except ssl.SSLError as error:
        return _by_alert(error, tls)
    except OSError as error:
        return f"the link breaks during the TLS handshake ({reason_of(error)})"
    return f"its secret is another one than ours: all hosts need the same {system_secret.FILE}"


def _by_alert(error: ssl.SSLError, tls: Tls) -> str:
    reason = error.reason or ""
    if "ALERT" not in reason:
        return f"somebody listens there, but does not speak TLS ({reason_of(error)}): is it a tcp/ endpoint?"
    for alert, said in BY_ALERT.items():
        if reason.endswith(alert):
            return f"it does not accept our certificate {tls.certificate}: {said}"
    return f"it refuses the TLS handshake ({reason_of(error)})"


def _why_not_believed(
    error: ssl.SSLCertVerificationError, host: str, tls: Tls, again: Callable[[], socket.socket]
) -> str:
    """Return what is wrong with the certificate that the other end has shown."""
    if error.verify_code in (OTHER_NAME, OTHER_ADDRESS):
        return f"its certificate is not for {host!r}: was it made with --address {host}?"
    if error.verify_code not in (EXPIRED, NOT_YET_VALID):
        return f"its certificate is not one that {tls.authority} vouches for: {error.verify_message}"
    try:
        why = _when_not_valid(host, tls, again)
    except (OSError, ssl.SSLError):
        why = ""
    return f"its certificate {why or error.verify_message.removeprefix('certificate ')}"


def _when_not_valid(host: str, tls: Tls, again: Callable[[], socket.socket]) -> str:
    """Return when the other end's certificate holds, empty if it does now: then its authority's does not."""
    context = ssl.create_default_context(cafile=tls.authority)
    context.verify_flags |= NO_CHECK_TIME
    context.load_cert_chain(tls.certificate, tls.key)
    with again() as link, context.wrap_socket(link, server_hostname=host) as safe:
        told = safe.getpeercert()
    return why_not_now(certificate_of(told), time.time()) if told else ""
