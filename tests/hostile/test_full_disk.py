"""A disk that is full: components go on, adaptations are rejected, and it is said."""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from regraft import run_directory
from tests.hostile.components.test_bad_components import heard
from tests.hostile.components.test_broken_stacks import up
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.parts import Word
from tests.hostile.rest import Rest
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

CHATTY = "  chatty: {class: 'tests.hostile.parts:Chatty'}\n"


LARGEST = 20_000
"""Bytes of any file: the shared memory that the bus needs is smaller, the logs are not."""


def _no_file_beyond(limit: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))


def test_components_go_on_when_their_logs_cannot_be_written(
    stack: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # Python 3.11 would keep what it could write in part
    system = System(stack(CHATTY + SOURCE + SINK), prepare=_no_file_beyond(LARGEST))
    os.environ["REGRAFT_HOME"] = str(tmp_path / "home")
    try:
        system.wait_running("chatty")
        wait_until(lambda: heard(system) > 100)
        assert system.client.call("alive", Word("yes"), Word).text == "yes"
        log = tmp_path / "home" / "tests" / "logs" / "chatty.log"
        wait_until(lambda: log.stat().st_size >= LARGEST)
        assert system.client.components()["chatty"].status is not None
        assert not system.said("component.fault", "chatty")
        system.must_have_kept_all()
    finally:
        assert system.end() == 0


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """Return a disk of 1 MB that is a folder of its own."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("needs the right to mount a small disk")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def _fill(place: Path) -> Path:
    ballast = place / "ballast"
    with ballast.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))
    return ballast


def test_a_start_with_no_room_is_refused_and_leaves_nothing(
    stack: Callable[..., Path], disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = stack(SOURCE)
    _fill(disk)
    monkeypatch.setenv("REGRAFT_HOME", str(disk))
    done = up(path)
    assert done.returncode == 2, done.stdout + done.stderr
    assert "run.json: No space left on device" in done.stderr
    assert "Traceback" not in done.stderr
    assert not run_directory.running()


def test_a_disk_that_fills_up_stops_adaptations_and_nothing_else(
    start: Start, disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(disk))
    with Rest(start, CHATTY + SOURCE + SINK) as rest:
        ballast = _fill(disk)
        refused = rest.adapt("sink", {"delay": 0.001})
        assert refused.status_code in (409, 500, 503), refused.text
        assert "journal" in refused.text
        assert rest.system.client.view("sink").parameters["delay"] == 0.0
        before = heard(rest.system)
        wait_until(lambda: heard(rest.system) > before + 20)
        assert not rest.system.said("component.fault", "chatty")
        rest.system.must_have_kept_all()
        ballast.unlink()
        wait_until(lambda: rest.adapt("sink", {"delay": 0.001}).status_code == 200, "room again")
        assert rest.system.client.view("sink").parameters["delay"] == 0.001
