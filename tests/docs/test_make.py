"""`make frog` installs what FROG needs and no more; the tests' packages come into the same place, in either order."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

LOAD = """
import sys
before = set(sys.modules)
from pathlib import Path
from regraft.process.main import load_class
from regraft.stack import load
foreign = set(sys.argv[1].split(","))
for stack in sys.argv[2:]:
    for component in load(Path(stack)).architecture.components.values():
        load_class(component.cls)
print(",".join(sorted(foreign & {name.partition(".")[0] for name in set(sys.modules) - before})))
"""


TAKEN_IF_THERE = {"charset_normalizer"}
"""Packages that FROG's own (numpy.f2py, by way of scipy) import where they are, and do without elsewhere."""


def needed(name: str, extra: str = "") -> Iterator[str]:
    """Yield the distributions that one needs with an extra, itself first."""
    yield canonicalize_name(name)
    for text in distribution(name).requires or ():
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
            for further in requirement.extras or {""}:
                yield from needed(requirement.name, further)


def run(command: list[str], folder: Path, env: dict[str, str] | None = None) -> str:
    """Return what a command says that ends well."""
    done = subprocess.run(
        command, cwd=folder, env=env, capture_output=True, text=True, timeout=4 * PATIENCE, check=True
    )
    return done.stdout


def made(folder: Path, *targets: str) -> str:
    """Return what `make` would do there for targets."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    command = ["make", "--dry-run", *targets]
    done = subprocess.run(
        command, cwd=folder, env=kept, capture_output=True, text=True, timeout=4 * PATIENCE, check=True
    )
    return done.stdout


def packages(text: str) -> list[str]:
    """Return the lists of packages that are installed."""
    return re.findall(r"--require-hashes -r requirements/(\w+)\.txt", text)


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a folder with what `make` reads, where nothing is installed."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / "requirements", tmp_path / "requirements")
    return tmp_path


def install(clone: Path, *stamps: str) -> None:
    """Leave what an installation leaves."""
    for name in ("bin/pip", *stamps):
        path = clone / ".venv" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


def test_frog_alone_takes_its_own_packages_and_shows_how_it_goes(clone: Path) -> None:
    text = made(clone, "frog")
    assert packages(text) == ["robot"]
    assert "--quiet" not in text


def test_the_tests_packages_come_on_top_of_frogs(clone: Path) -> None:
    install(clone, "frog")
    assert packages(made(clone, "frog")) == []
    assert packages(made(clone, "test")) == ["dev"]
    assert packages(made(clone, "check")) == ["dev"]


def test_frog_runs_with_the_tests_packages(clone: Path) -> None:
    assert "touch .venv/frog .venv/ready" in made(clone, "test")
    install(clone, "frog", "ready")
    assert packages(made(clone, "frog")) == packages(made(clone, "test")) == []


def test_another_python_has_a_place_of_its_own(clone: Path) -> None:
    install(clone, "frog", "ready")
    text = made(clone, "test-python", "PYTHON=/opt/3.13/bin/python3.13")
    assert "/opt/3.13/bin/python3.13 -m venv build/python3.13\n" in text
    assert packages(text) == ["dev"]
    assert ".venv" not in text


def test_frog_imports_nothing_that_only_tests_need() -> None:
    own = set(needed("regraft", "robot"))
    foreign = {
        module
        for module, owners in packages_distributions().items()
        if not own & {canonicalize_name(owner) for owner in owners}
    } - TAKEN_IF_THERE
    assert {"pytest", "mypy", "sklearn"} <= foreign
    stacks = [str(ROOT / "regraft/stacks/frog" / name) for name in ("stack.yaml", "search.yaml", "rounds.yaml")]
    assert run([sys.executable, "-c", LOAD, ",".join(foreign), *stacks], ROOT).strip() == ""


def test_every_page_is_in_the_contents_of_the_site() -> None:
    contents = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^([a-z][\w/-]*)$", contents, re.MULTILINE))
    assert {page.stem for page in (ROOT / "docs").glob("*.md")} - {"index"} == listed - {"decisions/README"}


@pytest.mark.parametrize("name", ["robot", "dev", "docs"])
def test_everything_that_is_installed_has_a_hash(name: str) -> None:
    lines = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    assert len(lines) > 20
    assert [line for line in lines if "==" not in line or "--hash=sha256:" not in line] == []


def test_what_frog_needs_is_the_same_for_tests_and_docs() -> None:
    pins = {}
    for name in ("robot", "dev", "docs"):
        text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
        pins[name] = dict(re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE))
    for name in ("dev", "docs"):
        assert {package: pins[name].get(package) for package in pins["robot"]} == pins["robot"]
