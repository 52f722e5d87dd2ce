"""How documents merge, as properties."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from regraft.stack import StackError, plain_document
from regraft.stack.assembly.merge import merge
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import Report

KEYS = st.sampled_from(["a", "b", "c", "d"])
SCALARS = st.one_of(st.integers(0, 3), st.sampled_from(["x", "y"]))
LEAVES = st.one_of(SCALARS, st.lists(SCALARS, max_size=3))
MAPS = st.recursive(
    st.dictionaries(KEYS, LEAVES, max_size=4), lambda maps: st.dictionaries(KEYS, maps | LEAVES, max_size=4)
)
PATCHES = st.recursive(
    st.dictionaries(KEYS, LEAVES | st.none(), max_size=4),
    lambda maps: st.dictionaries(KEYS, maps | LEAVES | st.none(), max_size=4),
)


def node(value: Any, file: str = "") -> Node:
    location = Location(file, 1)
    if isinstance(value, dict):
        return Node({key: node(part, file) for key, part in value.items()}, location)
    return Node(tuple(node(part, file) for part in value) if isinstance(value, list) else value, location)


def merged(*documents: Any) -> Any:
    """Return documents without nulls as one, which is never refused."""
    report, found = Report(""), node(documents[0])
    for document in documents[1:]:
        found = merge(found, node(document), report)
    assert report.problems == []
    return plain(found)


def assembled(folder: Path, files: dict[str, Any]) -> object:
    """Return what files say together, or which fields are refused; a list includes others of the files."""
    for name, content in files.items():
        document = {"include": content} if isinstance(content, list) else content
        (folder / name).write_text(json.dumps(document))
    try:
        return plain_document(folder / "stack.yaml")
    except StackError as error:
        return {problem.field for problem in error.problems}


@given(MAPS, PATCHES, PATCHES)
def test_it_is_all_one_which_files_are_put_together_first(one: Any, two: Any, three: Any) -> None:
    parts = {"1.yaml": one, "2.yaml": two, "3.yaml": three}
    with tempfile.TemporaryDirectory() as folder:
        at_once = assembled(Path(folder), parts | {"stack.yaml": ["1.yaml", "2.yaml", "3.yaml"]})
        first = parts | {"12.yaml": ["1.yaml", "2.yaml"], "stack.yaml": ["12.yaml", "3.yaml"]}
        assert assembled(Path(folder), first) == at_once
        last = parts | {"23.yaml": ["2.yaml", "3.yaml"], "stack.yaml": ["1.yaml", "23.yaml"]}
        assert assembled(Path(folder), last) == at_once


@given(MAPS, MAPS)
def test_a_file_applied_twice_is_as_applied_once(one: Any, two: Any) -> None:
    assert merged(one, two, two) == merged(one, two)
    assert merged(one, {}) == merged({}, one) == one


@given(MAPS, KEYS)
def test_null_removes_what_is_there_and_is_noted_where_nothing_is(one: Any, key: str) -> None:
    report = Report("")
    found = plain(merge(node(one), node({key: None}, "over"), report))
    assert found == {name: value for name, value in one.items() if name != key}
    assert [problem.field for problem in report.problems] == ([] if key in one else [key])
    assert all((problem.file, problem.line) == ("over", 1) for problem in report.problems)


@given(MAPS, PATCHES)
def test_a_value_is_from_where_it_was_written_last(one: Any, two: Any) -> None:
    found = merge(node(one, "one"), node(two, "two"), Report(""))
    assert isinstance(found.value, dict)
    for key, part in found.value.items():
        if isinstance(part.value, dict):
            continue
        assert part.location.file == ("two" if two.get(key) is not None else "one")
        assert plain(part) == (two[key] if two.get(key) is not None else one[key])
