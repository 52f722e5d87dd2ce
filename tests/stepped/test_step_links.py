"""Steps between the source and the members of one machine: past the bus where that can be, over it where not."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import Ack, Step, StepKind
from regraft.lockstep.step_links import member_link, source_links
from regraft.lockstep.step_links.packets import LARGEST, packet_socket, receive, send
from tests.stepped.parts import Adviser, Pusher, TinyWorld, Witness
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE, wait_until

EVERYBODY = ("adviser", "pusher", "witness")
NOBODY = 65_534
"""Number of a user who owns nothing."""
KNOCK = """
import os, socket, sys
os.setuid(int(sys.argv[2]))
knocking = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
try:
    knocking.connect(sys.argv[1])
    knocking.settimeout(20)
    knocking.send(b"a packet")
    print("closed" if not knocking.recv(100) else "answered")
except (PermissionError, BrokenPipeError, ConnectionResetError) as error:
    print(type(error).__name__)
"""


@pytest.fixture
def path(tmp_path: Path) -> str:
    """Where the source listens for members."""
    return str(tmp_path / "steps.sock")


@pytest.fixture
def told(steps: StepSite) -> Counter[str]:
    """Return how many steps and acknowledgements have come over the bus."""
    counts = Counter[str]()
    for part in ("ack", "step/*"):
        steps.listen(f"steps/clock/{part}", lambda sample: counts.update((sample.key.removeprefix("steps/clock/"),)))
    return counts


def _start(steps: StepSite, path: str) -> None:
    connections = {"position": "position", "push": "push"}
    steps.start(Adviser, "adviser", step_socket=path)
    steps.start(Pusher, "pusher", connections=connections, step_socket=path)
    steps.start(Witness, "witness", connections=connections, step_socket=path)


def _start_world(steps: StepSite, path: str, duration: float = 20.0, **assigned: object) -> None:
    steps.start(
        TinyWorld,
        "world",
        connections={"position": "position", "push": "push"},
        members=EVERYBODY,
        parameters={"speed": "max"},
        duration=duration,
        step_socket=path,
        **assigned,
    )


def _digest(path: str, kind: str = "memory") -> str:
    """Return what a run was like from its beginning to its end."""
    steps = StepSite(kind)
    try:
        _start(steps, path)
        _start_world(steps, path)
        told = steps.wait_finished()
        assert told.reproducible, told.causes
        seen: str = steps.component("witness").digest()
        return seen
    finally:
        steps.close()


@pytest.mark.usefixtures("steps_sent_once")
def test_after_the_welcome_no_step_and_no_acknowledgement_passes_the_bus(
    steps: StepSite, path: str, told: Counter[str]
) -> None:
    _start(steps, path)
    _start_world(steps, path)
    assert steps.wait_finished().reproducible
    assert {key: count for key, count in told.items() if count > 1} == {}
    assert {f"step/{name}" for name in EVERYBODY} <= told.keys()


def test_a_run_over_links_is_the_one_over_the_bus(path: str) -> None:
    assert _digest(path) == _digest("")


def test_a_step_carries_what_the_slowest_would_wait_for_and_an_acknowledgement_what_the_source_reads(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[Step] = []
    acks: list[Ack] = []

    def send_and_keep(kept: list[Any], cls: type[Any], link: socket.socket, packet: bytes) -> bool:
        kept.append(codec.decode(packet, cls))
        return send(link, packet)

    monkeypatch.setattr(source_links, "send", partial(send_and_keep, steps, Step))
    monkeypatch.setattr(member_link, "send", partial(send_and_keep, acks, Ack))
    assert _digest(path) == _digest("")
    assert {key for step in steps for key in step.samples} == {"steps/topic/position"}
    pushed = [ack for ack in acks if "steps/topic/push" in ack.published]
    assert len(pushed) > 100
    assert all(set(ack.samples) == {"steps/topic/push"} for ack in pushed)


def test_members_without_the_socket_are_in_step_with_those_that_have_it(steps: StepSite, path: str) -> None:
    connections = {"position": "position", "push": "push"}
    steps.start(Adviser, "adviser")
    steps.start(Pusher, "pusher", connections=connections, step_socket=path)
    steps.start(Witness, "witness", connections=connections)
    _start_world(steps, path)
    assert steps.wait_finished().reproducible
    assert steps.component("witness").digest() == _digest("")


@pytest.mark.parametrize("place", ["no/such/folder/steps.sock", "long" * 40])
def test_where_nobody_can_listen_all_goes_over_the_bus(tmp_path: Path, place: str) -> None:
    assert _digest(str(tmp_path / place)) == _digest("")


def test_links_that_break_again_and_again_change_nothing(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    counts = Counter[str]()

    def send_or_break(link: socket.socket, packet: bytes) -> bool:
        counts["sent"] += 1
        if counts["sent"] % 7:
            return send(link, packet)
        counts["broken"] += 1
        link.shutdown(socket.SHUT_RDWR)
        return False

    before = _digest("")
    for end in (source_links, member_link):
        monkeypatch.setattr(end, "send", send_or_break)
    assert _digest(path) == before
    assert counts["broken"] > 20


def test_messages_that_are_too_large_for_a_link_go_over_the_bus(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = _digest("")
    monkeypatch.setattr("regraft.lockstep.step_links.packets.LARGEST", 128)
    assert _digest(path) == before


def test_a_packet_as_large_as_can_be_arrives_whole(tmp_path: Path) -> None:
    listening = packet_socket()
    listening.bind(str(tmp_path / "end"))
    listening.listen()
    connecting = packet_socket()
    connecting.connect(str(tmp_path / "end"))
    accepted, _ = listening.accept()
    assert not send(connecting, bytes(LARGEST + 1))
    assert send(connecting, b"x" * LARGEST)
    assert receive(accepted) == b"x" * LARGEST
    for end in (connecting, accepted, listening):
        end.close()


@pytest.mark.usefixtures("steps_sent_once")
def test_members_are_linked_to_another_run_of_the_source(steps: StepSite, path: str, told: Counter[str]) -> None:
    _start(steps, path)
    _start_world(steps, path, 3600.0)
    steps.wait_for_time(2.0)
    steps.kill("world")
    told.clear()
    _start_world(steps, path, 20.0, incarnation=2)
    wait_until(lambda: steps.told().wall > 0 and len(steps.component("witness").seen) > 50, "the members to work")
    steps.wait_finished()
    assert all(count <= 2 for key, count in told.items() if key != "ack"), told


def test_packets_that_are_no_acknowledgements_change_nothing(steps: StepSite, path: str) -> None:
    _start(steps, path)
    _start_world(steps, path, 3600.0)
    steps.wait_for_time(1.0)
    forged = [b"x", os.urandom(1000), codec.encode(Ack("ghost", 1, 1, {})), codec.encode(Ack("pusher", 7, 1, {}))]
    forged += [codec.encode(Ack("pusher", 1, 2**40, {"steps/topic/push": 2**40}))]
    knocking = [packet_socket() for _ in forged]
    for end, packet in zip(knocking, forged, strict=True):
        end.connect(path)
        for _ in range(5):
            end.send(packet)
    now = steps.told().time / 1e9
    steps.wait_for_time(now + 10.0)
    for end in knocking:
        end.close()
    now = steps.told().time / 1e9
    steps.wait_for_time(now + 10.0)
    assert steps.told().reproducible


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be another user")
@pytest.mark.parametrize("mode", [0o600, 0o777])
def test_another_user_is_not_admitted(steps: StepSite, path: str, mode: int) -> None:
    _start(steps, path)
    _start_world(steps, path, 3600.0)
    steps.wait_for_time(1.0)
    for folder in Path(path).parents:
        if folder.stat().st_uid == os.geteuid() and str(folder).startswith("/tmp/"):
            folder.chmod(0o755)
    assert Path(path).stat().st_mode & 0o777 == 0o600
    Path(path).chmod(mode)
    knock = subprocess.run(
        [sys.executable, "-c", KNOCK, path, str(NOBODY)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert knock.stdout.strip() in ("PermissionError", "closed", "BrokenPipeError", "ConnectionResetError"), knock
    assert steps.told().reproducible


def test_a_member_does_not_trust_a_socket_that_sends_no_steps(steps: StepSite, path: str) -> None:
    listening = packet_socket()
    listening.bind(path)
    listening.listen()
    _start(steps, path)
    _start_world(steps, "")
    listening.settimeout(PATIENCE)
    served = 0
    while served < len(EVERYBODY):
        end, _ = listening.accept()
        with end, suppress(ConnectionError):  # a member ends it when it is welcomed again
            end.send(b"no step")
            end.send(codec.encode(Step(99, 1, StepKind.STEP, 0, 0, 0)))
            served += 1
    listening.close()
    assert steps.wait_finished().reproducible


@pytest.mark.usefixtures("steps_sent_once")
def test_a_step_that_is_lost_with_its_link_comes_over_the_bus_at_once(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a run of a thousand steps would take longer than all waits here."""
    counts = Counter[str]()

    def send_and_break(link: socket.socket, packet: bytes) -> bool:
        counts["sent"] += 1
        if counts["sent"] % 50 == 0:
            link.shutdown(socket.SHUT_RDWR)
            return True
        return send(link, packet)

    before = _digest("")
    monkeypatch.setattr(source_links, "send", send_and_break)
    assert _digest(path) == before
    assert counts["sent"] > 500


def test_the_step_after_a_repeated_welcome_comes_behind_it(
    steps: StepSite, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a member would forget all that it has read when the repetition arrives after that step."""
    came: list[int] = []
    lost: list[Ack] = []

    def send_or_lose(link: socket.socket, packet: bytes) -> bool:
        ack = codec.decode(packet, Ack)
        if ack.member != "pusher" or lost:
            return send(link, packet)
        lost.append(ack)
        return True

    before = _digest("")
    monkeypatch.setattr(member_link, "send", send_or_lose)
    steps.listen("steps/clock/step/pusher", lambda sample: came.append(codec.decode(sample.payload, Step).number))
    _start(steps, path)
    _start_world(steps, path)
    assert steps.wait_finished().reproducible
    assert steps.component("witness").digest() == before
    (welcome,) = {ack.number for ack in lost}
    assert came[:2] == [welcome] * 2
    assert [number for number in came if number != welcome][:1] == [welcome + 1]
