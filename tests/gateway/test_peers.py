"""The owner of the socket at the other end, read from the kernel's tables as they look on machines of all kinds."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

import pytest

from regraft.dashboard_api.http import authentication
from regraft.dashboard_api.http.authentication import is_own, user_name
from regraft.dashboard_api.http.client_connection import CONNECTION
from regraft.dashboard_api.http.peers import user_of
from regraft.dashboard_api.http.sockets import Owner, asked, listed, owner

HEADING = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
CLIENT, SERVER = ("127.0.0.1", 0xDAC4), ("127.0.0.1", 8000)
HERE, THERE = "0100007F:DAC4", "0100007F:1F40"
MAPPED = "0000000000000000FFFF0000"
SIX = "00000000000000000000000001000000"

pytestmark = pytest.mark.skipif(sys.byteorder == "big", reason="the tables below are those of a little-endian machine")


def row(local: str, remote: str, state: int = 1, uid: int = 1000, inode: int = 8781) -> str:
    return f"   3: {local} {remote} {state:02X} 00000000:00000000 00:00000000 00000000 {uid:5d}        0 {inode} 1 0\n"


@pytest.fixture
def tables(tmp_path: Path) -> Path:
    (tmp_path / "tcp").write_text(HEADING + row("0100007F:1F40", "00000000:0000", 10, 0) + row(THERE, HERE, 1, 0))
    (tmp_path / "tcp6").write_text(HEADING)
    return tmp_path


def add(tables: Path, table: str, text: str) -> None:
    with (tables / table).open("a") as file:
        file.write(text)


def test_the_client_s_own_row_tells_its_user(tables: Path) -> None:
    add(tables, "tcp", row("0100007F:DAC5", THERE, uid=1001) + row(HERE, THERE) + row("0200007F:DAC4", THERE, uid=1002))
    assert listed(CLIENT, SERVER, tables) == Owner(1000, 1)


def test_without_a_row_or_a_table_nothing_is_known(tables: Path) -> None:
    assert listed(CLIENT, SERVER, tables) is None
    assert listed(CLIENT, SERVER, tables / "nowhere") is None


def test_ipv4_through_a_socket_for_ipv6_is_found(tables: Path) -> None:
    add(tables, "tcp6", row(MAPPED + HERE, MAPPED + THERE, uid=1003))
    assert listed(CLIENT, SERVER, tables) == Owner(1003, 1)
    assert listed(("::ffff:127.0.0.1", CLIENT[1]), ("::ffff:127.0.0.1", SERVER[1]), tables) == Owner(1003, 1)


def test_ipv6_is_found(tables: Path) -> None:
    add(tables, "tcp6", row(f"{SIX}:DAC4", f"{SIX}:1F40", uid=1004))
    assert listed(("::1", CLIENT[1]), ("::1", SERVER[1]), tables) == Owner(1004, 1)


@pytest.mark.parametrize("state", [4, 5, 6, 9])
def test_a_socket_that_no_process_holds_is_not_taken_for_root_s(tables: Path, state: int) -> None:
    add(tables, "tcp", row(HERE, THERE, state, uid=0, inode=0))
    assert listed(CLIENT, SERVER, tables) is None


def test_an_address_that_is_none_is_not_looked_for(tables: Path) -> None:
    assert listed(("unix", 0), SERVER, tables) is None
    assert listed(("::1", 1), SERVER, tables) is None


@pytest.mark.parametrize(
    ("served_at", "connected_to", "family"),
    [
        ("127.0.0.1", "127.0.0.1", socket.AF_INET),
        ("127.0.0.1", "::ffff:127.0.0.1", socket.AF_INET6),
        ("::1", "::1", socket.AF_INET6),
    ],
)
def test_asking_and_listing_say_the_same(served_at: str, connected_to: str, family: socket.AddressFamily) -> None:
    served = socket.AF_INET6 if ":" in served_at else socket.AF_INET
    with socket.create_server((served_at, 0), family=served) as listening, socket.socket(family) as there:
        there.connect((connected_to, listening.getsockname()[1]))
        here, client = listening.accept()
        with here:
            ends = client[:2], here.getsockname()[:2]
            assert owner(*ends) == listed(*ends) == Owner(os.geteuid(), 1)
            assert asked(*ends) in (None, listed(*ends))
            there.close()
            assert owner(*ends) is None
    assert asked(("127.0.0.1", 1), ("127.0.0.1", 2)) is None
    assert asked(("no address", 1), ("127.0.0.1", 2)) is None


def test_the_state_of_our_end_must_fit_the_client_s(tables: Path) -> None:
    listening = socket.create_server(("127.0.0.1", 0))
    there = socket.create_connection(listening.getsockname())
    here, client = listening.accept()
    server = listening.getsockname()
    scope = {CONNECTION: here, "client": client, "server": server}
    with listening, there, here:
        assert user_of(scope) == os.geteuid()
        there.shutdown(socket.SHUT_WR)
        assert here.recv(1) == b""
        assert user_of(scope) == os.geteuid()
        # Somebody else has the client's address now, as far as the table says.
        (tables / "tcp").write_text(HEADING + row(f"0100007F:{client[1]:04X}", f"0100007F:{server[1]:04X}"))
        assert user_of(scope, lambda client, server: listed(client, server, tables)) is None
    assert user_of(scope) is None
    assert user_of({"client": CLIENT, "server": SERVER}) is None
    assert user_of({CONNECTION: None, "client": None, "server": None}) is None


@pytest.mark.parametrize(
    ("uid", "own", "may"),
    [(0, 0, True), (0, 1000, True), (1000, 1000, True), (1001, 1000, False), (1000, 0, False), (65534, 65534, False)],
)
def test_root_and_the_gateway_s_own_user_may_act(
    uid: int, own: int, may: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "overflowuid").write_text("65534\n")
    monkeypatch.setattr(authentication, "OVERFLOW", tmp_path / "overflowuid")
    assert is_own(uid, own) is may


def test_a_user_without_a_name_is_its_number() -> None:
    assert user_name(0) == "uid 0 root"
    assert user_name(3_999_999_999) == "uid 3999999999"
