"""All node types are printed as models that editors take."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from behavior_tree import (
    Condition,
    Decorator,
    Direction,
    InOut,
    Input,
    NodeKind,
    NodeManifest,
    Output,
    PortModel,
    Registry,
    Status,
    SyncAction,
    read_manifests,
)
from behavior_tree.nav2 import NAV2_NODES
from behavior_tree.xml.model_text import cpp_type, models_text
from regraft.services.bt_executor.node_types import NODE_TYPES
from regraft.stack import load
from tests.authors.commands import mission, refused
from tests.executor.helpers import FROG, tree

TYPES = st.sampled_from([None, bool, int, float, str, Status, list[int], list[float], list[str]])
NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,10}", fullmatch=True).filter(
    lambda name: name not in ("name", "ID", "root")
)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=40)
KINDS = st.sampled_from([NodeKind.ACTION, NodeKind.CONDITION, NodeKind.CONTROL, NodeKind.DECORATOR])


class Colour(Enum):
    RED = 1


class Paint(SyncAction):
    """Paints <walls> & "doors"."""

    colour = Input(Colour, default=Colour.RED, description='which "colour" & how <much>')
    coats = Input(int, default=2)
    dry = Input(bool, default=True)
    litres = Input(float, default=0.5)
    names = Input(list, default="a;b")
    where = InOut(str, default="{=}")
    done = Output(bool)


class Wet(Condition):
    """Whether it is wet."""


class Cover(Decorator):
    """Covers the floor."""


@st.composite
def manifests(draw: st.DrawFn) -> NodeManifest:
    """Return node types of any kind, with ports of every type that models know."""
    names = draw(st.lists(NAMES, unique=True, max_size=4))
    ports = {
        name: PortModel(name, draw(st.sampled_from(Direction)), draw(TYPES), None, draw(TEXTS).strip())
        for name in names
    }
    return NodeManifest(draw(NAMES), draw(KINDS), ports, draw(TEXTS))


@given(st.lists(manifests(), max_size=5, unique_by=lambda manifest: manifest.type_id))
def test_models_that_are_read_again_have_the_same_kinds_ports_and_types(known: list[NodeManifest]) -> None:
    read = read_manifests(models_text(known))
    assert list(read) == sorted(manifest.type_id for manifest in known)
    for manifest in known:
        again = read[manifest.type_id]
        assert again.kind is manifest.kind
        kept = {name: (port.direction, port.type) for name, port in manifest.ports.items()}
        assert {name: (port.direction, port.type) for name, port in again.ports.items()} == kept


def test_a_model_has_defaults_and_descriptions_as_the_class_has_them() -> None:
    registry = Registry()
    registry.register_all([Paint, Wet, Cover])
    text = models_text(registry.manifests.values())
    paint = read_manifests(text)["Paint"]
    defaults = {name: port.default for name, port in paint.ports.items()}
    given = {
        "colour": "RED",
        "coats": "2",
        "dry": "true",
        "litres": "0.5",
        "names": "a;b",
        "where": "{=}",
        "done": None,
    }
    assert defaults == given
    assert paint.ports["colour"].description == 'which "colour" & how <much>'
    assert 'description="Covers the floor."' in text
    assert (read_manifests(text)["Wet"].kind, read_manifests(text)["Cover"].kind) == (
        NodeKind.CONDITION,
        NodeKind.DECORATOR,
    )


def test_types_are_named_as_in_cpp() -> None:
    named = [cpp_type(kind) for kind in (None, bool, float, str, Status, list[str], Colour)]
    assert named == [
        "BT::AnyTypeAllowed",
        "bool",
        "double",
        "std::string",
        "NodeStatus",
        "std::vector<std::string>",
        "Colour",
    ]


def test_the_models_have_the_engines_nav2s_and_our_nodes() -> None:
    done = mission("models")
    assert done.exit_code == 0
    known = read_manifests(done.stdout)
    ours = {"Sequence", "Script", "Switch6", *(node.__name__ for node in NAV2_NODES), *NODE_TYPES}
    assert ours <= known.keys()
    assert "SubTree" not in known


def test_the_models_have_the_nodes_of_a_stack_and_of_modules() -> None:
    stack = FROG.parent / "explore.yaml"
    places = str(load(stack).architecture.components["bt_executor"].parameters["nodes"]).split()
    of_stack = read_manifests(mission("models", "--stack", stack).stdout)
    of_modules = read_manifests(mission("models", *(word for place in places for word in ("--nodes", place))).stdout)
    assert of_stack == of_modules
    assert of_stack.keys() - read_manifests(mission("models").stdout).keys()


def test_a_mission_is_checked_by_the_printed_models_alone(tmp_path: Path) -> None:
    (tmp_path / "nodes.xml").write_text(mission("models", "--nodes", "tests.authors.test_models:Paint").stdout)
    file = tmp_path / "mission.xml"
    file.write_text(tree('<Paint coats="3" colour="RED"/>', '<Say text="done"/>'))
    assert mission("check", file, "--nodes", tmp_path / "nodes.xml").exit_code == 0
    file.write_text(tree('<Paint coat="3"/>'))
    assert "Paint has no port 'coat'" in refused("check", file, "--nodes", tmp_path / "nodes.xml")


def test_a_place_that_leads_nowhere_is_refused(tmp_path: Path) -> None:
    assert "did you mean" in refused("models", "--nodes", "regraft.services.bt_executor.nod_types:X")
    assert "cannot read" in refused("models", "--nodes", tmp_path / "nowhere.xml")
    (tmp_path / "large.xml").write_text(" " * 1_000_001)
    assert "at most 1000000 bytes" in refused("models", "--nodes", tmp_path / "large.xml")


def test_a_stack_without_missions_is_refused(tmp_path: Path) -> None:
    (tmp_path / "stack.yaml").write_text(
        "system: still\nclock: real\ncomponents: {gateway: {class: 'regraft.dashboard_api.gateway:Gateway'}}\n"
    )
    assert "no component runs missions" in refused("models", "--stack", tmp_path / "stack.yaml")
    assert "nowhere.yaml" in refused("models", "--stack", tmp_path / "nowhere.yaml")
