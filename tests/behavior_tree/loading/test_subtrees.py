"""Sub-trees: their boards, paths, models and the files they come from."""

from pathlib import Path

import pytest

from behavior_tree import LoadError, Tree, load_file, load_text, read_manifests
from behavior_tree.nodes.manifest import NodeKind
from tests.behavior_tree.trees import document, leaf, plain_registry, ticks, tree_of


def subtree(body: str, tree_id: str = "T") -> str:
    return f'<BehaviorTree ID="{tree_id}">{body}</BehaviorTree>'


def after(attributes: str, script: str, **entries: object) -> Tree:
    tree = tree_of(f'<SubTree ID="T" name="sub" {attributes}/>', subtree(f'<Script code="{script}"/>'))
    for key, value in entries.items():
        tree.blackboard.set(key, value)
    tree.tick_once()
    return tree


def test_sub_tree_has_a_board_of_its_own() -> None:
    tree = after("", "x := 1", x="mine")
    assert tree.blackboard.dump() == {"x": "mine"}
    assert tree.blackboards["sub"].dump() == {"x": 1}


def test_sub_tree_with_the_name_of_the_main_tree_has_a_board_of_its_own() -> None:
    xml = f"""<root BTCPP_format="4" main_tree_to_execute="Main">
    <BehaviorTree ID="Main"><SubTree ID="T" name="Main"/></BehaviorTree>{subtree('<Script code="x := 1"/>')}</root>"""
    tree = load_text(xml, plain_registry())
    tree.tick_once()
    assert tree.blackboards["Main"].dump() == {"x": 1}
    assert tree.blackboard.dump() == {}


def test_remapped_key_reads_and_writes_the_parents_entry() -> None:
    assert after('inner="{outer}"', "inner = inner + 1", outer=1).blackboard.dump() == {"outer": 2}
    assert after('x="{=}"', "x := 5").blackboard.dump() == {"x": 5}
    assert after('x="{@top}"', "x := 5").blackboard.dump() == {"top": 5}


def test_autoremap_shares_keys_of_the_same_name_but_private_ones() -> None:
    tree = after('_autoremap="true"', "x := 1; _private := 2")
    assert tree.blackboard.dump() == {"x": 1}
    assert tree.blackboards["sub"].dump() == {"_private": 2}


@pytest.mark.parametrize(("text", "value"), [("3", 3), ("3.5", 3.5), ("three", "three")])
def test_literal_is_set_on_the_sub_trees_own_board_even_under_autoremap(text: str, value: object) -> None:
    tree = after(f'x="{text}" _autoremap="true"', "y := x", x="outside")
    assert tree.blackboard.dump() == {"x": "outside", "y": value}


def test_whole_number_literal_may_be_read_as_text() -> None:
    tree = tree_of('<SubTree ID="T" a="3"/>', subtree('<Scripted name="n" script="S" in="{a}" out="{@out}"/>'))
    tree.tick_once()
    assert tree.blackboard.get("out") == "3S"


def test_at_sign_means_the_top_board_from_any_depth() -> None:
    tree = tree_of('<SubTree ID="A"/>', subtree('<SubTree ID="B"/>', "A"), subtree("<Script code='@x := 1'/>", "B"))
    tree.tick_once()
    assert tree.blackboard.dump() == {"x": 1}


def test_remapping_reaches_through_several_levels() -> None:
    tree = tree_of(
        '<SubTree ID="A" a="{m}"/>',
        subtree('<SubTree ID="B" b="{a}"/>', "A"),
        subtree("<Script code='b := 1'/>", "B"),
    )
    tree.tick_once()
    assert tree.blackboard.dump() == {"m": 1}


def test_paths_and_numbers_follow_the_order_of_creation() -> None:
    tree = tree_of(
        '<Sequence name="main"><SubTree ID="T" name="first"/><SubTree ID="T"/><AlwaysSuccess/></Sequence>',
        subtree(f"<Sequence>{leaf('S', 'work')}</Sequence>"),
    )
    assert [(node.uid, node.path) for node in tree.nodes] == [
        (1, "main"),
        (2, "first"),
        (3, "first/Sequence::3"),
        (4, "first/work"),
        (5, "T::5"),
        (6, "T::5/Sequence::6"),
        (7, "T::5/work"),
        (8, "AlwaysSuccess::8"),
    ]
    assert tree.node("first/work").uid == 4


def test_description_is_plain_data_for_status_pages() -> None:
    tree = tree_of('<SubTree ID="T" name="sub" a="{b}"/>', subtree(leaf("R", "work")))
    tree.tick_once()
    assert tree.describe() == {
        "uid": 1, "name": "sub", "type": "SubTree", "kind": "SubTree", "path": "sub", "status": "RUNNING",
        "ports": {"a": "{b}"}, "subtree": "T",
        "children": [{
            "uid": 2, "name": "work", "type": "Scripted", "kind": "Action", "path": "sub/work",
            "status": "RUNNING", "ports": {"script": "R"}, "subtree": "", "children": [],
        }],
    }  # fmt: skip


MODEL = (
    '<TreeNodesModel><SubTree ID="T"><input_port name="x" default="4"/><output_port name="y"/></SubTree>'
    '<Action ID="Grasp"><input_port name="force" type="double" default="1.5">in newtons</input_port>'
    '<output_port name="ok" type="MyType"/></Action></TreeNodesModel>'
)


def test_model_of_a_sub_tree_fills_in_defaults_and_demands_the_rest() -> None:
    body = subtree("<Script code='y := x'/>")
    tree = tree_of('<SubTree ID="T" y="{result}"/>', body, MODEL)
    tree.tick_once()
    assert tree.blackboard.get("result") == 4
    with pytest.raises(LoadError, match="sub-tree 'T' needs the port 'y'"):
        tree_of('<SubTree ID="T"/>', body, MODEL)
    tree = tree_of('<SubTree ID="T" _autoremap="true"/>', body, MODEL)
    tree.blackboard.set("x", 5)
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.get("y") == 5


def test_empty_default_in_a_model_is_none() -> None:
    model = '<TreeNodesModel><SubTree ID="T"><input_port name="x" default=""/></SubTree></TreeNodesModel>'
    with pytest.raises(LoadError, match="sub-tree 'T' needs the port 'x'"):
        tree_of('<SubTree ID="T"/>', subtree("<AlwaysSuccess/>"), model)
    typed = document("<Go/>", '<TreeNodesModel><Action ID="Go"><input_port name="n" type="int" default=""/></Action>'
                     "<Remark/></TreeNodesModel>")  # fmt: skip
    assert ticks(load_text(typed, plain_registry(), mock_unknown=True), 1) == "S"


def test_manifests_are_read_from_a_model() -> None:
    manifests = read_manifests(document("<AlwaysSuccess/>", MODEL))
    grasp = manifests["Grasp"]
    assert grasp.kind is NodeKind.ACTION
    assert (grasp.ports["force"].type, grasp.ports["force"].default) == (float, "1.5")
    assert grasp.ports["force"].description == "in newtons"
    assert grasp.ports["ok"].type is None


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def test_files_include_files_relative_to_themselves(tmp_path: Path) -> None:
    main = write(tmp_path, "main.xml", document('<SubTree ID="T"/>', '<include path="lib/t.xml"/>'))
    write(
        tmp_path,
        "lib/t.xml",
        '<root BTCPP_format="4"><include path="u.xml"/>' + subtree('<SubTree ID="U"/>') + "</root>",
    )
    write(tmp_path, "lib/u.xml", f'<root BTCPP_format="4">{subtree("<AlwaysSuccess/>", "U")}</root>')
    assert ticks(load_file(main, plain_registry()), 1) == "S"


def test_files_that_include_each_other_are_read_once(tmp_path: Path) -> None:
    main = write(tmp_path, "a.xml", document('<SubTree ID="T"/>', '<include path="b.xml"/>'))
    back = f'<root BTCPP_format="4"><include path="a.xml"/>{subtree("<AlwaysSuccess/>")}</root>'
    write(tmp_path, "b.xml", back)
    assert ticks(load_file(main, plain_registry()), 1) == "S"


def test_package_of_an_include_is_looked_up_on_the_search_path(tmp_path: Path) -> None:
    include = '<include ros_pkg="shared_trees" path="trees/t.xml"/>'
    main = write(tmp_path, "robot/main.xml", document('<SubTree ID="T"/>', include))
    write(tmp_path, "packages/shared_trees/trees/t.xml", f"<root>{subtree('<AlwaysSuccess/>')}</root>")
    tree = load_file(main, plain_registry(), search_path=[tmp_path / "packages"])
    assert ticks(tree, 1) == "S"
    with pytest.raises(LoadError, match="none above has the package's name"):
        load_file(main, plain_registry())


def test_package_that_a_file_is_in_needs_no_search_path(tmp_path: Path) -> None:
    include = '<include ros_pkg="robot_trees" path="trees/t.xml"/>'
    main = write(tmp_path, "robot_trees/trees/missions/main.xml", document('<SubTree ID="T"/>', include))
    write(tmp_path, "robot_trees/trees/t.xml", f"<root>{subtree('<AlwaysSuccess/>')}</root>")
    assert ticks(load_file(main, plain_registry()), 1) == "S"


def test_error_in_an_included_file_names_that_file_and_its_line(tmp_path: Path) -> None:
    main = write(tmp_path, "main.xml", document("<AlwaysSuccess/>", '<include path="t.xml"/>'))
    included = write(tmp_path, "t.xml", f'<root BTCPP_format="4">\n\n{subtree("<Nonsense/>")}</root>')
    with pytest.raises(LoadError, match="unknown node type 'Nonsense'") as caught:
        load_file(main, plain_registry())
    assert (caught.value.file, caught.value.line) == (str(included.resolve()), 3)


def test_first_file_says_which_tree_to_execute(tmp_path: Path) -> None:
    main = write(tmp_path, "main.xml", document("<AlwaysSuccess/>", '<include path="t.xml"/>'))
    body = f'<root main_tree_to_execute="T">{subtree("<AlwaysFailure/>")}</root>'
    write(tmp_path, "t.xml", body)
    assert ticks(load_file(main, plain_registry()), 1) == "S"
    assert ticks(load_file(main, plain_registry(), main="T"), 1) == "F"
    text = f'<root><include path="t.xml"/>{subtree("<AlwaysSuccess/>", "M")}</root>'
    with pytest.raises(LoadError, match="set main_tree_to_execute"):
        load_text(text, plain_registry(), folder=tmp_path)


ODD_DEFAULT = """<TreeNodesModel>
<Action ID="Go">
<input_port name="reach" type="double" default="std::numeric_limits&lt;double&gt;::infinity()"/>
<input_port name="goal" type="int" default="{goal}"/><output_port name="left" type="int" default="{=}"/></Action>
<SubTree ID="T"><input_port name="_collapsed" default="false"/><input_port name="_hidden"/></SubTree>
</TreeNodesModel>"""


def test_a_default_that_a_model_s_type_cannot_read_is_a_warning_at_the_model() -> None:
    text = document('\n<Go reach="2.5"/>', ODD_DEFAULT)
    tree = load_text(text, plain_registry(), mock_unknown=True)
    assert ticks(tree, 1) == "S"
    assert [warning for warning in tree.warnings if "default" in warning] == [
        "<text>:4: the default of port 'reach' of type float is ignored: "
        "'std::numeric_limits<double>::infinity()' is not a number"
    ]
    warnings: list[str] = []
    manifests = read_manifests(text, "nav2.xml", warnings)
    assert [port.default for port in manifests["Go"].ports.values()] == [None, "{goal}", "{=}"]
    assert [warning.partition(": ")[0] for warning in warnings] == ["nav2.xml:4"]
    with pytest.raises(LoadError, match="port 'reach' is of type float"):
        load_text(document('<Go reach="inf()"/>', ODD_DEFAULT), plain_registry(), mock_unknown=True)


def test_ports_of_sub_tree_models_that_are_notes_of_an_editor_are_left_out() -> None:
    tree = tree_of('<SubTree ID="T" _collapsed="true"/>', subtree("<AlwaysSuccess/>"), ODD_DEFAULT)
    assert ticks(tree, 1) == "S"
    assert tree.blackboards["T::1"].keys() == []
    assert "_collapsed" not in read_manifests(document("<AlwaysSuccess/>", ODD_DEFAULT))["T"].ports
