"""Trees are registered by files and folders, and run by their IDs."""

from pathlib import Path

import pytest

from behavior_tree import (
    SUCCESS,
    Limits,
    LoadError,
    Registry,
    Tree,
    TreeLibrary,
    library,
    load_file,
    load_from_library,
    load_text,
)

LIMITS = Limits(xml=5_000, nodes=100, characters=5_000)


def document(*trees: str, more: str = "") -> str:
    """Return a document with trees, each given as its ID and its root."""
    elements = "".join(
        f'<BehaviorTree ID="{tree.partition(" ")[0]}">{tree.partition(" ")[2]}</BehaviorTree>\n' for tree in trees
    )
    return f'<root BTCPP_format="4">{more}{elements}</root>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of trees that use each other, among others that are of no use."""
    (tmp_path / "deep").mkdir()
    (tmp_path / "patrol.xml").write_text(
        document('Patrol <Sequence><SubTree ID="Drive"/><SubTree ID="Home"/></Sequence>')
    )
    (tmp_path / "deep" / "moves.xml").write_text(
        document('Drive <Script code="drives := 1"/>', 'Home <SubTree ID="Drive"/>')
    )
    (tmp_path / "faulty.xml").write_text(document("Faulty <Unknown/>"))
    (tmp_path / "broken.xml").write_text("<root>")
    (tmp_path / "notes.txt").write_text("no tree")
    return tmp_path


def of(folder: Path) -> TreeLibrary:
    """Return a library of a folder."""
    made = TreeLibrary(limits=LIMITS)
    made.add_folder(folder)
    return made


def paths(tree: Tree) -> list[str]:
    """Return the paths of a tree's nodes."""
    return [node.path for node in tree.nodes]


def test_a_tree_runs_by_its_id_with_the_trees_that_it_uses(folder: Path) -> None:
    known = of(folder)
    assert known.ids == ("Drive", "Faulty", "Home", "Patrol")
    tree = load_from_library("Patrol", known, Registry())
    assert (tree.tree_id, len(tree.nodes)) == ("Patrol", 6)
    assert tree.tick_once() == SUCCESS


def test_what_is_not_used_need_not_load_and_is_reported(folder: Path) -> None:
    known = of(folder)
    assert load_from_library("Drive", known, Registry()).tick_once() == SUCCESS
    assert [problem.partition(":")[0] for problem in known.problems] == [str(folder.resolve() / "broken.xml")]
    with pytest.raises(LoadError, match="unknown node type 'Unknown'"):
        load_from_library("Faulty", known, Registry())


def test_a_file_or_a_text_is_completed_from_the_library_and_its_own_trees_go_first(folder: Path) -> None:
    text = document('Main <Sequence><SubTree ID="Drive"/><SubTree ID="Home"/></Sequence>', "Home <AlwaysSuccess/>")
    tree = load_text(text, Registry(), main="Main", library=of(folder))
    assert [node.type_id for node in tree.nodes] == ["Sequence", "SubTree", "Script", "SubTree", "AlwaysSuccess"]
    (folder / "main.xml").write_text(document('Main <SubTree ID="Patrol"/>'))
    assert load_file(folder / "main.xml", Registry(), library=of(folder), main="Drive").tree_id == "Drive"
    assert load_file(folder / "main.xml", Registry(), library=of(folder)).tick_once() == SUCCESS


def test_a_tree_that_there_is_not_is_named_with_the_nearest(folder: Path) -> None:
    with pytest.raises(
        LoadError, match=r"no tree 'Patrl' in the library of trees; did you mean 'Patrol'\?; not read: .*broken"
    ):
        load_from_library("Patrl", of(folder), Registry())
    with pytest.raises(LoadError, match="there are none"):
        load_from_library("Patrol", TreeLibrary(), Registry())
    (folder / "patrol.xml").write_text(document('Patrol <SubTree ID="Drve"/>'))
    with pytest.raises(LoadError, match="there is no tree 'Drve'"):
        load_from_library("Patrol", of(folder), Registry())


def test_two_trees_of_one_id_are_refused_only_where_one_is_used(folder: Path) -> None:
    (folder / "other.xml").write_text(document("Home <AlwaysFailure/>"))
    known = of(folder)
    assert load_from_library("Drive", known, Registry()).tick_once() == SUCCESS
    with pytest.raises(LoadError, match=r"have the same ID 'Home'; the others are at .*other\.xml:1"):
        load_from_library("Patrol", known, Registry())


def test_a_file_that_is_included_and_found_counts_once(folder: Path) -> None:
    (folder / "all.xml").write_text(document("All <SubTree ID='Home'/>", more='<include path="deep/moves.xml"/>'))
    assert load_from_library("All", of(folder), Registry()).tick_once() == SUCCESS


def test_models_of_a_library_s_file_hold_for_its_trees(folder: Path) -> None:
    model = '<TreeNodesModel><SubTree ID="Loud"><input_port name="level"/></SubTree></TreeNodesModel>'
    (folder / "loud.xml").write_text(document('Loud <Script code="x := level"/>', more=model))
    with pytest.raises(LoadError, match="sub-tree 'Loud' needs the port 'level'"):
        load_text(document('Main <SubTree ID="Loud"/>'), Registry(), library=of(folder))


def test_trees_that_contain_each_other_are_refused(folder: Path) -> None:
    (folder / "deep" / "moves.xml").write_text(document('Drive <SubTree ID="Home"/>', 'Home <SubTree ID="Drive"/>'))
    with pytest.raises(LoadError, match="a tree cannot contain itself"):
        load_from_library("Patrol", of(folder), Registry())


def test_a_library_has_limits(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "large.xml").write_text(document(f"Large <Script code='x := 1{' ' * 6000}'/>"))
    assert any("at most 5000" in problem for problem in of(folder).problems)
    monkeypatch.setattr(library, "MAX_CHARACTERS", 300)
    with pytest.raises(LoadError, match="at most 300"):
        of(folder)
    monkeypatch.setattr(library, "MAX_FILES", 2)
    with pytest.raises(LoadError, match="more than 2 files"):
        of(folder)
    with pytest.raises(LoadError, match="is no folder of trees"):
        of(folder / "nowhere")
