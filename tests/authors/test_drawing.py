"""Trees are drawn as graphs."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.authors.commands import mission, refused
from tests.executor.helpers import FROG, tree

TWO = """<root BTCPP_format="4" main_tree_to_execute="Outer">
<BehaviorTree ID="Outer"><Sequence name="all"><SubTree ID="Inner" name="first" goal="{g}"/><Grasp what='a "cup"\\'/>
<Inverter><AlwaysFailure/></Inverter></Sequence></BehaviorTree>
<BehaviorTree ID="Inner"><Fallback><ScriptCondition code="x &gt; 1"/><SubTree ID="Deepest"/></Fallback></BehaviorTree>
<BehaviorTree ID="Deepest"><AlwaysSuccess/></BehaviorTree></root>"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a file with a tree of sub-trees, one of whose leaves nobody knows."""
    (tmp_path / "two.xml").write_text(TWO)
    return tmp_path / "two.xml"


def test_a_graph_has_every_node_and_every_edge(file: Path) -> None:
    text = mission("dot", file).stdout
    assert text.startswith('digraph "Outer" {')
    assert set(re.findall(r"(n\d+) -> (n\d+);", text)) == {
        ("n1", "n2"), ("n2", "n3"), ("n3", "n4"), ("n3", "n5"), ("n5", "n6"), ("n1", "n7"), ("n1", "n8"), ("n8", "n9")
    }  # fmt: skip
    assert len(re.findall(r"n\d+ \[", text)) == 9
    assert 'label="first\\nInner\\ngoal = {g}"' in text


def test_a_label_cannot_end_before_its_text_does(file: Path) -> None:
    assert 'label="Grasp\\nwhat = a \\"cup\\"\\\\"];' in mission("dot", file).stdout


def test_each_sub_tree_has_a_frame_inside_the_one_that_uses_it(file: Path) -> None:
    lines = mission("dot", file).stdout.splitlines()
    depths = {line.strip().split()[0]: len(line) - len(line.lstrip()) for line in lines if " [" in line}
    assert depths["n2"] < depths["n3"] == depths["n5"] < depths["n6"]
    assert depths["n7"] == depths["n2"]
    assert sum("subgraph" in line for line in lines) == 2
    assert lines.count("}") == 1


def test_a_long_text_is_cut_short(tmp_path: Path) -> None:
    (tmp_path / "long.xml").write_text(tree(f'<Say text="{"x" * 500}"/>'))
    assert f'text = {"x" * 60}…"' in mission("dot", tmp_path / "long.xml").stdout


def test_what_nobody_knows_is_drawn_with_a_warning(file: Path) -> None:
    done = mission("dot", file)
    assert done.exit_code == 0
    assert f"{file.resolve()}:2: Grasp is unknown and mocked as action" in done.stderr


def test_frogs_mission_is_drawn_as_a_file(tmp_path: Path) -> None:
    out = tmp_path / "frog.dot"
    assert mission("dot", FROG, "--out", out).stdout == ""
    assert out.read_text() == mission("dot", FROG).stdout


def test_a_picture_is_drawn_by_graphviz_or_the_command_states_what_to_install(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "tree.svg"
    monkeypatch.setenv("PATH", "/nowhere")
    assert (
        "pictures need Graphviz's program 'dot': install the package graphviz"
        in mission("dot", file, "--out", out).stderr
    )
    program = tmp_path / "bin" / "dot"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\necho "<svg>$1"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}/usr/bin:/bin")
    assert mission("dot", file, "--out", out).exit_code == 0
    assert out.read_text() == "<svg>-Tsvg\n"


def test_a_faulty_tree_is_refused_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "bad.xml"
    file.write_text(tree('<Sleep msec="soon"/>'))
    assert f"{file}:2: port 'msec' is of type" in refused("dot", file)
    assert "nowhere.xml" in refused("dot", tmp_path / "nowhere.xml")
    file.write_text(f"<root>{' ' * 1_100_000}</root>")
    assert "at most 250000" in refused("dot", file)
    assert "must end in .dot or .svg" in refused("dot", FROG, "--out", "tree.png")
    assert "there is no tree 'Drve'" in refused("dot", FROG, "--main", "Drve")
