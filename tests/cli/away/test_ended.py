"""A command that waits for an answer hears that the system is gone, hub and all."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from regraft import Component, action, run_directory, service
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.run_directory import RunInfo
from tests.cli.live import STACK, System, regraft
from tests.support.commands import Command, in_home
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

FOR_LONG = 3600.0
LONGER = "30"
"""Seconds, as typed: many times longer than a command takes to hear of the end."""
CHANGE = {"changes": [{"change": "set_parameters", "component": "talker", "parameters": {"step": 2.0}}]}


class Slow(Component):
    """Answers nobody."""

    def __init__(self) -> None:
        self.asked = threading.Event()

    @service("never")
    async def never(self, request: JournalRequest) -> JournalPage:
        """Never answer."""
        self.asked.set()
        await self.kit.sleep(FOR_LONG)
        return JournalPage(())

    @action("labour")
    async def labour(self, goal: JournalRequest) -> JournalPage:
        """Never come to an end."""
        self.asked.set()
        await self.kit.sleep(FOR_LONG)
        return JournalPage(())


@pytest.fixture
def site() -> Iterator[Site]:
    site = Site("zenoh")
    yield site
    site.close()


@contextmanager
def running(site: Site, over: threading.Event) -> Iterator[None]:
    """Have commands find the site as a running system, until an event is set."""
    held = run_directory.lock("site")
    run_directory.write_info(RunInfo("site", "first", os.getpid(), site.endpoint, "stack.yaml", simulated=False))

    def end() -> None:
        over.wait(PATIENCE)
        run_directory.unlock(held)

    ending = threading.Thread(target=end)
    ending.start()
    yield
    over.set()
    ending.join()


@pytest.mark.parametrize("words", [("service", "call", "never"), ("goal", "send", "labour")], ids=" ".join)
@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
def test_a_wait_ends_with_3_once_the_system_has_ended(
    site: Site, home: Path, words: tuple[str, ...], as_json: bool
) -> None:
    slow = site.start(Slow, "slow")
    with running(site, slow.asked):
        options = ("--timeout", LONGER, *(("--json",) if as_json else ()))
        done = regraft(home, *words, *options)
    assert done.returncode == 3, done
    if as_json:
        assert json.loads(done.stderr) == {"error": "site has ended", "code": "not_reachable", "exit_code": 3}
    else:
        assert done.stderr.splitlines()[-1] == "regraft: site has ended"


def test_a_log_is_followed_to_its_end_until_the_system_has_ended(site: Site, home: Path, tmp_path: Path) -> None:
    over = threading.Event()
    with running(site, over):
        log = home / "site" / "logs" / "slow.log"
        log.write_text("first\n")
        following = Command("logs", "slow", "-f", log=tmp_path / "out.log", cwd=STACK, environment=in_home(home))
        try:
            following.wait_line("first")
            with log.open("a") as written:
                written.write("second\nlast")
            over.set()
            assert following.ended() == 3, following.lines
        finally:
            following.kill()
    assert following.lines == ["first", "second", "last", "regraft: site has ended"]


def test_a_log_of_a_system_that_has_ended_is_shown_and_not_followed(home: Path) -> None:
    with run_directory.lock("site"):
        (home / "site" / "logs" / "slow.log").write_text("first\nlast")
    done = regraft(home, "logs", "slow", "-f", "--system", "site")
    assert (done.returncode, done.stdout.splitlines()) == (3, ["first", "last"])


def test_a_component_that_joined_ends_with_the_system_though_its_process_number_is_still_there(
    site: Site, home: Path, tmp_path: Path
) -> None:
    over = threading.Event()
    with running(site, over):
        words = ("run", "--join", "site", "tiny_parts:Listener", "--name", "ear")
        ear = Command(*words, log=tmp_path / "ear.log", cwd=STACK, environment=in_home(home))
        try:
            ear.wait_line("ear joins system site")
            over.set()
            assert ear.ended() == 0, ear.lines
        finally:
            ear.kill()


@pytest.mark.slow
def test_a_confirmation_ends_with_3_once_the_system_was_killed(tmp_path: Path) -> None:
    (tmp_path / "change.json").write_text(json.dumps(CHANGE))
    with System(tmp_path / "home") as system:
        words = ("adapt", str(tmp_path / "change.json"), "--confirm", str(FOR_LONG))
        waiting = Command(*words, log=tmp_path / "log", cwd=STACK, environment=in_home(system.home))
        try:
            wait_until(lambda: system.ask("journal")["entries"], "the adaptation to begin")
            system.kill()
            assert waiting.ended() == 3, waiting.lines
        finally:
            waiting.kill()
    assert waiting.lines[-1] == "regraft: tiny has ended"
