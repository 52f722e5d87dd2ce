"""Runs of limited simulated time end, however short they are and whatever becomes of the source of time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.commands import in_home, run

pytestmark = pytest.mark.slow

WORLD = '<mujoco><worldbody><geom type="plane" size="5 5 .1"/></worldbody></mujoco>'
STACK = """\
system: short
clock: simulated
speed: max
topics: {{world_state: regraft/WorldState}}
components:
  world:
    class: "{world}"
    parameters: {{file: world.xml}}
"""
BROKEN = """\
import os

from regraft.sim_service.world import World


class Broken(World):
    def on_configure(self) -> None:
        os._exit(3)
"""
LOOKING = """\
from regraft import run_directory
from regraft.sim_service.world import World


class Looking(World):
    def on_configure(self) -> None:
        super().on_configure()
        (run_directory.folder(self.kit.system) / "seen").write_text("")
"""
FAILING = """\
from regraft.sim_service.world import World


class Failing(World):
    def advance(self, tick, seconds):
        super().advance(tick, seconds)
        if self.ticks == 20:
            self.kit.fail("the sky fell")
"""
DYING = """\
import os

from regraft import run_directory
from regraft.sim_service.world import World


class Dying(World):
    def advance(self, tick, seconds):
        super().advance(tick, seconds)
        died = run_directory.folder(self.kit.system) / "died"
        if self.ticks == 40 and not died.exists():
            died.touch()
            os._exit(3)
"""


def ended(folder: Path, world: str) -> tuple[int, list[str]]:
    """Run a world for two simulated seconds; return the exit code and what was wrong."""
    (folder / "world.xml").write_text(WORLD)
    (folder / "stack.yaml").write_text(STACK.format(world=world))
    words = ("up", str(folder / "stack.yaml"), "--for", "2", "--headless", "--json")
    done = run(*words, cwd=folder, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout)["problems"]


def test_a_run_that_is_over_in_a_moment_came_up(tmp_path: Path) -> None:
    assert ended(tmp_path, "regraft.sim_service.world:World") == (0, [])


def test_files_are_below_a_relative_home_as_seen_where_the_command_was_typed(tmp_path: Path) -> None:
    stack, elsewhere = tmp_path / "stack", tmp_path / "elsewhere"
    stack.mkdir()
    elsewhere.mkdir()
    (stack / "looking_world.py").write_text(LOOKING)
    (stack / "world.xml").write_text(WORLD)
    (stack / "stack.yaml").write_text(STACK.format(world="looking_world:Looking"))
    words = ("up", "../stack", "--for", "1", "--headless", "--json")
    done = run(*words, cwd=elsewhere, environment=in_home(Path("runs")))
    assert (done.returncode, json.loads(done.stdout)["problems"]) == (0, []), done.stderr
    assert (elsewhere / "runs" / "short" / "logs" / "world.log").is_file()
    assert (elsewhere / "runs" / "short" / "seen").is_file()
    assert not (stack / "runs").exists()


def test_a_run_ends_when_its_source_of_time_is_quarantined(tmp_path: Path) -> None:
    (tmp_path / "broken_world.py").write_text(BROKEN)
    code, problems = ended(tmp_path, "broken_world:Broken")
    assert code == 1
    assert "world is quarantined" in problems


def test_a_run_ends_when_its_source_of_time_fails_to_be_configured(tmp_path: Path) -> None:
    (tmp_path / "raising_world.py").write_text(BROKEN.replace("os._exit(3)", 'raise OSError("no such sky")'))
    code, problems = ended(tmp_path, "raising_world:Broken")
    assert code == 1
    assert any("world" in problem and "no such sky" in problem for problem in problems), problems


def test_a_run_ends_when_its_source_of_time_fails_in_it_and_states_why(tmp_path: Path) -> None:
    (tmp_path / "failing_world.py").write_text(FAILING)
    code, problems = ended(tmp_path, "failing_world:Failing")
    assert code == 1
    assert "world has failed: the sky fell" in problems


def test_the_pace_of_a_run_counts_the_time_before_its_world_died(tmp_path: Path) -> None:
    (tmp_path / "world.xml").write_text(WORLD)
    (tmp_path / "dying_world.py").write_text(DYING)
    (tmp_path / "stack.yaml").write_text(STACK.format(world="dying_world:Dying"))
    words = ("up", str(tmp_path / "stack.yaml"), "--speed", "real", "--for", "4", "--headless", "--json")
    done = run(*words, cwd=tmp_path, environment=in_home(tmp_path / "home"))
    assert done.returncode == 0, done.stderr
    closing = json.loads(done.stdout)
    assert closing["simulated_s"] == 4.0
    assert closing["restarts"] == 1
    # A run at the pace of the wall clock is never faster than that.
    assert closing["wall_s"] >= 3.9
    assert closing["real_time_factor"] <= 1.02
