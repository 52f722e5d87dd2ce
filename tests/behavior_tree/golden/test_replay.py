"""Replaying what BehaviorTree.CPP 4.10 did: what is compared, what is told, and that nothing stops it."""

import gzip
import json
import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

import pytest

from behavior_tree.leaves.scripts import Script
from behavior_tree.replay import main
from behavior_tree.traces import BadRecord, Line, Record, first_mismatch, parse_record
from tests.behavior_tree.random_trees import TreeMaker
from tests.behavior_tree.trees import document, leaf

GOLDEN = Path(__file__).with_name("btcpp_traces.jsonl.gz")
TREE = document(f"<Sequence>{leaf('RS', 'n')}<Script code='x := 1; y := 0.5'/></Sequence>")
GOOD: dict[str, Any] = {
    "xml": TREE,
    "mode": "exact",
    "halt_at": -1,
    "trace": [["R", "RRI", ["n:R"], {}], ["S", "III", ["n:S"], {"x": 1, "y": 0.5}]],
}


def changed(tick: int, column: int, value: Any) -> dict[str, Any]:
    """Return the good record with one thing in its trace changed."""
    record: dict[str, Any] = json.loads(json.dumps(GOOD))
    record["trace"][tick][column] = value
    return record


def write(path: Path, *records: Any) -> str:
    text = "".join((record if isinstance(record, str) else json.dumps(record)) + "\n" for record in records)
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return str(path)


def test_golden_traces_are_what_our_trees_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(GOLDEN)]) == 0, capsys.readouterr().out
    assert capsys.readouterr().out == "trees: 1500, mismatching: 0\n"


@pytest.mark.parametrize(("record", "code"), [(GOOD, 0), (changed(0, 0, "F"), 1), ("{", 2)])
def test_exit_code_of_the_command_says_how_it_went(record: Any, code: int, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "behavior_tree.replay", write(tmp_path / "t.jsonl.gz", record)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert bool(done.stderr) == (code == 2)


FAILING = document(f"<Sequence>{leaf('S', 'n')}<Script code='x := 1'/><Script code='y = 1'/></Sequence>")
FAILED = ["error", "RSSI", ["n:S"], {"x": 1}]


@pytest.mark.parametrize(
    ("line", "what"),
    [
        (FAILED, ""),
        (["error"], ""),
        (["error", "RSSF", ["n:S"], {"x": 1}], "tick 1: stored statuses: expected RSSF, got RSSI"),
        (["error", "RSSI", [], {"x": 1}], "tick 1: events: expected [], got ['n:S']"),
        (["error", "RSSI", ["n:S"], {"x": 2}], 'tick 1: blackboard: expected {"x": 2}, got {"x": 1}'),
    ],
)
def test_what_an_error_leaves_behind_is_compared_as_all_else(line: list[Any], what: str) -> None:
    record = parse_record(json.dumps({**GOOD, "xml": FAILING, "trace": [line, ["S", "", [], {}]]}))
    mismatch = first_mismatch(record)
    assert (str(mismatch) if mismatch else "") == what


def test_a_bug_of_the_engine_is_not_the_error_that_a_trace_tells_of(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_node: Script) -> int:
        raise TypeError("a slip")

    record = parse_record(json.dumps({**GOOD, "trace": [GOOD["trace"][0], ["error", "", [], {}]]}))
    monkeypatch.setattr(Script, "tick", broken)
    mismatch = first_mismatch(record)
    assert mismatch is not None
    assert "expected error, got crash" in str(mismatch)


def test_records_of_all_files_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    packed, plain = write(tmp_path / "a.jsonl.gz", GOOD, GOOD), write(tmp_path / "b.jsonl", GOOD, "")
    assert main([packed, plain]) == 0
    assert capsys.readouterr().out == "trees: 3, mismatching: 0\n"


@pytest.mark.parametrize(
    ("record", "what"),
    [
        (changed(0, 0, "F"), "tick 1: result: expected F, got R"),
        (changed(0, 1, "RRR"), "tick 1: stored statuses: expected RRR, got RRI"),
        (changed(1, 2, ["n:F"]), "tick 2: events: expected ['n:F'], got ['n:S']"),
        (changed(1, 3, {"x": 1.0}), 'tick 2: blackboard: expected {"x": 1.0}, got {"x": 1, "y": 0.5}'),
        (changed(1, 3, {"x": 1.0, "y": 0.5}), "tick 2: blackboard"),
        (changed(1, 3, {"x": True, "y": 0.5}), "tick 2: blackboard"),
        (changed(1, 3, {"x": "1", "y": 0.5}), "tick 2: blackboard"),
        (changed(1, 3, {"x": None, "y": 0.5}), "tick 2: blackboard"),
        (changed(1, 3, {"x": 1}), "tick 2: blackboard"),
        (changed(0, 3, {"x": None}), "tick 1: blackboard"),
        (changed(1, 0, "error"), "tick 2: result: expected error, got S"),
        ({**GOOD, "xml": TREE.replace("y := 0.5", "z = 1")}, "tick 2: result: expected S, got error: NodeError"),
        ({**GOOD, "xml": "<root"}, "tick 0: loading: expected a tree, got LoadError"),
        ({**GOOD, "halt_at": 2}, "tick 2: result: expected S, got I"),
    ],
)  # fmt: skip
def test_difference_is_told_with_its_place_and_both_sides(
    record: dict[str, Any], what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "t.jsonl.gz", GOOD, record, GOOD)
    assert main([file]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"{file}:2: {what}")
    assert lines[-1] == "trees: 3, mismatching: 1"


def test_only_the_first_mismatches_are_shown_but_all_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "t.jsonl", *[changed(0, 0, "F")] * 30)
    assert main([file, "--show", "3"]) == 1
    assert len(capsys.readouterr().out.splitlines()) == 4


@pytest.mark.parametrize(
    ("record", "message"),
    [
        ("{", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ("[1]", "a record is an object, not list"),
        *(({key: value for key, value in GOOD.items() if key != name}, f"'{name}' is missing") for name in GOOD),
        ({**GOOD, "mode": "twice"}, "the mode 'twice' is none of exact, once"),
        ({**GOOD, "halt_at": "4"}, "'halt_at' must be int, not str"),
        ({**GOOD, "halt_at": True}, "'halt_at' must be int, not bool"),
        ({**GOOD, "trace": [[]]}, "line 1 of the trace must be a list that begins with a letter"),
        ({**GOOD, "trace": [["R", "RRI", []]]}, "line 1 of the trace must have"),
        ({**GOOD, "trace": [["X", "", [], {}]]}, "'X' is none of the letters"),
        ({**GOOD, "trace": [["R", 5, [], {}]]}, "the statuses must be text"),
    ],
)
def test_bad_record_ends_the_replay_and_is_named_by_file_and_line(
    record: Any, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "t.jsonl", GOOD, record)
    assert main([file]) == 2
    out, err = capsys.readouterr()
    assert not out
    assert f"{file}:2: " in err
    assert message in err


def test_file_that_cannot_be_read_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    packed = Path(write(tmp_path / "t.jsonl.gz", *[GOOD] * 50))
    torn = tmp_path / "torn.gz"
    torn.write_bytes(packed.read_bytes()[:-40])
    empty = tmp_path / "empty.jsonl"
    empty.touch()
    binary = tmp_path / "binary"
    binary.write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "missing.gz", tmp_path, torn, empty, binary):
        assert main([str(path)]) == 2
        assert str(path) in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main([])


def test_error_in_the_trace_is_an_error_of_ours_too() -> None:
    script = document("<Script code='missing = 1'/>")
    for xml, mode in ((script, "exact"), (script, "once"), ("<root/>", "exact")):
        assert first_mismatch(Record(xml, mode, -1, (Line("error"),))) is None


def test_halt_is_replayed_as_behaviortree_cpp_does_it() -> None:
    body = (
        "<Sequence _onHalted=\"l := l .. 'r'\"><Script code=\"l := ''\"/>"
        f"{leaf('R', 'n', _onHalted='''l := l .. 'n' ''')}{leaf('R', 'm', _onHalted='''l := l .. 'm' ''')}</Sequence>"
    )
    lines = (Line("R", "RSRI", ("n:R",), (("l", ""),)), Line("I", "IIII", ("n:H",), (("l", "nrrnm"),)))
    assert first_mismatch(Record(document(body), "exact", 2, lines)) is None


def test_tree_that_never_has_enough_is_a_mismatch_and_no_endless_loop() -> None:
    xml = document("<Repeat num_cycles='-1'><AlwaysSuccess/></Repeat>")
    mismatch = first_mismatch(Record(xml, "once", -1, (Line("S", "II"),)))
    assert mismatch is not None
    assert mismatch.got == "R"


@pytest.mark.parametrize("everything", [False, True])
def test_no_tree_stops_the_replay_and_each_agrees_with_what_it_did_before(everything: bool) -> None:
    random = Random(7)
    agreed = 0
    for _ in range(150):
        xml = TreeMaker(random, everything=everything).document(random.randrange(1, 5))
        record = Record(xml, random.choice(("exact", "once")), random.choice((-1, 3)), (Line("R", "?"),) * 5)
        first, second = first_mismatch(record), first_mismatch(record)
        assert first == second
        agreed += first is not None
    assert agreed == 150


def test_record_survives_its_json() -> None:
    record = parse_record(json.dumps(GOOD))
    assert first_mismatch(record) is None
    with pytest.raises(BadRecord, match="no JSON"):
        parse_record("nonsense")
