"""A file that cannot be read as a stack is refused, saying where and why."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.stack.reading.files import GOOD, problems, problems_of, write


def test_missing_file_is_named(tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path / "nowhere.yaml")
    assert str(problem) == f"{tmp_path}/nowhere.yaml: there is no such file"


def test_folder_is_refused_naming_the_stack_file_in_it(tmp_path: Path) -> None:
    write(tmp_path, GOOD)
    (problem,) = problems_of(tmp_path)
    assert problem.problem == f"is a folder: did you mean {tmp_path}/stack.yaml?"


def test_folder_without_a_stack_file_is_refused(tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path)
    assert problem.problem == "is a folder, must be a stack file"


def test_pipe_is_refused_rather_than_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (problem,) = problems_of(tmp_path / "pipe")
    assert problem.problem == "is not an ordinary file"


def test_links_that_lead_in_a_circle_are_refused(tmp_path: Path) -> None:
    (tmp_path / "here.yaml").symlink_to(tmp_path / "there.yaml")
    (tmp_path / "there.yaml").symlink_to(tmp_path / "here.yaml")
    (problem,) = problems_of(tmp_path / "here.yaml")
    assert problem.problem == "cannot be read: Too many levels of symbolic links"


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing but a remark\n", "---\n"])
def test_empty_file_is_refused(tmp_path: Path, text: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert problem.problem.startswith(("is empty", "must be a map"))


@pytest.mark.parametrize(("text", "kind"), [("- a\n- b\n", "a list"), ("frog\n", "a text"), ("7\n", "a number")])
def test_file_that_is_no_map_is_refused(tmp_path: Path, text: str, kind: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert problem.line == 1
    assert problem.problem == f"must be a map of fields such as 'system' and 'components', is {kind}"


def test_huge_file_is_refused(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "# " + "x" * 300_000)
    assert problem.problem == "is too large for a stack file: must be at most 256 KiB"


def test_text_that_is_not_utf8_is_refused_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "stack.yaml"
    file.write_bytes(b"system: frog\n# caf\xe9\n")
    (problem,) = problems_of(file)
    assert (problem.line, problem.problem) == (2, "is not UTF-8 text: byte 0xe9 does not belong there")


def test_control_character_is_refused_with_its_line(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: frog\nclock: re\x07al\n")
    assert (problem.line, problem.problem) == (2, "holds the character U+0007, which YAML does not allow")


def test_tab_in_the_indentation_is_named(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: frog\ncomponents:\n\tworld: {}\n")
    assert (problem.line, problem.problem) == (3, "is not YAML: a tab in the indentation (column 1): must be spaces")


@pytest.mark.parametrize(
    ("text", "line", "place"),
    [
        ("system:\tfrog\n", 1, "after 'system:' (column 8)"),
        ("system: frog\ncomponents:\n  a:\t{class: b}\n", 3, "after 'a:' (column 5)"),
        ("system: frog\nhosts:\n-\tedge\n", 3, "after '-' (column 2)"),
        ("system: frog\nclock: real\t\n  x\n", 2, "after 'real' (column 12)"),
    ],
)
def test_a_tab_within_a_line_is_no_indentation(tmp_path: Path, text: str, line: int, place: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert (problem.line, problem.problem) == (line, f"is not YAML: a tab {place}: must be a space")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("system: frog\ntopics: {a: b\n", 3),
        ("system: 'frog\n", 2),
        ("system: frog\n  clock: real\n", 2),
        ("system: *nobody\n", 1),
        ("system: frog\n---\nsystem: toad\n", 2),
        ("system: [frog\nclock: }\n", 2),
    ],
)
def test_text_that_is_not_yaml_is_refused_with_its_line(tmp_path: Path, text: str, line: int) -> None:
    (problem,) = problems(tmp_path, text)
    assert problem.line == line
    assert problem.problem.startswith("is not YAML: ")


def test_every_duplicate_key_is_found(tmp_path: Path) -> None:
    text = "system: frog\nsystem: toad\ncomponents:\n  eye: {class: 'a:B'}\n  eye: {class: 'c:D'}\n"
    first, second = problems(tmp_path, text)
    assert (first.line, first.field) == (2, "system")
    assert str(second).endswith("stack.yaml:5: components.eye: is given twice, first in line 4: leave one out")


def test_tag_is_refused(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: !!python/name:os.system frog\n")
    assert (problem.line, problem.field) == (1, "system")
    assert "python/name:os.system" in problem.problem


def test_key_that_is_a_list_is_refused(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: frog\n? [a, b]\n: c\n")
    assert (problem.line, problem.problem) == (2, "a key must be a name, not a list or a map")


def test_swelling_aliases_are_refused(tmp_path: Path) -> None:
    bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30)
    )
    (problem,) = problems(tmp_path, bomb)
    assert problem.problem == "holds more than 20000 values, counting what aliases stand for"


def test_alias_to_what_holds_it_is_refused(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "system: &own [*own]\n")
    assert problem.problem == "is nested too deeply: must have at most 32 levels"


@pytest.mark.parametrize("text", ["[" * 100_000, "a: " + "{b: " * 5_000, "- " * 100_000])
@pytest.mark.parametrize("limit", [None, 20_000])
def test_deep_nesting_is_refused_whatever_limit_python_has(tmp_path: Path, text: str, limit: int | None) -> None:
    usual = sys.getrecursionlimit()
    sys.setrecursionlimit(limit or usual)
    try:
        (problem,) = problems(tmp_path, text)
    finally:
        sys.setrecursionlimit(usual)
    assert problem.problem.startswith("is nested too deeply")


@pytest.mark.parametrize("text", ['system: "\\UFFFFFFFF"\n', f"%YAML 1.{'9' * 5000}\n---\nsystem: a\n"])
def test_numbers_that_yaml_cannot_hold_are_refused(tmp_path: Path, text: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert problem.problem.startswith("is not YAML: it holds a number that is too large")
