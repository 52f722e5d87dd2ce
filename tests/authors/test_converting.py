"""Trees of BehaviorTree.CPP's version 3 become trees of version 4."""

from __future__ import annotations

from pathlib import Path
from random import Random
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behavior_tree import SUCCESS, LoadError, Registry, load_text
from behavior_tree.xml.version3 import to_version_4
from tests.authors.commands import mission, refused
from tests.behavior_tree.random_trees import TreeMaker

OLD = """<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- kept: <SequenceStar> -->
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <SequenceStar name="s">{body}
    </SequenceStar>
  </BehaviorTree>
  <BehaviorTree ID="Sub"><AlwaysSuccess/></BehaviorTree>
</root>
"""

TABLE = [
    (
        "<Control ID='SequenceStar'><AlwaysSuccess/></Control>",
        '<Control ID="SequenceWithMemory"><AlwaysSuccess/></Control>',
    ),
    ("<SequenceStar ><AlwaysSuccess/></SequenceStar >", "<SequenceWithMemory ><AlwaysSuccess/></SequenceWithMemory >"),
    ('<SubTree ID="Sub" goal="there"/>', '<SubTree ID="Sub" goal="{there}"/>'),
    ('<SubTree ID="Sub" goal="{there}" name="n"/>', '<SubTree ID="Sub" goal="{there}" name="n"/>'),
    ('<SubTree ID="Sub" __shared_blackboard="false"/>', '<SubTree ID="Sub"/>'),
    ('<SubTree ID="Sub" __shared_blackboard="true" a="b"/>', '<SubTree ID="Sub" _autoremap="true"/>'),
    (
        '<SubTreePlus ID="Sub" a="{b}" c="3" __autoremap="1"/>',
        '<SubTree ID="Sub" a="{b}" c="3" _autoremap="1"/>',
    ),
    (
        '<Parallel success_threshold="1" failure_threshold="1"><AlwaysSuccess/></Parallel>',
        '<Parallel success_count="1" failure_count="1"><AlwaysSuccess/></Parallel>',
    ),
    (
        '<RetryUntilSuccesful num_attempts="3"><AlwaysSuccess/></RetryUntilSuccesful>',
        '<RetryUntilSuccessful num_attempts="3"><AlwaysSuccess/></RetryUntilSuccessful>',
    ),
    (
        '<BlackboardCheckInt value_A="{n}" value_B="-5" return_on_mismatch="RUNNING"><Reset/></BlackboardCheckInt>',
        '<Precondition if="n == -5" else="RUNNING"><Reset/></Precondition>',
    ),
    (
        '<Decorator ID="BlackboardCheckString" value_A="{n}" value_B="a b"><AlwaysSuccess/></Decorator>',
        '<Decorator ID="Precondition" if="n == \'a b\'"><AlwaysSuccess/></Decorator>',
    ),
    (
        '<BlackboardCheckBool value_A="{n}" value_B="1"><AlwaysSuccess/></BlackboardCheckBool>',
        '<Precondition if="n == true"><AlwaysSuccess/></Precondition>',
    ),
    ('<Sleep msec="5"/><!-- <SubTree ID="x" a="b"/> -->', '<Sleep msec="5"/><!-- <SubTree ID="x" a="b"/> -->'),
]


@pytest.mark.parametrize(("old", "new"), TABLE, ids=[old[:40] for old, _ in TABLE])
def test_each_construct_has_its_equivalent(old: str, new: str) -> None:
    converted = to_version_4(OLD.format(body=old))
    assert new in converted.text
    assert converted.left == ()
    load_text(converted.text, Registry(), mock_unknown=True)


def test_all_else_stays_as_it_was() -> None:
    body = "\n      <Sleep   msec = '5'\n   name=\"a &amp; b\" />"
    text = to_version_4(OLD.format(body=body)).text
    assert text.splitlines()[:3] == [
        '<?xml version="1.0" encoding="UTF-8"?>',
        "<!-- kept: <SequenceStar> -->",
        '<root main_tree_to_execute="Main" BTCPP_format="4">',
    ]
    assert len(text.splitlines()) == len(OLD.format(body=body).splitlines())
    assert 'name="a &amp; b" />' in text
    assert load_text(text, Registry()).tick_once() != SUCCESS


def test_models_get_the_new_names_and_keep_their_sub_trees() -> None:
    models = '<Control ID="SequenceStar"/><SubTree ID="Sub"><input_port name="a"/></SubTree>'
    models = f"<TreeNodesModel>{models}</TreeNodesModel>"
    text = to_version_4(OLD.format(body="<AlwaysSuccess/>").replace("</root>", f"{models}</root>")).text
    assert '<Control ID="SequenceWithMemory"/><SubTree ID="Sub"><input_port name="a"/></SubTree>' in text


@pytest.mark.parametrize(
    ("old", "told"),
    [
        ("<ManualSelector><AlwaysSuccess/></ManualSelector>", "version 4 has no such node"),
        (
            """<BlackboardCheckString value_A="{n}" value_B="it's"><AlwaysSuccess/></BlackboardCheckString>""",
            "cannot be compared",
        ),
        (
            '<BlackboardCheckInt value_A="{n}" value_B="five"><AlwaysSuccess/></BlackboardCheckInt>',
            "cannot be compared",
        ),
        ('<AlwaysSuccess _skipIf="{n}"/>', "_skipIf is a script in version 4"),
    ],
)
def test_what_has_no_equivalent_is_named_with_its_line_and_exits_with_1(old: str, told: str, tmp_path: Path) -> None:
    file, out = tmp_path / "old.xml", tmp_path / "new.xml"
    file.write_text(OLD.format(body=f"\n{old}"))
    done = mission("convert", file, "--out", out)
    assert done.exit_code == 1
    assert f"{file}:6: " in done.stderr
    assert told in done.stderr
    assert 'BTCPP_format="4"' in out.read_text()


def test_a_difference_that_may_matter_is_noted(tmp_path: Path) -> None:
    (tmp_path / "old.xml").write_text(OLD.format(body=TABLE[9][0]))
    done = mission("convert", tmp_path / "old.xml")
    assert done.exit_code == 0
    assert "old.xml:5: BlackboardCheckInt: Precondition asks only when its child starts" in done.stderr
    assert 'if="n == -5"' in done.stdout


def test_a_file_that_is_no_tree_of_version_3_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "old.xml"
    assert "cannot be read" in refused("convert", file)
    for text, told in [
        ('<root BTCPP_format="4"/>', f"{file}:1: the document is of version 4 already"),
        ("<root>", "not well-formed XML"),
        ("<trees/>", "it must be <root>"),
        ("", "is empty"),
        (" " * 1_000_001, "must have at most 1000000 bytes"),
        ("<root><!DOCTYPE x></root>", "not well-formed"),
    ]:
        file.write_text(text)
        assert told in refused("convert", file)
    file.write_text(OLD.format(body="<AlwaysSuccess/>"))
    assert "--out" in refused("convert", file, "--out", tmp_path / "nowhere" / "new.xml")


@given(st.integers(0, 2**32), st.booleans())
def test_a_tree_without_old_constructs_stays_the_same_tree(seed: int, everything: bool) -> None:
    text = TreeMaker(Random(seed), everything=everything).document().replace('BTCPP_format="4" ', "")
    text = text.replace("<SubTree", "<SubTreePlus").replace("_autoremap", "__autoremap")
    try:
        converted = to_version_4(text).text
    except LoadError:
        return  # An odd attribute made it no XML.
    back = converted.replace("<SubTree ", "<SubTreePlus ").replace("_autoremap", "__autoremap")
    old, new = (ElementTree.fromstring(each) for each in (text, back))
    new.attrib.pop("BTCPP_format")
    assert ElementTree.canonicalize(ElementTree.tostring(new)) == ElementTree.canonicalize(ElementTree.tostring(old))
