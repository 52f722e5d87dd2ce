"""Small equivalents of trees of others get the verdicts of the table, which has BehaviorTree.CPP 4.10's too."""

import json

import pytest

from tests.behavior_tree.others.cases import FOLDER, cases, verdict

TABLE = json.loads((FOLDER / "verdicts.json").read_text(encoding="utf-8"))
ROWS = [(file, name) for file, rows in TABLE.items() for name in rows]
CASES = {file: cases(file) for file in TABLE}


@pytest.mark.parametrize(("file", "name"), ROWS)
def test_tree_has_the_verdict_of_the_table(file: str, name: str) -> None:
    assert verdict(CASES[file][name]) == TABLE[file][name]["ours"]


def test_table_has_every_tree_and_a_reason_where_the_verdicts_differ() -> None:
    assert {path.name for path in FOLDER.glob("*.xml")} == set(TABLE)
    for file, rows in TABLE.items():
        assert set(rows) == set(CASES[file])
        for name, row in rows.items():
            assert ("reason" in row) == (row["btcpp"] != row["ours"]), name
