"""Why a host cannot be reached over TLS is told as it is: silence is no refusal of a certificate."""

from __future__ import annotations

import contextlib
import socket
import ssl
import struct
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from regraft.bus.zenoh_config import Tls
from regraft.security import unreachable
from regraft.security.certificates import make
from regraft.security.unreachable import why_unreachable
from tests.host.moves.labs import certify
from tests.support.machine.ports import free_port
from tests.support.waiting import PATIENCE

YEAR = timedelta(days=365)
RESET = struct.pack("ii", 1, 0)

Answer = Callable[[socket.socket], object]


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take nobody for silent who is only slow to answer."""
    monkeypatch.setattr(unreachable, "LOOK_TIMEOUT", PATIENCE)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of certificates, two of which do not hold now."""
    folder = tmp_path_factory.mktemp("unreachable") / "lab"
    make(folder, ["local", "edge", "old", "early"])
    certify(folder, "old", -2 * YEAR, -YEAR)
    certify(folder, "early", YEAR, 2 * YEAR)
    make(folder.parent / "other", ["edge"])
    return folder


def _tls(lab: Path, name: str) -> Tls:
    return Tls(*(str(lab / file) for file in ("ca.pem", f"{name}.pem", f"{name}.key")))


@contextlib.contextmanager
def answering(answer: Answer, address: str = "127.0.0.1") -> Iterator[int]:
    """Have every connection to a port, which is yielded, handed to a function, and closed afterwards."""
    with socket.create_server((address, free_port())) as listening:

        def serve() -> None:
            with contextlib.suppress(OSError):
                while True:
                    link, _ = listening.accept()
                    with link, contextlib.suppress(OSError):
                        answer(link)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listening.getsockname()[1]
        listening.shutdown(socket.SHUT_RDWR)
        thread.join()


def served_by(tls: Tls, *, asks: bool = True) -> Answer:
    """Return what answers as a hub with some certificate does."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(tls.certificate, tls.key)
    context.load_verify_locations(tls.authority)
    context.verify_mode = ssl.CERT_REQUIRED

    def answer(link: socket.socket) -> None:
        with context.wrap_socket(link, server_side=True) as safe:
            if asks:
                safe.recv(1)

    return answer


def silent(link: socket.socket) -> None:
    """Read all, say nothing."""
    while link.recv(4096):
        pass


def resetting(link: socket.socket) -> None:
    """Reset the connection once something has come."""
    link.recv(1)
    link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)


def closing(link: socket.socket) -> None:
    """Close it once all has come."""
    link.recv(65536)


def babbling(link: socket.socket) -> None:
    """Say something that is no TLS."""
    link.recv(65536)
    link.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (silent, "it does not answer the TLS handshake within 0.5 s"),
        (resetting, "it resets the link during the TLS handshake"),
        (closing, "it closes the link during the TLS handshake"),
        (babbling, "somebody listens there, but does not speak TLS (wrong version number): is it a tcp/ endpoint?"),
    ],
)
def test_what_ends_a_handshake_is_told(lab: Path, answer: Answer, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if answer is silent:
        monkeypatch.setattr(unreachable, "LOOK_TIMEOUT", 0.5)
    with answering(answer) as port:
        assert why_unreachable(f"tls/127.0.0.1:{port}", _tls(lab, "edge")) == text


@pytest.mark.parametrize(
    ("name", "text"),
    [("old", "its certificate has expired on "), ("early", "its certificate is not valid before ")],
)
def test_a_certificate_that_does_not_hold_now_is_told_with_its_date(lab: Path, name: str, text: str) -> None:
    with answering(served_by(_tls(lab, name))) as port:
        assert why_unreachable(f"tls/127.0.0.1:{port}", _tls(lab, "edge")).startswith(text)


def test_a_certificate_that_is_not_for_the_address_is_told_as_that(lab: Path) -> None:
    with answering(served_by(_tls(lab, "local")), "127.0.0.2") as port:
        why = why_unreachable(f"tls/127.0.0.2:{port}", _tls(lab, "edge"))
    assert why == "its certificate is not for '127.0.0.2': was it made with --address 127.0.0.2?"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("old", "it has expired by the clock there"),
        ("early", "is it valid by the clock there?"),
        ("other", "it does not know the authority that has signed it"),
    ],
)
def test_a_refusal_of_our_certificate_is_told_with_its_reason(lab: Path, name: str, text: str) -> None:
    ours = (
        _tls(lab, name)
        if name != "other"
        else replace(_tls(lab.parent / "other", "edge"), authority=str(lab / "ca.pem"))
    )
    with answering(served_by(_tls(lab, "local"))) as port:
        why = why_unreachable(f"tls/127.0.0.1:{port}", ours)
    assert why == f"it does not accept our certificate {ours.certificate}: {text}"


def test_a_link_that_closes_after_the_handshake_is_no_matter_of_secrets(lab: Path) -> None:
    with answering(served_by(_tls(lab, "local"), asks=False)) as port:
        assert "closes the link right after the TLS handshake" in why_unreachable(
            f"tls/127.0.0.1:{port}", _tls(lab, "edge")
        )


@pytest.mark.parametrize("address", ["127.0.0.1:74470", "robot..lab:7447"])
def test_an_address_that_is_none_is_told_as_that(address: str) -> None:
    assert f"'tcp/{address}' is no endpoint" in why_unreachable(f"tcp/{address}", None)
