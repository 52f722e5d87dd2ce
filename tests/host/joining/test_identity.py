"""A host joins under the name in its certificate, and nobody else speaks for it."""

from __future__ import annotations

import queue
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus.interface import Bus
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Tls
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.joining import HostProof, JoinHost, Lease, ProveHost, RenewLease
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.host.host_publisher import Refused
from regraft.host.joining.proof_checker import ProofChecker
from regraft.security.access import Guard, NotSecure
from regraft.security.certificates import make
from regraft.security.host_proof import NotProved, prove
from tests.host.moves.labs import join_unchecked
from tests.host.several import TICKER, WAIT, Site
from tests.support.commands import run
from tests.support.hosts import state_of, wait_state
from tests.support.links import Link
from tests.support.machine.ports import free_port
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_for, wait_until

pytestmark = pytest.mark.slow

KEYS = Keys("tests")


class Lab:
    """A system that is joined over TLS by its host edge."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "lab"
        make(self.folder, ["local", "edge", "desk"])
        self.site = Site(folder)
        port = free_port()
        self.endpoint = f"tls/127.0.0.1:{port}"
        self.site.up(TICKER, WAIT, "--listen", f"tls/0.0.0.0:{port}", "--tls", str(self.folder))
        self.link = Link(f"tcp/127.0.0.1:{port}")
        self.site.links.append(self.link)
        through = self.link.endpoint.replace("tcp/", "tls/")
        self.guest = self.site.join("edge", through, "--tls", str(self.folder))
        self.site.wait_active("ticker")

    @property
    def secret(self) -> str:
        return self.site.system.info.secret


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """Return a system whose host edge has joined."""
    folder = tmp_path_factory.mktemp("lab")
    with home(folder / "home"):
        made = Lab(folder)
        yield made
        made.site.close()


@pytest.fixture
def member(lab: Lab) -> Iterator[Bus]:
    """Return a session of the same system."""
    bus = open_bus(lab.site.system.info.hub)
    yield bus
    bus.close()


def _tls(folder: Path, whose: str) -> Tls:
    return Tls(*(str(folder / file) for file in ("ca.pem", f"{whose}.pem", f"{whose}.key")))


# --- joining ---


def test_a_host_does_not_join_with_the_certificate_of_another(lab: Lab) -> None:
    said = join_unchecked(lab.endpoint, "arm", lab.secret, lab.folder, "desk")
    assert said.startswith("CannotJoin a certificate of 'desk' was shown for host 'arm'")
    assert state_of(lab.site.system, "arm") is HostState.ABSENT


def test_a_host_looks_at_its_own_certificate_first(lab: Lab, tmp_path: Path) -> None:
    mistaken = tmp_path / "mistaken"
    shutil.copytree(lab.folder, mistaken)
    for ending in ("pem", "key"):
        shutil.copy(mistaken / f"desk.{ending}", mistaken / f"edge.{ending}")
    with pytest.raises(
        NotSecure, match=f"edge.pem is the certificate of 'desk', .*regraft certificates {mistaken} edge"
    ):
        Guard(mistaken).tls("edge")


def test_a_host_without_a_certificate_is_told_how_to_join(lab: Lab) -> None:
    done = run("host", "--join", lab.site.system.info.endpoint, "--name", "desk")
    assert "takes in hosts by their certificates: join its tls/ endpoint, with --tls FOLDER" in done.stderr
    assert done.returncode == 2


def test_a_host_that_lost_its_link_is_taken_back_and_its_component_goes_on(lab: Lab) -> None:
    incarnation = lab.site.wait_active("ticker")
    lab.link.cut()
    wait_state(lab.site.system, "edge", HostState.LOST)
    lab.link.heal()
    wait_state(lab.site.system, "edge", HostState.JOINED)
    assert lab.site.wait_active("ticker") == incarnation


def test_the_first_host_proves_its_name_too(lab: Lab) -> None:
    witness = ProofChecker(_tls(lab.folder, "desk"))
    with pytest.raises(NotProved, match="shows the certificate of 'desk': it must be that of 'local'"):
        prove(_tls(lab.folder, "edge"), "edge", "1", witness.prove)


def test_a_certificate_of_another_authority_proves_nothing(lab: Lab, tmp_path: Path) -> None:
    make(tmp_path / "other", ["edge"])
    mixed = replace(_tls(tmp_path / "other", "edge"), authority=str(lab.folder / "ca.pem"))
    with pytest.raises(Refused, match="the certificate shown is not accepted"):
        prove(mixed, "edge", "1", ProofChecker(_tls(lab.folder, "local")).prove)


def test_what_is_asked_twice_in_a_handshake_is_answered_as_before(lab: Lab) -> None:
    witness = ProofChecker(_tls(lab.folder, "local"))

    def twice(asked: ProveHost) -> HostProof:
        first = witness.prove(asked)
        assert witness.prove(asked) == first
        return first

    seal = prove(_tls(lab.folder, "edge"), "edge", "1", twice)
    witness.check(seal.on(JoinHost("edge", "1")))


# --- speaking for a host ---


def _refusal(bus: Bus, verb: str, asked: object) -> ControlError:
    (answer,) = bus.query(KEYS.host("local", verb), codec.encode(asked), PATIENCE)
    assert answer.error
    return codec.decode(answer.payload, ControlError)


def _overheard(bus: Bus) -> RenewLease:
    """Return a sign of life of edge, as any member can overhear it."""
    heard: queue.SimpleQueue[object] = queue.SimpleQueue()
    listening = bus.serve(KEYS.host("local", "renew"), heard.put)
    query = bus.open_query(wait_for(lambda: None if heard.empty() else heard.get(), "a sign of life"))
    listening.close()
    assert query is not None
    return codec.decode(query.payload, RenewLease)


def test_a_member_cannot_take_the_name_of_a_host_that_is_lost(lab: Lab, member: Bus) -> None:
    refusal = _refusal(member, "join", JoinHost("arm", "1"))
    assert refusal.code is ControlCode.REFUSED
    assert refusal.problems[0].startswith("host 'arm' has shown no certificate to this run of the system")


def test_a_member_cannot_say_goodbye_for_a_host(lab: Lab, member: Bus) -> None:
    said = _overheard(member)
    assert said.seal
    refusal = _refusal(member, "renew", replace(said, leaving=True, number=said.number + 1000))
    assert (refusal.code, refusal.problems) == (
        ControlCode.REFUSED,
        ("what is asked in the name of host 'edge' does not come from it",),
    )
    wait_state(lab.site.system, "edge", HostState.JOINED)


def test_a_sign_of_life_counts_once(lab: Lab, member: Bus) -> None:
    said = _overheard(member)
    wait_until(lambda: _overheard(member).number > said.number + 1, "further signs of life")
    assert _refusal(member, "renew", said).code is ControlCode.TIMED_OUT
    (answer,) = member.query(KEYS.host("local", "renew"), codec.encode(RenewLease("edge", "2")), PATIENCE)
    assert codec.decode(answer.payload, Lease) == Lease(held=False), "another process of it has to join"
