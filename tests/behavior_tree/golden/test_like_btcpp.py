"""What trees made for BehaviorTree.CPP rely on, and what its authors promise of ports, boards and scripts."""

from enum import IntEnum
from math import inf
from pathlib import Path
from typing import Any

import pytest

from behavior_tree import (
    Blackboard,
    InOut,
    Input,
    LoadError,
    NodeError,
    Output,
    Registry,
    Status,
    SyncAction,
    load_file,
    load_text,
)
from behavior_tree.script import compile_script
from behavior_tree.status import FAILURE, SUCCESS
from tests.behavior_tree.trees import document, plain_registry, ticks, tree_of

LEAF = "<AlwaysSuccess/>"


class Fault(IntEnum):
    NONE = 0
    LOW_BATTERY = 1


class Place:
    def __init__(self, x: float, y: float) -> None:
        self.x, self.y = x, y

    @classmethod
    def from_text(cls, text: str) -> "Place":
        x, y = text.split(";")
        return cls(float(x), float(y))


class Twice(SyncAction):
    given = Input(int)
    result = Output(int)

    def tick(self) -> Status:
        self.result = 2 * self.given
        return SUCCESS


class Halve(SyncAction):
    given = Input(float)
    result = Output(float)

    def tick(self) -> Status:
        self.result = self.given / 2
        return SUCCESS


class Say(SyncAction):
    given = Input(str)
    result = Output(str)

    def tick(self) -> Status:
        self.result = self.given
        return SUCCESS


class Anything(SyncAction):
    given = Input[Any]()
    result = Output[Any]()

    def tick(self) -> Status:
        self.result = self.given
        return SUCCESS


class Shift(SyncAction):
    place = InOut(Place)

    def tick(self) -> Status:
        self.place = Place(self.place.x + 1, self.place.y)
        return SUCCESS


class Mark(SyncAction):
    place = Input(Place)

    def tick(self) -> Status:
        return SUCCESS


class Report(SyncAction):
    fault = Input(Fault)

    def tick(self) -> Status:
        return SUCCESS if self.fault is Fault.NONE else FAILURE


class Lists(SyncAction):
    names = Input(list[str])
    reals = Input(list[float])
    real = Input(float)
    whole = Input(int)

    def tick(self) -> Status:
        return SUCCESS


class Typed(SyncAction):
    one = Input(int, default="{shared}")
    other = Input(bool, default="{shared}")

    def tick(self) -> Status:
        return SUCCESS


def registry() -> Registry:
    result = plain_registry()
    result.register_all([Twice, Halve, Say, Anything, Shift, Mark, Report, Lists, Typed])
    result.register_converter(Place, Place.from_text)
    result.register_enum(Fault)
    return result


def ran(body: str, *others: str, status: str = "S", **entries: Any) -> Blackboard:
    tree = load_text(document(f"<Sequence>{body}</Sequence>", *others), registry())
    for key, value in entries.items():
        tree.blackboard.set(key, value)
    assert ticks(tree, 1) == status
    return tree.blackboard


@pytest.mark.parametrize("text", ["1 < 2 && 3 > 2", "1 &lt; 2 && 2 &gt; 1", "(1 && 0) || 3 < 4"])
def test_ampersands_and_angles_stand_for_themselves_in_scripts(text: str) -> None:
    tree = tree_of(f'<Sequence>\n<ScriptCondition\n code="{text}"/>\n{LEAF}</Sequence>')
    assert ticks(tree, 1) == "S"
    assert "read leniently" in tree.warnings[0]
    assert [node.setup.line for node in tree.nodes] == [1, 2, 4]


def test_mended_document_keeps_what_is_in_quotes_of_either_kind_and_in_comments() -> None:
    text = document("""<Sequence><!-- a < b && "c --><Script code="t := 'a>b<c & &amp; &#65; &x;'"/>
        <Script code='u := "it&apos;s"; ok := 1 < 2'/><!-------------></Sequence>""")
    tree = load_text(text, plain_registry())
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {"t": "a>b<c & & A &x;", "u": "it's", "ok": 1.0}


def test_blanks_may_come_before_the_declaration() -> None:
    tree = load_text('\n\n  <?xml version="1.0"?>\n' + document(LEAF), plain_registry())
    assert ticks(tree, 1) == "S"
    assert tree.root.setup.line == 4


@pytest.mark.parametrize("text", ["<a b='" * 20_000, "<!--" * 30_000, "<" * 50_000, '<a b="1"' * 20_000, "&" * 50_000])
def test_document_beyond_mending_is_refused_soon_with_the_first_error(text: str) -> None:
    with pytest.raises(LoadError, match="<text>:1: not well-formed"):
        load_text(text, plain_registry())


@pytest.mark.parametrize(
    ("script", "value"),
    [
        ("1 == 1 \\\n&& 2 == 2", 1.0),
        ("x := 1;\\\r\n x + 1", 2.0),
        ("x := 3; \\ \n x", 3),
        ("n ? 1 : 2", 1),
    ],
)
def test_script_may_be_written_as_there(script: str, value: object) -> None:
    board = Blackboard()
    board.set("n", -3)
    result = compile_script(script, board, {})()
    assert (type(result), result) == (type(value), value)


@pytest.mark.parametrize(
    ("before", "text", "after"),
    [(1, "5", 5), (1, "true", 1), (0.5, "false", 0.0), (0.5, "LOW_BATTERY", 1.0), (7, "LOW_BATTERY", 1), (1, "5.0", 5)],
)
def test_text_for_a_number_may_be_a_truth_value_or_an_enumerated_name(before: float, text: str, after: float) -> None:
    board = Blackboard()
    board.set("x", before)
    compile_script(f"x = '{text}'", board, {"LOW_BATTERY": 1})()
    assert (type(board.get("x")), board.get("x")) == (type(after), after)


def test_enumerated_name_that_a_sub_tree_is_given_reaches_the_port_of_its_type() -> None:
    check = '<BehaviorTree ID="Check"><AlwaysSuccess _onSuccess="fault = new"/></BehaviorTree>'
    body = """<Script code="fault := NONE"/><Report fault="{fault}"/>
        <SubTree ID="Check" fault="{=}" new="LOW_BATTERY"/><Report fault="{fault}"/>"""
    assert ran(body, check, status="F").get("fault") == 1.0


def test_text_is_read_by_ports_of_any_type_but_a_number_not_by_ports_of_another() -> None:
    board = ran('<Say given="42" result="{v}"/><Twice given="{v}" result="{i}"/><Halve given="{v}" result="{r}"/>')
    assert (board.get("v"), board.get("i"), board.get("r")) == ("42", 84, 21.0)
    for other in ("Halve", "Say"):
        with pytest.raises(LoadError, match="is of type int; it cannot become"):
            ran(f'<Twice given="1" result="{{v}}"/><{other} given="{{v}}"/>')


def test_untyped_ports_connect_everything() -> None:
    board = ran('<Twice given="5" result="{v}"/><Anything given="{v}" result="{w}"/><Twice given="{w}" result="{x}"/>')
    assert board.get("x") == 20


def test_text_on_the_board_becomes_what_the_port_that_named_the_entry_takes() -> None:
    add = """<BehaviorTree ID="Add"><Sequence><SetBlackboard output_key="p" value="3;5"/>
        <SetBlackboard output_key="p" value="{new}"/></Sequence></BehaviorTree>"""
    body = '<SetBlackboard output_key="p" value="0;0"/><Shift place="{p}"/><SubTree ID="Add" _autoremap="1" new="2;4"/>'
    place = ran(body, add).get("p")
    assert (place.x, place.y) == (2.0, 4.0)


@pytest.mark.parametrize("second", ["Hello!", 57])
def test_copy_of_another_type_onto_an_entry_is_an_error(second: object) -> None:
    with pytest.raises(NodeError, match="'copy' is of type Place"):
        ran('<SetBlackboard output_key="copy" value="{p}"/><SetBlackboard output_key="copy" value="{q}"/>',
            p=Place(1, 2), q=second)  # fmt: skip


def test_defaults_give_no_types_to_the_entries_that_they_name() -> None:
    assert ran("<Typed/>").dump() == {"shared": None}
    with pytest.raises(LoadError, match="cannot become bool"):
        ran('<Typed one="{shared}" other="{shared}"/>')


def test_remapped_entry_outlives_being_unset_inside_and_an_own_one_does_not() -> None:
    inner = """<BehaviorTree ID="T"><Sequence><Script code="own := 1; @top := 1"/><UnsetBlackboard key="far"/>
        <UnsetBlackboard key="@top"/><UnsetBlackboard key="own"/><UnsetBlackboard key="none"/>
        </Sequence></BehaviorTree>"""
    tree = load_text(document('<SubTree ID="T" name="t" far="{near}"/>', inner), registry())
    tree.blackboard.set("near", 1)
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {"near": 1, "top": 1}
    assert tree.blackboards["t"].dump() == {}


@pytest.mark.parametrize(
    ("port", "text", "value"),
    [
        ("names", "a;;b", ["a", "", "b"]),
        ("names", "a;b;", ["a", "b"]),
        ("names", "", []),
        ("names", "with blank; led by one", ["with blank", " led by one"]),
        ("reals", "1;-2.5;", [1.0, -2.5]),
        ("real", "inf", inf),
        ("real", "-Infinity", -inf),
        ("whole", "5.0", 5),
        ("whole", "-7.", -7),
    ],
)
def test_literal_is_read_as_there(port: str, text: str, value: object) -> None:
    node = load_text(document(f'<Lists {port}="{text}"/>'), registry()).root
    assert node.read_port(port) == value


@pytest.mark.parametrize(("port", "text"), [("reals", "1;;2"), ("whole", "5.5"), ("whole", "1e3")])
def test_literal_that_would_lose_something_is_refused(port: str, text: str) -> None:
    with pytest.raises(LoadError, match=f"port '{port}'"):
        load_text(document(f'<Lists {port}="{text}"/>'), registry())


def test_keys_reach_through_sub_trees_that_remap_only_some() -> None:
    inner = '<BehaviorTree ID="In"><Script code="log := log .. one .. two"/></BehaviorTree>'
    outer = """<BehaviorTree ID="Out"><Sequence><SubTree ID="In" one="a" _autoremap="true"/>
        <SubTree ID="In" one="b" _autoremap="true"/></Sequence></BehaviorTree>"""
    board = ran('<SubTree ID="Out" two="!" log="{log}"/>', outer, inner, log="")
    assert board.get("log") == "a!b!"


def test_tree_written_as_a_node_is_refused_with_the_right_way() -> None:
    other = f'<BehaviorTree ID="Check">{LEAF}</BehaviorTree>'
    for mock_unknown in (False, True):
        with pytest.raises(LoadError, match='used by <SubTree ID="Check"/>'):
            load_text(document("<Check/>", other), registry(), mock_unknown=mock_unknown)


def test_files_include_one_another_up_and_down(tmp_path: Path) -> None:
    def write(name: str, uses: str, include: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        tree_id = path.stem
        body = f'<Sequence><SubTree ID="{uses}"/>{LEAF}</Sequence>' if uses else LEAF
        path.write_text(f"""<root BTCPP_format="4" main_tree_to_execute="{tree_id}">
            <include path="{include}"/><BehaviorTree ID="{tree_id}">{body}</BehaviorTree></root>"""
            if include else f'<root><BehaviorTree ID="{tree_id}">{body}</BehaviorTree></root>')  # fmt: skip
        return path

    main = write("main.xml", "middle", "deep/middle.xml")
    write("deep/middle.xml", "last", "../last.xml")
    write("last.xml", "", "")
    tree = load_file(main, plain_registry())
    assert ticks(tree, 1) == "S"
    assert [node.type_id for node in tree.nodes].count("SubTree") == 2
