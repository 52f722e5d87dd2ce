"""Whatever is wrong with a tree is said when it is loaded, with file, line and reason."""

from pathlib import Path

import pytest

from behavior_tree import LoadError, load_file, load_text
from tests.behavior_tree.trees import document, plain_registry, ticks, tree_of

LEAF = "<AlwaysSuccess/>"


def error_of(text: str, main: str = "", *, lenient: bool = True) -> LoadError:
    with pytest.raises(LoadError) as caught:
        load_text(text, plain_registry(), main=main, lenient=lenient)
    return caught.value


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<Nonsense/>", "unknown node type 'Nonsense'"),
        ("<SequenceStar><AlwaysSuccess/></SequenceStar>", "version 4 calls it SequenceWithMemory"),
        ("<Sequence/>", "control node Sequence needs at least 1 child"),
        ("<Inverter/>", "decorator Inverter needs exactly 1 child, it has 0"),
        (f"<Inverter>{LEAF}{LEAF}</Inverter>", "it has 2"),
        (f"<AlwaysSuccess>{LEAF}</AlwaysSuccess>", "action AlwaysSuccess takes no children"),
        (
            f'<ScriptCondition code="1">{LEAF}</ScriptCondition>',
            "condition ScriptCondition takes no children",
        ),
        (f'<SubTree ID="M">{LEAF}</SubTree>', "<SubTree> takes no children"),
        ('<SubTree ID="T"/>', "there is no tree 'T'"),
        ("<SubTree/>", "<SubTree> needs an ID"),
        ('<SubTree ID="M"/>', "a tree cannot contain itself: M → M"),
        ("<Action/>", "<Action> needs an ID"),
        ('<AlwaysSuccess ID="x"/>', "must not have an ID"),
        ('<Action ID="Nonsense"/>', "unknown node type 'Nonsense'"),
        (f"<TryCatch>{LEAF}</TryCatch>", "TryCatch needs at least 2 children"),
        (f"<IfThenElse>{LEAF}</IfThenElse>", "IfThenElse needs at least 2 children"),
        (f"<WhileDoElse>{LEAF * 4}</WhileDoElse>", "WhileDoElse takes at most 3 children"),
        (f'<Switch2 variable="{{x}}" case_1="1" case_2="2">{LEAF * 2}</Switch2>', "Switch2 needs at least 3"),
        (f'<Parallel success_count="3">{LEAF}</Parallel>', "success_count is 3, more than the 1 child"),
        (f'<ParallelAll max_failures="2">{LEAF}</ParallelAll>', "max_failures is 2, more than the 1 child"),
        ('<AlwaysSuccess speed="3"/>', "AlwaysSuccess has no port 'speed'; its ports: none"),
        ('<Sleep msec="long"/>', "port 'msec' is of type int: 'long' is not a whole number"),
        ('<Script code="x :="/>', "expected a value"),
        ("<Script/>", "input 'code' is not given"),
        ('<AlwaysSuccess _skipIf="1 +"/>', "_skipIf: column"),
        ('<AlwaysSuccess _post="x := 65."/>', "_post: column"),
        (f'<Precondition if="(">{LEAF}</Precondition>', "expected a value"),
        (f"<Precondition>{LEAF}</Precondition>", "input 'if' is not given"),
        (f'<Precondition if="1" else="MAYBE">{LEAF}</Precondition>', "'MAYBE' is not a status"),
        ('<Sequence name="a&#1;b"/>', "not well-formed"),
        ('<Sleep msec="{k}" name="a&#9;b"/>', "control character"),
        (
            f"<ReactiveSequence>{f'<AsyncSequence>{LEAF}</AsyncSequence>' * 2}</ReactiveSequence>",
            "only one Async",
        ),
        (
            f'<Delay delay_msec="{{k}}"><RunOnce then_skip="{{k}}">{LEAF}</RunOnce></Delay>',
            "entry 'k' is of type int; it cannot become bool",
        ),
    ],
)
def test_faulty_node_is_refused_with_its_line_and_the_reason(body: str, message: str) -> None:
    error = error_of(document("\n\n" + body))
    assert message in error.message
    assert error.line == 3
    assert str(error).startswith("<text>:3: ")


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("<root>\n<BehaviorTree>", 2, "not well-formed"),
        ("", 1, "not well-formed"),
        ("\n<tree/>", 2, "it must be <root>"),
        ("<root>\n<TreeNodesModel/>\n<TreeNodesModel/></root>", 3, "only one <TreeNodesModel>"),
        (
            f"<root><BehaviorTree>{LEAF}</BehaviorTree>\n<BehaviorTree ID='A'>{LEAF}</BehaviorTree></root>",
            1,
            "an ID",
        ),
        ("<root>\n<BehaviorTree ID='M'/></root>", 2, "needs exactly 1 child, it has 0"),
        (f"<root>\n<BehaviorTree ID='Sequence'>{LEAF}</BehaviorTree></root>", 2, "the name of a node type"),
        (document(LEAF, f"\n<BehaviorTree ID='M'>{LEAF}</BehaviorTree>"), 2, "two trees have the ID 'M'"),
        (document(LEAF, "\n<include/>"), 2, "<include> needs a path"),
        (document(LEAF, "\n<include path='missing.xml'/>"), 2, "included file not found"),
        (document(LEAF, "\n<TreeNodesModel><Action/></TreeNodesModel>"), 2, "needs an ID"),
        ('<!DOCTYPE root [\n<!ENTITY a "b">]><root/>', 2, "must not declare entities"),
    ],
)
def test_faulty_document_is_refused_with_its_line_and_the_reason(text: str, line: int, message: str) -> None:
    error = error_of(text)
    assert message in error.message
    assert error.line == line


def test_main_tree_must_exist_and_be_unambiguous() -> None:
    two = "".join(f"<BehaviorTree ID='{name}'>{LEAF}</BehaviorTree>" for name in "AB")
    assert "set main_tree_to_execute" in str(error_of(f"<root>{two}</root>"))
    assert "there is no tree 'C'; there are 'A', 'B'" in str(error_of(f"<root>{two}</root>", main="C"))
    assert "there is no tree 'C'" in str(error_of(f"<root main_tree_to_execute='C'>{two}</root>"))
    assert str(error_of("\n<root/>")).startswith("<text>:2: set main_tree_to_execute")


def test_single_tree_needs_neither_id_nor_main_tree() -> None:
    tree = load_text(f"<root BTCPP_format='4'><BehaviorTree>{LEAF}</BehaviorTree></root>", plain_registry())
    assert ticks(tree, 1) == "S"


def test_trees_that_contain_each_other_are_refused() -> None:
    error = error_of(
        document(
            '<SubTree ID="A"/>',
            '<BehaviorTree ID="A"><SubTree ID="B"/></BehaviorTree>',
            '\n<BehaviorTree ID="B"><SubTree ID="A"/></BehaviorTree>',
        )
    )
    assert "A → B → A" in error.message
    assert error.line == 2


def test_faulty_tree_is_found_even_if_it_is_not_executed() -> None:
    error = error_of(document(LEAF, "\n<BehaviorTree ID='A'><Nonsense/></BehaviorTree>"))
    assert error.line == 2


def test_sub_trees_of_the_same_name_under_one_parent_are_refused() -> None:
    sub = "<BehaviorTree ID='T'><AlwaysSuccess/></BehaviorTree>"
    two = '<Sequence><SubTree ID="T" name="x"/>\n<SubTree ID="T" name="x"/></Sequence>'
    error = error_of(document(two, sub))
    assert "two sub-trees have the path 'x'" in error.message
    assert error.line == 2


def nested(levels: int) -> str:
    return "<Inverter>" * (levels - 1) + LEAF + "</Inverter>" * (levels - 1)


def test_256_levels_run_and_more_are_refused() -> None:
    tree = tree_of(nested(256))
    assert ticks(tree, 1) == "F"
    tree.describe()
    tree.halt_tree()
    assert "nested deeper than 256 levels" in error_of(document(nested(257))).message


def test_sub_trees_may_add_up_to_more_levels() -> None:
    subs = [
        f"<BehaviorTree ID='T{number}'>"
        + nested(200).replace(LEAF, f"<SubTree ID='T{number + 1}'/>")
        + "</BehaviorTree>"
        for number in range(5)
    ]
    last = f'<BehaviorTree ID="T5">{LEAF}</BehaviorTree>'
    tree = tree_of('<SubTree ID="T0"/>', *subs, last)
    assert len(tree.nodes) == 1 + 5 * 200 + 1
    assert ticks(tree, 1) == "F"


def test_file_that_cannot_be_read_is_a_load_error(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match=r"missing\.xml"):
        load_file(tmp_path / "missing.xml", plain_registry())


def test_doubtful_things_are_warned_of_but_loaded() -> None:
    tree = load_text(
        "<root>\n<BehaviorTree ID='M'>\n<WhileDoElse _skipif='0'>\n"
        "<Scripted script='S'/><AlwaysSuccess/></WhileDoElse></BehaviorTree><Extra/></root>",
        plain_registry(),
    )
    text = "\n".join(tree.warnings)
    assert 'BTCPP_format="4" is missing' in text
    assert "<text>:3: is _skipif meant as _skipIf?" in text
    assert "<text>:3: WhileDoElse asks a stateful action" in text
    assert "<Extra> in <root> is ignored" in text


ILL_FORMED = document(f"<Sequence>\n<!-- <!-- old -->\n{LEAF}</Sequence>") + "\nleft over"


def test_ill_formed_comments_are_accepted_with_a_warning_unless_they_are_forbidden() -> None:
    assert "not well-formed" in error_of(ILL_FORMED, lenient=False).message
    tree = load_text(ILL_FORMED, plain_registry())
    assert ticks(tree, 1) == "S"
    assert "read leniently" in tree.warnings[0]
    assert tree.nodes[1].setup.line == 3


def test_attributes_of_editors_are_kept() -> None:
    tree = tree_of('<AlwaysSuccess _description="why" _uid="7"/>')
    assert tree.root.setup.other_attributes == {"_description": "why", "_uid": "7"}
    assert not tree.warnings


@pytest.mark.parametrize("form", ['<Action ID="AlwaysSuccess"/>', '<Control ID="Sequence"><AlwaysSuccess/></Control>'])
def test_long_form_means_the_same_as_the_short_one(form: str) -> None:
    tree = tree_of(form)
    assert tree.root.type_id in ("AlwaysSuccess", "Sequence")
    assert ticks(tree, 1) == "S"


OLD = "<root {0}main_tree_to_execute='M'><BehaviorTree ID='M'>\n{1}</BehaviorTree></root>"


@pytest.mark.parametrize(
    ("tag", "hint"),
    [
        ("SequenceStar", "version 4 calls it SequenceWithMemory"),
        ("SubTreePlus", "version 4 calls it SubTree"),
        ("RetryUntilSuccesful", "version 4 spells it RetryUntilSuccessful"),
        ("BlackboardCheckInt", "version 4 has attributes such as _skipIf"),
        ("MoveBase", 'the file lacks BTCPP_format="4": is it a tree of version 3?'),
    ],
)
def test_tree_of_version_3_is_refused_with_a_hint(tag: str, hint: str) -> None:
    error = error_of(OLD.format("", f"<{tag}/>"))
    assert (error.line, error.node) == (2, tag)
    assert hint in error.message
    assert "version 3" not in error_of(OLD.format("BTCPP_format='4' ", "<MoveBase/>")).message


def test_tree_of_version_3_that_has_nothing_new_runs_with_a_warning() -> None:
    for version, warning in (
        ("", 'BTCPP_format="4" is missing'),
        ("BTCPP_format='3' ", "BTCPP_format is '3', not '4'"),
    ):
        tree = load_text(OLD.format(version, LEAF), plain_registry())
        assert ticks(tree, 1) == "S"
        assert warning in tree.warnings[0]


def test_lenient_reading_takes_comments_in_comments_and_text_behind_the_end_and_nothing_else() -> None:
    body = f"<Sequence>\n<!-- a -- b -->\n<!-- <SubTree/> -->{LEAF}</Sequence>"
    rest = "\n<!-- <Repeat>\n<!-- inner -->\n</Repeat> -->\n</Sequence></BehaviorTree></root>"
    text = document(body).replace("</root>", "</root >") + rest
    assert "not well-formed" in error_of(text, lenient=False).message
    tree = load_text(text, plain_registry())
    assert ticks(tree, 1) == "S"
    assert tree.nodes[1].setup.line == 3
    with pytest.raises(LoadError, match="not well-formed"):
        load_text(document("<Sequence>"), plain_registry())


MARKED = '<?xml version="1.0" encoding="{}"?>\n' + document("<Script code=\"place := 'Küche'\"/>")


@pytest.mark.parametrize(
    ("declared", "encoding"),
    [
        ("UTF-8", "utf-8"), ("utf-8", "utf-8-sig"), ("ISO-8859-1", "latin-1"), ("latin1", "latin-1"),
        ("windows-1252", "cp1252"), ("UTF-16", "utf-16"), ("UTF-16", "utf-16-le"), ("utf-16", "utf-16-be"),
        ("utf-16", "utf-8"),
    ],
)  # fmt: skip
def test_file_is_read_in_the_encoding_that_it_declares(tmp_path: Path, declared: str, encoding: str) -> None:
    file = tmp_path / "tree.xml"
    file.write_bytes(MARKED.format(declared).encode(encoding))
    tree = load_file(file, plain_registry(), lenient=False)
    tree.tick_once()
    assert tree.blackboard.get("place") == "Küche"


@pytest.mark.parametrize(
    ("declared", "encoding", "message"),
    [
        ("klingon", "utf-8", "encoding 'klingon' is not known: must be UTF-8"),
        ("rot13", "utf-8", "encoding 'rot13' is not known"),
        ("utf-7", "utf-8", "encoding 'utf-7' is not known"),
        ("UTF-8", "latin-1", "can't decode byte 0xfc"),
    ],
)
def test_file_in_no_known_encoding_is_refused(tmp_path: Path, declared: str, encoding: str, message: str) -> None:
    file = tmp_path / "tree.xml"
    file.write_bytes(MARKED.format(declared).encode(encoding))
    with pytest.raises(LoadError, match=message):
        load_file(file, plain_registry())
