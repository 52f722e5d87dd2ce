"""Generated files are written whole, or what was there stays; the same input gives the same bytes."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated, write_files
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from tests.metacontrol.skills.texts import PAPER, checked
from tests.support.paths import ROOT

OLD = {"a.yaml": "old a", "b.yaml": "old b", "other": "other"}
NEW = {"a.yaml": "new a" * 2000, "b.yaml": "new b" * 2000, "c.owl": "new c" * 2000}


def content(folder: Path) -> dict[str, str]:
    """Return what is in a folder."""
    return {each.name: each.read_text() for each in sorted(folder.iterdir()) if each.is_file()}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with files of an earlier run and one that is not ours."""
    made = tmp_path / "out"
    made.mkdir()
    for name, text in OLD.items():
        (made / name).write_text(text)
    return made


@contextmanager
def no_room(size: int) -> Iterator[None]:
    """Let files have at most this size, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_files_are_written_into_a_folder_that_is_made(tmp_path: Path) -> None:
    write_files(NEW, tmp_path / "x" / "y")
    assert content(tmp_path / "x" / "y") == NEW
    assert [each.name for each in (tmp_path / "x").iterdir()] == ["y"]


def test_files_replace_those_of_an_earlier_run_and_leave_others(folder: Path) -> None:
    write_files(NEW, folder)
    assert content(folder) == {**NEW, "other": "other"}
    assert len(list(folder.iterdir())) == 4


def test_without_room_what_was_there_stays(folder: Path, tmp_path: Path) -> None:
    with no_room(4096), pytest.raises(OSError, match="File too large"):
        write_files(NEW, folder)
    assert content(folder) == OLD
    assert len(list(folder.iterdir())) == 3
    with no_room(4096), pytest.raises(OSError, match="File too large"):
        write_files(NEW, tmp_path / "further")
    assert [each.name for each in tmp_path.iterdir()] == ["out"]


def test_where_one_file_cannot_be_replaced_all_others_stay(folder: Path) -> None:
    (folder / "c.owl").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_files(NEW, folder)
    assert content(folder) == OLD
    assert len(list(folder.iterdir())) == 4


@pytest.mark.parametrize("place", ["/proc/none", "/dev/null/out"])
def test_where_nothing_can_be_written_it_is_an_error(place: str) -> None:
    with pytest.raises(OSError, match=r"No such file|File exists|Not a directory"):
        write_files(NEW, Path(place))


def test_equal_input_gives_equal_bytes_in_every_process() -> None:
    code = (
        "import sys, hashlib; from pathlib import Path\n"
        "from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated\n"
        "from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills\n"
        "text = ''.join(generated(read_skills(LIBRARY / 'navigation.skills')).values())\n"
        "print(hashlib.sha256(text.encode()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env={"PYTHONHASHSEED": seed, "PATH": "/usr/bin:/bin"},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1")
    }
    assert len(digests) == 1
    assert generated(checked(PAPER).skills) == generated(checked(PAPER).skills)
    assert generated(read_skills(LIBRARY / "navigation.skills"))
