"""Blackboards, scripts and loading errors: what BehaviorTree.CPP 4.10 answered to random documents of `BoardMaker`."""

import gzip
from collections.abc import Iterator
from pathlib import Path
from random import Random

from behavior_tree import LoadError, load_text
from behavior_tree.traces import ERROR, Line, Record, first_mismatch, parse_record
from tests.behavior_tree.golden.random_boards import BoardMaker
from tests.behavior_tree.golden.typed_leaves import typed_registry
from tests.behavior_tree.trees import document

BOARDS = Path(__file__).with_name("btcpp_boards.jsonl.gz")
TRACES = Path(__file__).with_name("btcpp_traces.jsonl.gz")


def records(path: Path) -> Iterator[Record]:
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        yield from map(parse_record, lines)


def test_entries_scripts_and_faults_are_answered_as_behaviortree_cpp_answered_them() -> None:
    refused = failed = ran = 0
    for record in records(BOARDS):
        mismatch = first_mismatch(record, typed_registry)
        assert mismatch is None, f"{record.xml}\n{mismatch}"
        if not record.trace:
            refused += 1
        elif record.trace[-1].root == ERROR:
            failed += 1
        else:
            ran += 1
    assert min(refused, failed, ran) > 200


def test_what_an_error_leaves_behind_is_in_every_golden_trace_that_ends_in_one() -> None:
    errors = 0
    for path in (TRACES, BOARDS):
        for record in records(path):
            for line in record.trace:
                errors += line.root == ERROR
                assert line.statuses
    assert errors > 200


def test_tree_that_was_to_be_refused_and_is_not_is_a_mismatch() -> None:
    loaded = first_mismatch(Record(document("<AlwaysSuccess/>"), "exact", -1, ()))
    assert str(loaded) == "tick 0: loading: expected a refusal, got a tree"
    assert first_mismatch(Record(document("<Unknown/>"), "exact", -1, ())) is None
    refused = first_mismatch(Record(document("<Unknown/>"), "exact", -1, (Line("S", "I"),)))
    assert refused is not None
    assert refused.what == "loading"


def test_no_document_does_anything_but_load_or_be_refused() -> None:
    maker = BoardMaker(Random(3))
    loaded = 0
    for _ in range(300):
        xml = maker.document()
        try:
            load_text(xml, typed_registry([]))
            loaded += 1
        except LoadError as error:
            assert error.line > 0, xml
    assert 30 < loaded < 270
