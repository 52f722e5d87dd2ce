"""Whole runs of FROG: repeatable, on any renderer, and said in one line."""

from __future__ import annotations

import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.frog.conftest import StartFrog
from tests.support.commands import run
from tests.support.frog import run_frog
from tests.support.paths import FROG
from tests.support.ports import free_port
from tests.support.renderers import without_opengl


def test_a_run_closes_with_one_object_and_equal_seeds_give_equal_digests(tmp_path: Path) -> None:
    first = run_frog(tmp_path, 10, "--speed", "max", renderer="")
    assert first.code == 0, first.errors
    assert first.summary["simulated_s"] == 10
    assert first.summary["reproducible"] is True
    assert first.summary["contacts"] == 0
    # Two dozen processes beside each other: the second run is as the first on a machine that is busy, too.
    others = ((), ("--seed", "2"))
    with ThreadPoolExecutor(len(others)) as pool:
        runs = [
            pool.submit(run_frog, tmp_path / str(number), 10, "--speed", "max", *options, renderer="")
            for number, options in enumerate(others)
        ]
        second, other_seed = (run.result() for run in runs)
    assert second.summary["digest"] == first.summary["digest"], second.errors
    assert second.summary["dropped"] == []
    assert other_seed.summary["digest"] != first.summary["digest"]


def test_the_ray_camera_does_where_there_is_no_opengl(tmp_path: Path) -> None:
    run = run_frog(tmp_path, 10, "--speed", "max", renderer="ray")
    assert run.code == 0, run.errors
    assert run.summary["renderer"] == "ray"
    assert run.summary["pictures"]


def test_a_second_up_of_the_same_system_and_a_port_in_use_are_said_before_anything_runs(start_frog: StartFrog) -> None:
    frog = start_frog("--speed", "real")
    again = _up("--system", "tests", "--set", f"gateway.port={free_port()}")
    assert again.returncode == 2
    assert "already running" in again.stderr
    assert frog.process.poll() is None
    again = _up("--system", "other", "--set", f"gateway.port={frog.port}")
    assert again.returncode == 2
    assert str(frog.port) in again.stderr


def test_without_opengl_all_cameras_together_say_once_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    options = ("--set", f"gateway.port={free_port()}", "--speed", "max", "--for", "0.5")
    done = _up(*options, environment=without_opengl(tmp_path / "none"))
    assert done.returncode == 0, done.stderr
    told = done.stdout + done.stderr
    assert told.count("no OpenGL here (libEGL.so.1 and libOSMesa.so.8 cannot be loaded)") == 1
    assert told.count("apt-get install libegl1") == 1
    assert "NoneType" not in told
    assert "renderer ray" in told.splitlines()[-1]


def _up(*options: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return run("up", str(FROG), "--headless", *options, environment=environment, fresh=environment is not None)
