"""The page on metacontrol is true: its files pass, its errors come, its commands show what it shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import shown
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills
from tests.cli.conftest import Regraft
from tests.docs.test_docs import blocks
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "metacontrol.md"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with the files of the page."""
    for name in ("rover.skills", "broken.skills"):
        (text,) = blocks(PAGE, "text", name)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_errors_on_the_page_are_those_that_come(folder: Path) -> None:
    (expected,) = blocks(PAGE, "text")
    assert shown(checked_skills(Path("broken.skills")).diagnostics) == expected.splitlines()


def test_the_commands_on_the_page_show_what_it_shows(folder: Path) -> None:
    console = blocks(PAGE, "console")[0]
    for part in console.split("$ regraft ")[1:]:
        command, *expected = part.splitlines()
        done = Regraft()(*command.split())
        assert (done.exit_code, done.stdout.splitlines()) == (0, expected)


def test_the_page_generates_four_files(folder: Path) -> None:
    assert Regraft()("skills", "generate", "rover.skills", "--out", "made").exit_code == 0
    section = PAGE.read_text().partition("## What is generated\n")[2].partition("\n## ")[0]
    named = [name for name in section.split("`") if name.endswith((".yaml", ".owl"))]
    assert {each.name for each in (folder / "made").iterdir()} == set(named)
