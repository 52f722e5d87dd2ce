"""Hosts beyond this machine: only over links that both ends prove themselves on, or knowingly without."""

from __future__ import annotations

import stat
from datetime import timedelta
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.security.access import Guard, NotSecure
from regraft.security.certificates import CannotMake, make
from regraft.security.system_secret import make as make_secret
from tests.cli.app import whole
from tests.host.moves.labs import certify
from tests.host.several import TICKER, WAIT, Site
from tests.support import paths
from tests.support.commands import run
from tests.support.machine.ports import free_port
from tests.support.machine.processes import children_of

pytestmark = pytest.mark.slow

YEAR = timedelta(days=365)
FROG = str(paths.FROG)


def _host(*arguments: str) -> tuple[int, str]:
    done = run("host", *arguments)
    return done.returncode, done.stderr


def _labs(folder: Path) -> tuple[Path, Path, Path]:
    """Return a lab, another one, and one that trusts the first but has the other's certificates."""
    right, other, mixed = folder / "right", folder / "other", folder / "mixed"
    make(right, ["local", "edge"])
    make(other, ["local", "edge"])
    mixed.mkdir()
    (mixed / "ca.pem").write_bytes((right / "ca.pem").read_bytes())
    make_secret(mixed / "bus.secret")
    for file in ("edge.pem", "edge.key"):
        (mixed / file).write_bytes((other / file).read_bytes())
    return right, other, mixed


def test_a_host_joins_over_tls_with_the_right_certificate_and_with_no_other(site: Site) -> None:
    right, other, mixed = _labs(site.folder)
    port = free_port()
    system = site.up(TICKER, WAIT, "--listen", f"tls/0.0.0.0:{port}", "--tls", str(right))
    endpoint = f"tls/127.0.0.1:{port}"
    for options, code, text in (
        ((endpoint,), 2, "needs certificates"),
        ((endpoint, "--tls", str(other)), 3, "its certificate is not one that"),
        ((endpoint, "--tls", str(mixed)), 3, "it does not accept our certificate"),
        ((f"tcp/127.0.0.1:{port}",), 3, "does not admit this one"),
    ):
        returned, said = _host("--name", "edge", "--join", *options)
        assert text in said
        assert returned == code
    guest = site.join("edge", endpoint, "--tls", str(right))
    site.wait_active("ticker")
    assert site.pid("ticker") in children_of(guest.process.pid)
    assert system.info.endpoint.startswith("tcp/127.0.0.1:"), "its own components need no certificate"


@pytest.mark.parametrize(
    ("endpoint", "guard", "text"),
    [
        ("tcp/0.0.0.0:7447", Guard(), "--insecure"),
        ("tcp/192.0.2.7:7447", Guard(), "tls/192.0.2.7:7447 with --tls FOLDER"),
        ("tcp/robot:7447", Guard(), "--insecure"),
        ("tls/0.0.0.0:7447", Guard(), "needs certificates"),
        ("tcp/127.0.0.1:7447", Guard(Path("/lab")), "did you mean tls/127.0.0.1:7447"),
        ("udp/192.0.2.7:7447", Guard(), "'udp' is not supported"),
        ("unixsock-stream//tmp/hub", Guard(), "'unixsock-stream' is not supported"),
        ("7447", Guard(), "is no endpoint"),
        ("tls/0.0.0.0:74470", Guard(Path("/lab")), "with a port from 1 to 65535"),
        ("tcp/127.0.0.1:0", Guard(), "with a port from 1 to 65535"),
        (f"tcp/127.0.0.1:{'9' * 5000}", Guard(), "with a port from 1 to 65535"),
        ("tcp/127.0.0.1", Guard(), "with a port from 1 to 65535"),
        ("tls/robot..lab:7447", Guard(Path("/lab")), "'robot..lab' is no name of a host"),
        (f"tcp/{'a' * 64}.lab:7447", Guard(insecure=True), "is no name of a host"),
    ],
)
def test_an_open_door_is_refused_with_what_would_be_right(endpoint: str, guard: Guard, text: str) -> None:
    with pytest.raises(NotSecure, match=text):
        guard.check(endpoint)


@pytest.mark.parametrize(
    ("endpoint", "guard"),
    [
        ("tcp/127.0.0.1:7447", Guard()),
        ("tcp/[::1]:7447", Guard()),
        ("tcp/0.0.0.0:7447", Guard(insecure=True)),
        ("tls/0.0.0.0:7447", Guard(Path("/lab"))),
    ],
)
def test_what_is_safe_or_wanted_is_taken(endpoint: str, guard: Guard) -> None:
    guard.check(endpoint)


def _refusal(*words: str) -> str:
    """Return why a command is refused before anything begins, in this process."""
    done = CliRunner().invoke(whole(), words)
    assert done.exit_code == 2, (done.output, done.exception)
    return done.stderr


def test_up_refuses_to_listen_to_everybody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    said = _refusal("up", FROG, "--headless", "--listen", "tcp/0.0.0.0:7447")
    assert "whoever listens in can command the robot" in said


@pytest.mark.parametrize(
    ("address", "text"),
    [("0.0.0.0:74470", "with a port from 1 to 65535"), ("robot..lab:7447", "'robot..lab' is no name of a host")],
)
def test_an_address_that_is_none_is_refused_by_each_command(
    address: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    make_secret(tmp_path / "bus.secret")
    assert text in _refusal("up", FROG, "--headless", "--listen", f"tls/{address}", "--tls", str(tmp_path))
    assert text in _refusal("host", "--join", f"tls/{address}", "--name", "edge", "--tls", str(tmp_path))
    assert text in _refusal("host", "--join", f"tcp/{address}", "--name", "edge", "--insecure")


def test_keys_are_readable_by_their_owner_alone_and_the_authority_is_kept(tmp_path: Path) -> None:
    make(tmp_path / "lab", ["local"])
    authority = (tmp_path / "lab" / "ca.pem").read_bytes()
    make(tmp_path / "lab", ["edge"], ["192.0.2.7", "robot.example"])
    assert (tmp_path / "lab" / "ca.pem").read_bytes() == authority
    for key in (tmp_path / "lab").glob("*.key"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600
    with pytest.raises(CannotMake, match="authority"):
        make(tmp_path / "lab", ["ca"])
    (tmp_path / "lab" / "ca.key").unlink()
    with pytest.raises(CannotMake, match="but not both"):
        make(tmp_path / "lab", ["arm"])


@pytest.mark.parametrize("address", ["10.0.0.5,10.0.0.6", "two words", "name:7447", ""])
def test_a_certificate_that_cannot_be_made_leaves_all_files_as_they_were(tmp_path: Path, address: str) -> None:
    make(tmp_path, ["arm"])
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(CannotMake, match="neither an IP address nor the name of a host"):
        make(tmp_path, ["arm", "base"], [address])
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_a_key_stays_with_its_certificate_when_openssl_fails(tmp_path: Path) -> None:
    make(tmp_path, ["arm"])
    (tmp_path / "ca.pem").write_text("no certificate")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(CannotMake, match="openssl x509"):
        make(tmp_path, ["arm"])
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_a_host_without_a_certificate_in_the_folder_is_told_how_to_make_one(tmp_path: Path) -> None:
    make(tmp_path, ["local"])
    with pytest.raises(NotSecure, match=f"edge.pem, edge.key.*regraft certificates {tmp_path} edge"):
        Guard(tmp_path).tls("edge")


# --- certificates that do not hold now ---


@pytest.mark.parametrize(
    ("begins", "ends", "text"),
    [(-2 * YEAR, -YEAR, "local.pem has expired on "), (YEAR, 2 * YEAR, "local.pem is not valid before ")],
)
def test_a_system_does_not_start_with_a_certificate_that_does_not_hold_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begins: timedelta, ends: timedelta, text: str
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    make(tmp_path, ["local"])
    certify(tmp_path, "local", begins, ends)
    options = ["--headless", "--listen", f"tls/127.0.0.1:{free_port()}", "--tls", str(tmp_path)]
    said = _refusal("up", FROG, *options)
    assert text in said
    assert said.endswith(f"'regraft certificates {tmp_path} local' makes a new one\n")
    assert not (tmp_path / "home").exists(), "nothing was begun"


def test_a_host_does_not_start_with_a_certificate_that_does_not_hold_now(tmp_path: Path) -> None:
    make(tmp_path, ["edge"])
    certify(tmp_path, "edge", -2 * YEAR, -YEAR)
    said = _refusal("host", "--join", "tls/127.0.0.1:9", "--name", "edge", "--tls", str(tmp_path))
    assert "edge.pem has expired on " in said


def test_files_that_are_no_certificate_and_its_key_are_told_as_that(tmp_path: Path) -> None:
    make(tmp_path, ["edge", "desk"])
    (tmp_path / "edge.key").write_bytes((tmp_path / "desk.key").read_bytes())
    with pytest.raises(NotSecure, match=r"edge.pem and .*edge.key must be a certificate and its key.*mismatch"):
        Guard(tmp_path).tls("edge")
    (tmp_path / "ca.pem").write_text("nothing")
    with pytest.raises(NotSecure, match=r"ca.pem must be certificates of authorities"):
        Guard(tmp_path).tls("desk")
