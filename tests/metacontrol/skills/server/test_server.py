"""The language server answers an editor from its texts as they are, whole or half-written, and survives any of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.server.texts import MAX_TOKENS
from tests.metacontrol.skills.server.client import Editor
from tests.metacontrol.skills.texts import GOOD

pytestmark = pytest.mark.slow

IMPORTED = "Quality speed { better: lower, range: 0..1, weight: 0.5, curve: [0: 1, 1: 0] }\nContext Night\n"
TEXT = """\
import "base.skills"
Component motor {
  Configuration active.FAST { power: 2 },
  Configuration active.SLOW { power: 1 }
}
Skill move {
  quality attributes [speed]
  Realization go {
    Component motor active.FAST
    Quality [speed: 0.5];
    context: Default
  };
}
Realization crawl of move {
  Component motor active.SLOW
  Quality [speed: 0.1];
  context: Default
};
"""


@pytest.fixture(scope="module")
def editor() -> Iterator[Editor]:
    with Editor() as found:
        yield found


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a file that is not on disk, next to what it imports."""
    (tmp_path / "base.skills").write_text(IMPORTED)
    return tmp_path / "robot.skills"


def test_a_right_text_has_no_diagnostics(editor: Editor, file: Path) -> None:
    assert editor.diagnostics(editor.open(file, TEXT)) == []


def test_diagnostics_come_as_one_types_with_ranges_and_codes(editor: Editor, file: Path) -> None:
    uri = editor.open(file, TEXT)
    editor.change(uri, TEXT.replace("[speed: 0.5]", "[sped: 0.5]"), 2)
    found = editor.diagnostics(uri, 2)
    (one,) = [each for each in found if each["severity"] == 1]
    assert one["message"] == "the skill 'move' does not list the quality 'sped'; did you mean 'speed'?"
    assert (one["code"], one["source"]) == ("quality_not_listed", "regraft")
    assert one["range"] == {"start": {"line": 9, "character": 13}, "end": {"line": 9, "character": 22}}
    assert [each["code"] for each in found if each["severity"] == 2] == ["no_estimate"]
    editor.change(uri, TEXT, 3)
    assert editor.diagnostics(uri, 3) == []


def test_a_syntax_error_is_one_diagnostic_where_it_is(editor: Editor, file: Path) -> None:
    uri = editor.open(file, TEXT.replace("context: Default\n};", "contxt: Default\n};"))
    (one,) = editor.diagnostics(uri)
    assert (one["code"], one["range"]["start"]) == ("syntax", {"line": 16, "character": 2})


def test_errors_of_imported_files_are_shown_with_their_place(editor: Editor, file: Path) -> None:
    (file.parent / "base.skills").write_text("Quality")
    (one,) = editor.diagnostics(editor.open(file, TEXT))
    assert one["range"]["start"] == {"line": 0, "character": 0}
    assert one["message"].startswith(f"{file.parent / 'base.skills'}:1:8: expected a name")


def test_the_text_is_the_editors_and_not_the_file_on_disk(editor: Editor, file: Path) -> None:
    file.write_text("nonsense")
    assert editor.diagnostics(editor.open(file, TEXT)) == []


def test_a_closed_text_has_no_diagnostics(editor: Editor, file: Path) -> None:
    uri = editor.open(file, "Skill")
    assert len(editor.diagnostics(uri)) == 1
    editor.tell("textDocument/didClose", {"textDocument": {"uri": uri}})
    assert editor.symbols(uri) == []
    assert editor.hover(uri, 0, 1) == ""


TYPED = "Skill look {\n  quality attributes [speed]\n  input { at: | }\n}\n"
PLACES = [
    ("Realization x of |", {"move"}, {"speed", "Default"}),
    ("Realization x of mo|", {"move"}, {"Skill"}),
    ("Realization x of move {\n  requires |", {"move"}, {"speed"}),
    ("Realization x of move {\n  requires move [|", {"speed"}, {"move"}),
    ("Skill y {\n  quality attributes [|", {"speed"}, {"move"}),
    ("Realization x of move {\n  Component motor active\n  Quality [|", {"speed"}, {"motor"}),
    ("Realization x of move {\n  Component |", {"motor"}, {"speed"}),
    ("Realization x of move {\n  Component motor |", {"observable", "active.FAST", "inactive"}, {"motor"}),
    ("Realization x of move {\n  Component motor { Configuration |", {"active.SLOW", "unconfigured"}, {"motor"}),
    ("Component motor {\n  Configuration active.FAST { |", {"power"}, {"motor"}),
    ("Realization x of move {\n  Component motor active\n  context: |", {"Default", "Night"}, {"move"}),
    ("Realization x of move {\n  Component motor active\n  |", {"context", "Quality", "requires"}, {"better"}),
    (TYPED, {"PoseStamped", "float", "regraft/Pose"}, {"speed"}),
    ("Quality z { |", {"better", "range", "measured", "weight", "curve"}, {"Skill"}),
    ("Quality z { better: |", {"higher", "lower"}, {"better"}),
    ("|", {"Skill", "Realization", "Quality", "import"}, {"speed"}),
    ("Skill y {\n |", {"quality attributes", "input", "Realization"}, {"import"}),
    ("// Realization x of |", set(), {"move"}),
    ('Quality z { measured: "a |', set(), {"move", "better"}),
]


@pytest.mark.parametrize(("typed", "proposed", "others"), PLACES)
def test_half_written_text_is_completed_with_what_fits(
    editor: Editor, file: Path, typed: str, proposed: set[str], others: set[str]
) -> None:
    before, _, behind = typed.partition("|")
    uri = editor.open(file, TEXT)
    editor.diagnostics(uri)
    editor.change(uri, f"{TEXT}{before}{behind}", 2)
    lines = f"{TEXT}{before}".split("\n")
    found = editor.complete(uri, len(lines) - 1, len(lines[-1]))
    assert proposed <= set(found)
    assert not others & set(found)
    assert len(found) == len(set(found))


def test_a_text_that_was_never_right_is_completed_from_its_words_and_imports(editor: Editor, file: Path) -> None:
    text = 'import "base.skills"\nSkill run {\n  quality attributes [\nRealization a of '
    uri = editor.open(file, text)
    assert "speed" in editor.complete(uri, 2, 22)
    assert "run" in editor.complete(uri, 3, 17)


def test_a_word_is_described(editor: Editor, file: Path) -> None:
    uri = editor.open(file, TEXT)
    assert editor.hover(uri, 5, 7) == "Skill move\nqualities: speed\nrealizations: go, crawl"
    declared = "Quality speed\nbetter: lower\nrange: 0..1\nweight: 0.5\ncurve: [0: 1, 1: 0]"
    assert editor.hover(uri, 6, 25) == declared
    assert editor.hover(uri, 13, 14) == "Realization crawl of move\nestimates: speed 0.1\ncontext: Default"
    assert editor.hover(uri, 1, 12) == "Component motor\nconfigurations: active.FAST, active.SLOW"
    assert editor.hover(uri, 1, 16) == ""


def test_the_outline_has_what_is_in_the_text(editor: Editor, file: Path) -> None:
    uri = editor.open(file, TEXT)
    motor, move = editor.symbols(uri)
    assert (motor["name"], [each["name"] for each in motor["children"]]) == ("motor", ["active.FAST", "active.SLOW"])
    assert (move["name"], move["detail"], [each["name"] for each in move["children"]]) == (
        "move",
        "speed",
        ["go", "crawl"],
    )
    assert move["selectionRange"]["start"] == {"line": 5, "character": 6}
    assert move["range"]["end"]["line"] >= 14
    editor.change(uri, TEXT + "Skill", 2)
    assert [each["name"] for each in editor.symbols(uri)] == ["motor", "move"]


def test_columns_are_counted_as_the_editor_counts_them(file: Path) -> None:
    text = 'Quality speed { measured: "\U0001f600\u00e9", nonsense }\n'
    for encodings, column in (((), 33), (("utf-8",), 36), (("utf-32",), 32)):
        with Editor(encodings) as editor:
            (one,) = editor.diagnostics(editor.open(file, text))
            assert one["range"]["start"] == {"line": 0, "character": column}


NESTED = "{" * 50_000
BAD = [
    "",
    "\0",
    "\ufeff" + GOOD,
    NESTED,
    "[" * 50_000,
    "/*",
    '"' * 9_999,
    "Skill " * 9_000,
    "import " * 9_000,
    "\n" * 300_000,
    "a" * 1_000_000,
    "\u2028\u000b\u000c\r" * 99,
    "Quality q { weight: " + "9" * 100_000 + " }",
    'import "/"\nimport "\\0"\nimport "a.skills"',
]


@pytest.mark.parametrize("number", range(len(BAD)))
def test_no_text_ends_or_stops_the_server(editor: Editor, file: Path, number: int) -> None:
    uri = editor.open(file, BAD[number])
    editor.complete(uri, 0, 5)
    editor.hover(uri, 10**6, 10**6)
    editor.symbols(uri)
    editor.diagnostics(uri)
    editor.change(uri, TEXT, 2)
    assert editor.diagnostics(uri, 2) == []


def test_a_text_that_is_too_large_to_check_has_one_diagnostic(editor: Editor, file: Path) -> None:
    uri = editor.open(file, "a " * (MAX_TOKENS + 1))
    (one,) = editor.diagnostics(uri)
    assert one["code"] == "too_large"


def test_of_many_changes_the_last_one_counts(editor: Editor, file: Path) -> None:
    uri = editor.open(file, TEXT)
    for version in range(2, 100):
        editor.change(uri, TEXT + "Skill " * version, version)
    editor.change(uri, TEXT, 100)
    assert editor.diagnostics(uri, 100) == []


def test_messages_that_are_none_do_not_end_the_server(file: Path) -> None:
    with Editor() as editor:
        for body in (b"nonsense", b"{}", b"[]", b'{"jsonrpc": "2.0", "method": 7}', b"[" * 20_000):
            editor.raw(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        editor.tell("textDocument/didChange", {"textDocument": {"uri": 1}})
        assert editor.diagnostics(editor.open(file, TEXT)) == []


def test_a_text_without_a_file_is_checked(editor: Editor) -> None:
    uri = editor.open("untitled:Untitled-1", GOOD)
    assert editor.diagnostics(uri) == []


def test_the_server_ends_when_the_editor_shuts_it_down() -> None:
    with Editor() as editor:
        assert editor.close() == 0
