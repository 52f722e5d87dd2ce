"""Files of skills import others; a file that cannot be read, or is too large, is one error."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Diagnostic, SkillsError
from regraft.adaptation_manager.planners.metacontrol.skills.reading import (
    MAX_FILE_SIZE,
    MAX_FILES,
    checked_skills,
    read_skills,
)
from tests.metacontrol.skills.texts import GOOD, found, realization, skill


def write(folder: Path, **texts: str) -> Path:
    """Write files of skills, and return the first of them."""
    for name, text in texts.items():
        (folder / f"{name}.skills").write_text(text)
    return folder / f"{next(iter(texts))}.skills"


def only(file: Path) -> Diagnostic:
    """Return the only diagnostic of a file."""
    (one,) = checked_skills(file).diagnostics
    return one


def test_a_file_has_what_it_imports(tmp_path: Path) -> None:
    file = write(
        tmp_path, a='import "b.skills" import "c.skills"\n' + realization("x", of="move"), b=GOOD, c="Context C"
    )
    found = read_skills(file)
    assert [each.name for each in found.realizations] == ["go", "x"]
    assert [each.text for each in found.contexts] == ["C"]
    assert [Path(each.file).name for each in found.files][-1] == "a.skills"


def test_a_file_that_is_imported_twice_is_read_once(tmp_path: Path) -> None:
    file = write(tmp_path, a='import "b.skills" import "c.skills"', b='import "c.skills"', c=GOOD)
    assert checked_skills(file).diagnostics == ()


def test_an_import_is_looked_for_in_the_folder_of_its_file_and_then_in_the_library(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    write(tmp_path / "below", b='import "c.skills"', c=GOOD)
    file = write(tmp_path, a='import "below/b.skills"')
    assert [each.name for each in read_skills(file).skills] == ["move"]
    library = read_skills(write(tmp_path, a='import "navigation_definitions.skills"'))
    assert library.quality("energy") is not None
    own = read_skills(write(tmp_path, a='import "navigation_definitions.skills"', navigation_definitions=GOOD))
    assert [each.name for each in own.skills] == ["move"]


def test_what_is_wrong_in_an_imported_file_is_reported_there(tmp_path: Path) -> None:
    file = write(tmp_path, a='import "b.skills"', b=f"\n{GOOD.replace('[speed: 0.5]', '[sped: 0.5]')}")
    first = checked_skills(file).diagnostics[0]
    assert (Path(first.place.file).name, first.place.line) == ("b.skills", 3)


def test_an_import_that_is_not_there_is_refused_with_the_nearest_name(tmp_path: Path) -> None:
    file = write(tmp_path, a='\nimport "navigatio.skills"')
    one = only(file)
    assert (one.code, one.place.line) == (Code.NO_SUCH_IMPORT, 2)
    assert one.message == "there is no file 'navigatio.skills'; did you mean 'navigation.skills'?"
    assert "must be a file of skills" in only(write(tmp_path, a='import "a.yaml"')).message
    assert only(write(tmp_path, a='import "a\\0.skills"')).code in (Code.NO_SUCH_IMPORT, Code.UNREADABLE)


def test_files_that_import_each_other_are_refused(tmp_path: Path) -> None:
    file = write(
        tmp_path,
        a='import "b.skills"',
        b='import "c.skills"',
        c='import "a.skills"',
    )
    one = only(file)
    assert one.code is Code.IMPORT_CIRCLE
    assert one.message == "imports itself: a.skills > b.skills > c.skills > a.skills"
    assert only(write(tmp_path, a='import "a.skills"')).message == "imports itself: a.skills > a.skills"


@pytest.mark.parametrize("shape", ["chain", "list"])
def test_the_number_of_imports_is_limited(tmp_path: Path, shape: str) -> None:
    names = [f"f{number}" for number in range(MAX_FILES + 10)]
    for name, following in itertools.pairwise(names):
        write(tmp_path, **{name: f'import "{following}.skills"' if shape == "chain" else ""})
    write(tmp_path, **{names[-1]: ""})
    if shape == "list":
        write(tmp_path, f0="\n".join(f'import "{name}.skills"' for name in names[1:]))
    found = checked_skills(tmp_path / "f0.skills").diagnostics
    assert [each.code for each in found] == [Code.TOO_MANY_IMPORTS]


def test_files_of_the_published_tool_are_read(tmp_path: Path) -> None:
    file = tmp_path / "robot.mros"
    file.write_text(f"\ufeffSkillDefinitionSet {{ {GOOD} }}".replace("\n", "\r\n"), encoding="utf-8")
    assert checked_skills(file).diagnostics == ()


@pytest.mark.parametrize(
    ("content", "code", "message"),
    [
        (None, Code.UNREADABLE, "there is no such file"),
        (b"\n\n Context \xff", Code.UNREADABLE, "is not UTF-8 text: byte 0xff"),
        (b" " * (MAX_FILE_SIZE + 1), Code.TOO_LARGE, "must be at most 1024 KiB"),
        (b"a:1," * 60_000, Code.TOO_LARGE, "must have at most 200000 words and marks"),
        (b"\0", Code.SYNTAX, "expected"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_error(
    tmp_path: Path, content: bytes | None, code: Code, message: str
) -> None:
    file = tmp_path / "f.skills"
    if content is not None:
        file.write_bytes(content)
    one = only(file)
    assert one.code is code
    assert message in one.message
    with pytest.raises(SkillsError, match=r"f\.skills:\d+:\d+: error: "):
        read_skills(file)


def test_the_words_of_all_files_together_are_limited(tmp_path: Path) -> None:
    many = f"/* {'word ' * 12_000} */"
    names = [f"f{number}" for number in range(20)]
    for name in names:
        write(tmp_path, **{name: many})
    file = write(tmp_path, a="\n".join(f'import "{name}.skills"' for name in names))
    assert Code.TOO_LARGE in [each.code for each in checked_skills(file).diagnostics]


def test_what_is_no_file_of_skills_is_refused(tmp_path: Path) -> None:
    (tmp_path / "folder.skills").mkdir()
    assert only(tmp_path / "folder.skills").message == "is a folder, must be a file of skills"
    os.mkfifo(tmp_path / "pipe.skills")
    assert only(tmp_path / "pipe.skills").message == "is not an ordinary file"
    (tmp_path / "endless.skills").symlink_to("/dev/zero")
    assert only(tmp_path / "endless.skills").message == "is not an ordinary file"
    (tmp_path / "loop.skills").symlink_to(tmp_path / "loop.skills")
    assert only(tmp_path / "loop.skills").code is Code.UNREADABLE
    (tmp_path / "f.yaml").write_text(GOOD)
    assert "its name must end in .skills or .mros" in only(tmp_path / "f.yaml").message
    assert only(tmp_path / ("x" * 300 + ".skills")).code is Code.UNREADABLE


def test_many_realizations_and_errors_are_checked_in_one_pass() -> None:
    many = [realization(f"r{number}", f"Component c{number} active", "Quality [sped: 1];") for number in range(300)]
    assert len(found(skill(*many), Code.QUALITY_NOT_LISTED)) == 300
