"""Ports: where their values come from and go to, and which types they take."""

from enum import Enum, IntEnum
from typing import Any

import pytest

from behavior_tree import (
    RUNNING,
    SUCCESS,
    Blackboard,
    BlackboardError,
    InOut,
    Input,
    LoadError,
    NodeError,
    Output,
    PortError,
    Registry,
    RegistryError,
    Status,
    SyncAction,
    Tree,
    load_text,
)
from behavior_tree.data.values import parse_real
from behavior_tree.nodes.text import board_key
from tests.behavior_tree.trees import document, leaf, ticks, tree_of


class Mode(Enum):
    SLOW = "slow"
    FAST = "fast"


class Light(IntEnum):
    RED = 1
    GREEN = 2


class Point:
    def __init__(self, x: float, y: float) -> None:
        self.x, self.y = x, y

    @classmethod
    def from_text(cls, text: str) -> "Point":
        x, y = text.split(",")
        return cls(float(x), float(y))


class Probe(SyncAction):
    """Has an input of every type; the test looks at what they give."""

    whole = Input(int)
    real = Input(float, default=0.5)
    flag = Input(bool)
    text = Input(str)
    reals = Input(list[float])
    names = Input(list[str])
    mode = Input(Mode)
    light = Input(Light)
    result = Input(Status)
    point = Input(Point)
    anything = Input[Any]()
    shared = Input(int, default="{=}")

    def tick(self) -> Status:
        return SUCCESS


class Emit(SyncAction):
    """Writes a value of the Python side."""

    real = Output(float)
    whole = Output(int)
    text = Output(str)
    point = Output(Point)

    def __init__(self, setup: Any, port: str, value: Any) -> None:
        super().__init__(setup)
        self._port, self._value = port, value

    def tick(self) -> Status:
        self.write_port(self._port, self._value)
        return SUCCESS


class Count(SyncAction):
    """Adds one."""

    number = InOut(int)

    def tick(self) -> Status:
        self.number = self.number + 1
        return SUCCESS


def registry() -> Registry:
    result = Registry()
    result.register_all([Probe, Count])
    result.register_converter(Point, Point.from_text)
    return result


def probe(attributes: str, **entries: Any) -> Any:
    board = Blackboard()
    for key, value in entries.items():
        board.set(key, value)
    return load_text(document(f"<Probe {attributes}/>"), registry(), blackboard=board).root


@pytest.mark.parametrize(
    ("port", "text", "value"),
    [
        ("whole", "-7", -7),
        ("real", "1e-3", 0.001),
        ("real", "3", 3.0),
        ("flag", "TRUE", True),
        ("flag", "0", False),
        ("text", " kept as it is ", " kept as it is "),
        ("reals", "1;2.5", [1.0, 2.5]),
        ("reals", "json:[1, 2.5]", [1.0, 2.5]),
        ("names", "a;b", ["a", "b"]),
        ("mode", "FAST", Mode.FAST),
        ("mode", "slow", Mode.SLOW),
        ("light", "2", Light.GREEN),
        ("result", "RUNNING", 1),
        ("anything", "12", "12"),
    ],
)
def test_literal_is_converted_to_the_type_of_its_port(port: str, text: str, value: Any) -> None:
    assert getattr(probe(f'{port}="{text}"'), port) == value


@pytest.mark.parametrize(
    ("port", "text"),
    [("whole", "1.5"), ("whole", "1_0"), ("real", "nan"), ("flag", "yes"), ("reals", "1;x"),
     ("reals", "json:{}"), ("mode", "quick"), ("result", "DONE"), ("point", "1"),
     ("whole", "9223372036854775808")],
)  # fmt: skip
def test_literal_of_the_wrong_type_is_a_load_error(port: str, text: str) -> None:
    with pytest.raises(LoadError, match=f"port '{port}'") as caught:
        probe(f'{port}="{text}"')
    assert caught.value.line == 1


@pytest.mark.parametrize(
    ("port", "entry", "value"),
    [("whole", 3, 3), ("whole", 3.0, 3), ("whole", "3", 3), ("real", 3, 3.0), ("text", "a", "a"),
     ("flag", 1, True),
     ("text", 3, "3"), ("text", 1.5, "1.500000"), ("light", 1, Light.RED), ("reals", [1.0], [1.0])],
)  # fmt: skip
def test_entry_is_converted_to_the_type_of_the_port_that_reads_it(port: str, entry: Any, value: Any) -> None:
    board = Blackboard()
    board.set_constant("key", entry)
    node = load_text(document(f'<Probe {port}="{{key}}"/>'), registry(), blackboard=board).root
    read = getattr(node, port)
    assert (type(read), read) == (type(value), value)


def test_class_with_a_converter_is_read_from_literals_and_from_text_on_the_board() -> None:
    assert probe('point="1,2"').point.y == 2.0
    assert probe('point="{p}"', p="3,4").point.x == 3.0


def test_absent_input_has_its_default_and_one_without_default_is_an_error() -> None:
    node = probe("")
    assert node.real == 0.5
    with pytest.raises(PortError, match="'whole' is not given"):
        _ = node.whole
    assert node.read_port_or("whole", 9) == 9


@pytest.mark.parametrize("reference", ["{shared}", "{=}", " { shared } ", "{@shared}"])
def test_reference_may_have_spaces_and_shorthands(reference: str) -> None:
    assert probe(f'shared="{reference}"', shared=5).shared == 5


def test_default_may_be_a_reference() -> None:
    assert probe("", shared=6).shared == 6


def test_reading_an_entry_that_is_empty_or_unsuitable_names_port_and_entry() -> None:
    tree = load_text(document('<Probe whole="{k}"/>'), registry())
    with pytest.raises(PortError, match=r"input 'whole' from entry 'k'.*empty"):
        tree.root.read_port("whole")
    tree.blackboard.set_constant("k", 1.5)
    with pytest.raises(PortError, match=r"input 'whole' from entry 'k'.*1\.5"):
        tree.root.read_port("whole")


@pytest.mark.parametrize(
    ("port", "given", "stored"), [("real", 2, 2.0), ("whole", 2.0, 2), ("text", "a", "a"), ("whole", "4", 4)]
)
def test_output_is_converted_to_its_type(port: str, given: Any, stored: Any) -> None:
    registry = Registry()
    registry.register(Emit, port=port, value=given)
    tree = load_text(document(f'<Emit {port}="{{out}}"/>'), registry)
    tree.tick_once()
    value = tree.blackboard.get("out")
    assert (type(value), value) == (type(stored), stored)


def test_output_without_an_entry_to_write_is_an_error_that_says_so() -> None:
    for attributes in ("", 'real="5"'):
        registry = Registry()
        registry.register(Emit, port="real", value=1.0)
        tree = load_text(document(f"<Emit {attributes}/>"), registry)
        with pytest.raises(NodeError, match="output 'real' is not connected"):
            tree.tick_once()


def test_port_for_both_directions_reads_and_writes_one_entry() -> None:
    tree = load_text(document('<Count number="{n}"/>'), registry())
    tree.blackboard.set("n", 1)
    tree.tick_once()
    assert tree.blackboard.get("n") == 2


def test_input_cannot_be_written_and_output_cannot_be_read() -> None:
    node = probe('whole="1"')
    with pytest.raises(AttributeError, match="input"):
        node.whole = 2
    emitter = Registry()
    emitter.register(Emit, port="real", value=1.0)
    with pytest.raises(AttributeError, match="output"):
        _ = load_text(document("<Emit/>"), emitter).root.real  # type: ignore[attr-defined]


def test_scripted_leaf_passes_text_through_the_board() -> None:
    tree = tree_of(
        "<Sequence><Script code=\"a := 'x'\"/>"
        '<Scripted name="n" script="RS" in="{a}" out="{b}"/>'
        '<Scripted name="m" script="S" in="{b}" out="{b}"/>'
        "</Sequence>"
    )
    assert ticks(tree, 1) == "R"
    assert tree.blackboard.dump() == {"a": "x", "b": "xR"}
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {"a": "x", "b": "xSS"}


def test_entries_that_ports_name_exist_from_the_start_and_are_empty() -> None:
    tree = tree_of(leaf("S", **{"in": "{a}", "out": "{b}"}))
    assert tree.blackboard.dump() == {"a": None, "b": None}


def test_key_used_with_two_types_is_a_load_error_unless_the_first_is_text() -> None:
    with pytest.raises(LoadError, match="entry 'k' is of type int; it cannot become bool"):
        probe('whole="{k}" flag="{k}"')
    tree = load_text(document('<Sequence><Probe text="{k}"/><Probe whole="{k}"/></Sequence>'), registry())
    tree.blackboard.set("k", "1")
    assert tree.blackboard.get("k") == "1"
    assert tree.nodes[2].read_port("whole") == 1


def test_entry_keeps_its_type_when_it_is_written_from_outside() -> None:
    board = Blackboard()
    board.set("n", 1)
    board.set("n", "2")
    assert board.get("n") == 2
    with pytest.raises(BlackboardError, match="entry 'n' is of type int"):
        board.set("n", 2.5)
    with pytest.raises(BlackboardError, match="unset"):
        board.set("n", None)
    board.unset("n")
    board.set("n", 2.5)
    assert board.get("n") == 2.5


def test_entry_that_only_a_text_input_named_takes_the_type_of_its_first_value() -> None:
    body = '<Sequence><Script code="v := 1"/><Probe text="{v}"/></Sequence>'
    tree = load_text(document(body), registry())
    tree.tick_once()
    tree.blackboard.set("v", 2)
    assert tree.blackboard.get("v") == 2


def test_every_write_counts_and_is_stamped() -> None:
    tree = tree_of("<Script code='x := 1; x = 2'/>")
    tree.tick_once()
    entry = tree.blackboard.find("x")
    assert entry is not None
    assert (entry.sequence, entry.stamp) == (2, 0.0)


@pytest.mark.parametrize("name", ["name", "ID", "_post", "9lives", "a b", "a.b", "_x"])
def test_port_with_an_impossible_name_is_refused(name: str) -> None:
    class Bad(SyncAction):
        port = Input(int, name=name)

    with pytest.raises(RegistryError, match="port"):
        Registry().register(Bad)


def test_port_that_would_hide_an_attribute_of_every_node_is_refused() -> None:
    class Bad(SyncAction):
        path = Input(str)

    with pytest.raises(RegistryError, match='name="path"'):
        Registry().register(Bad)


@pytest.mark.parametrize("type_id", ["root", "a b", "a/b", "a:b", "x.y", "a\nb"])
def test_node_type_with_an_impossible_name_is_refused(type_id: str) -> None:
    with pytest.raises(RegistryError, match="node type"):
        Registry().register(Count, type_id)


def test_node_type_is_registered_only_once() -> None:
    with pytest.raises(RegistryError, match="registered already"):
        Registry().register(Count, "Sequence")


def test_set_blackboard_writes_text_copies_entries_and_respects_types() -> None:
    tree = tree_of(
        "<Sequence><Script code=\"n := 1; r := 2.5\"/><SetBlackboard value='7' output_key='n'/>"
        "<SetBlackboard value='7' output_key='t'/><SetBlackboard value='{r}' output_key='copy'/></Sequence>"
    )
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {"r": 2.5, "n": 7, "t": "7", "copy": 2.5}


def test_set_blackboard_fails_on_an_empty_source() -> None:
    assert ticks(tree_of("<SetBlackboard value='{nothing}' output_key='x'/>"), 1) == "F"


def test_unset_blackboard_removes_an_entry() -> None:
    tree = tree_of("<Sequence><Script code='x := 1'/><UnsetBlackboard key='x'/></Sequence>")
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {}


def type_of_entry(tree: Tree, key: str) -> Any:
    entry = tree.blackboard.find(key)
    assert entry is not None
    return entry.type


@pytest.mark.parametrize("order", [("whole", "flag"), ("flag", "whole")])
def test_entry_that_an_untyped_port_named_first_stays_open_until_it_is_written(order: tuple[str, str]) -> None:
    untyped, (first, second) = '<SetBlackboard value="{k}" output_key="c"/>', order
    typed = f'<Probe {first}="{{k}}"/><Probe {second}="{{k}}"/>'
    tree = load_text(document(f"<Sequence>{untyped}{typed}</Sequence>"), registry())
    assert type_of_entry(tree, "k") is None
    tree.blackboard.set("k", 1)
    assert type_of_entry(tree, "k") is int
    assert ticks(tree, 1) == "S"
    with pytest.raises(LoadError, match=r"is of type .*; it cannot become"):
        load_text(document(f"<Sequence>{typed}{untyped}</Sequence>"), registry())


@pytest.mark.parametrize("digits", [20, 4_000, 9_000])
def test_whole_number_that_64_bits_do_not_hold_is_refused_however_long(digits: int) -> None:
    with pytest.raises(LoadError, match="is not a whole number of 64 bits"):
        tree_of(f'<Sleep msec="{"9" * digits}"/>')


@pytest.mark.parametrize("text", ["1e999", "-1e999", "1e-999"])
def test_number_that_no_real_holds_is_refused(text: str) -> None:
    with pytest.raises(LoadError, match="does not fit into a real of 64 bits"):
        tree_of(f'<LoopDouble queue="{text}"><AlwaysSuccess/></LoopDouble>')


@pytest.mark.parametrize("body", ['<Sleep msec="{}"/>', '<Delay delay_msec="{}"><AlwaysSuccess/></Delay>',
                                  '<Timeout msec="{}"><AlwaysSuccess/></Timeout>'])  # fmt: skip
def test_negative_or_endless_time_is_refused(body: str) -> None:
    for text in ("-5", "4294967296"):
        with pytest.raises(LoadError, match="must be from 0 to 4294967295 milliseconds"):
            tree_of(body.format(text))
    tree = tree_of(body.format("{time}"))
    tree.blackboard.set("time", -1)
    with pytest.raises(NodeError, match="must be from 0"):
        tree.tick_once()
    assert tree_of(body.format("0")).tick_once() in (RUNNING, SUCCESS)


def test_long_texts_are_no_references_and_no_numbers_after_one_pass() -> None:
    blanks = " " * 200_000
    assert board_key(f"{{a{blanks}b}}", "p") == f"a{blanks}b"
    assert board_key(f"{{a{blanks}", "p") is None
    assert board_key(f"{blanks}{{=}}{blanks}", "p") == "p"
    with pytest.raises(ValueError, match="is not a number"):
        parse_real("9" * 200_000 + "x")
