"""An installed Regraft does from any folder what a checkout does, and takes nobody's names."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

from regraft.sim_service.cameras.renderers import FORCE
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE
from tests.support.wheels import wheel_of_the_run

pytestmark = pytest.mark.slow

WEATHER = """\
system: weather
clock: real
imports: [acme_weather.messages]
topics:
  weather: {type: acme/Weather, rate: 20}
components:
  station: {class: 'acme_weather.station:Station', parameters: {temperature: 280}}
"""
PACKAGE = Path(__file__).parent / "package"
SHORT = ("--headless", "--json", "--speed", "max", "--for", "1", "--set", "gateway.port=0")


@dataclass(frozen=True, slots=True)
class Installed:
    """An environment that has Regraft's wheel; what that depends on comes from the environment of the tests."""

    wheel: Path
    folder: Path

    def run(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a program of the environment in a folder that has nothing to do with the project."""
        elsewhere = self.folder / "elsewhere"
        elsewhere.mkdir(exist_ok=True)
        environment = {**os.environ, "REGRAFT_HOME": str(self.folder / "home"), FORCE: "ray"}
        environment.pop("PYTHONPATH", None)
        return subprocess.run(
            [str(self.folder / "bin" / program), *arguments],
            cwd=elsewhere,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=4 * PATIENCE,
            check=False,
        )


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Install the wheel, and somebody else's package, in an environment of their own."""
    folder = tmp_path_factory.mktemp("environment")
    wheel = wheel_of_the_run(tmp_path_factory)
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    source = tmp_path_factory.mktemp("source") / "package"
    subprocess.run(["cp", "-r", str(PACKAGE), str(source)], check=True)
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index"]
    for what in (wheel, source):
        subprocess.run(
            [*pip, "--no-build-isolation", "--ignore-installed", str(what)], check=True, timeout=4 * PATIENCE
        )
    return Installed(wheel, folder)


def test_the_wheel_has_every_file_that_the_packages_read(installed: Installed) -> None:
    files = [file for name in ("behavior_tree", "regraft") for file in (ROOT / name).rglob("*") if file.is_file()]
    read = {file.relative_to(ROOT).as_posix() for file in files if file.suffix not in (".md", ".pyc")}
    with zipfile.ZipFile(installed.wheel) as wheel:
        assert read - set(wheel.namelist()) == set()


def test_it_takes_two_names_and_no_more(installed: Installed) -> None:
    with zipfile.ZipFile(installed.wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"behavior_tree", "regraft"}


def test_every_file_of_the_packages_is_in_it(installed: Installed) -> None:
    with zipfile.ZipFile(installed.wheel) as archive:
        names = set(archive.namelist())
    files = [file for package in ("behavior_tree", "regraft") for file in (ROOT / package).rglob("*") if file.is_file()]
    wanted = {file.relative_to(ROOT).as_posix() for file in files if file.suffix not in {".pyc", ".md"}}
    assert wanted - names == set()


def test_it_is_the_installed_one_that_runs(installed: Installed) -> None:
    done = installed.run("python", "-c", "import regraft, behavior_tree; print(regraft.__file__)")
    assert Path(done.stdout.strip()).is_relative_to(installed.folder), done.stderr


@pytest.mark.parametrize("stack", ["frog", "frog/rounds.yaml"])
def test_its_stacks_run_by_their_names(installed: Installed, stack: str) -> None:
    done = installed.run("regraft", "up", stack, *SHORT)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["reproducible"]


def test_its_studies_run(installed: Installed) -> None:
    out = installed.folder / "out"
    asked = ("frog-tasks", "--runs", "1", "--configurations", "exploring", "--for", "2", "--out", str(out))
    done = installed.run("regraft", "evaluate", *asked)
    assert done.returncode == 0, done.stderr
    assert list(out.rglob("*.md"))


def test_somebody_elses_package_runs_on_it(installed: Installed) -> None:
    stack = installed.folder / "weather.yaml"
    stack.write_text(WEATHER)
    done = installed.run("regraft", "up", str(stack), "--for", "0.5", "--json", "--headless")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["system"] == "weather"


def test_a_mistyped_stack_is_told_with_the_installed_ones(installed: Installed) -> None:
    done = installed.run("regraft", "up", "frgo")
    assert (done.returncode, done.stderr) == (2, "regraft: frgo: there is no such file; did you mean 'frog'?\n")
