"""Stacks of installed packages have names; finding one imports nobody's code."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from regraft import stacks
from regraft.stack.installed import instead_of_stack, stack_file
from tests.stack.reading.files import problems

FROG = Path(stacks.__file__).parent / "frog"
BROKEN = "raise RuntimeError('imported')\n"


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder of one's own, with a package on the path that makes two stacks known and cannot be imported."""
    site = tmp_path / "site"
    (site / "acme" / "robots").mkdir(parents=True)
    (site / "acme" / "__init__.py").write_text(BROKEN)
    (site / "acme" / "robots" / "stack.yaml").write_text("system: acme\n")
    information = site / "acme-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: acme\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[regraft.stacks]\nrobots = acme.robots\nlost = not_there.at_all\n")
    monkeypatch.syspath_prepend(str(site))
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    return here


@pytest.mark.parametrize(("named", "file"), [("frog", "stack.yaml"), ("frog/rounds.yaml", "rounds.yaml")])
@pytest.mark.usefixtures("elsewhere")
def test_an_installed_stack_is_found_by_its_name(named: str, file: str) -> None:
    assert stack_file(Path(named)) == FROG / file


def test_an_outside_package_is_found_and_not_imported(elsewhere: Path) -> None:
    assert stack_file(Path("robots")) == elsewhere.parent / "site" / "acme" / "robots" / "stack.yaml"
    assert "acme" not in sys.modules


@pytest.mark.usefixtures("elsewhere")
@pytest.mark.parametrize("named", ["lost", "nothing", "/frog", "a/frog", "a" * 300])
def test_a_path_that_is_no_stack_stays_as_it_is(named: str) -> None:
    assert stack_file(Path(named)) == Path(named)


def test_a_folder_that_is_there_goes_first(elsewhere: Path) -> None:
    (elsewhere / "frog").mkdir()
    assert stack_file(Path("frog")) == Path("frog/stack.yaml")


@pytest.mark.usefixtures("elsewhere")
def test_a_mistyped_name_is_told_with_the_one_that_is_meant_or_with_all() -> None:
    assert instead_of_stack(Path("robts")) == "; did you mean 'robots'?"
    assert instead_of_stack(Path("xyz")) == "; installed stacks: demo_two_robots, frog, lost, patrol, robots, suave"
    assert instead_of_stack(Path("a/xyz")) == ""


def test_a_class_path_of_ours_without_the_package_is_told_with_it_and_others_are_not(tmp_path: Path) -> None:
    text = "system: t\ncomponents: {{a: {{class: '{}'}}}}\n"
    (ours,) = problems(tmp_path, text.format("services.battery:Battery"))
    assert "did you mean 'regraft.services.battery'?" in ours.problem
    (other,) = problems(tmp_path, text.format("services.no_such_thing_at_all:Part"))
    assert "regraft.services.no_such" not in other.problem
