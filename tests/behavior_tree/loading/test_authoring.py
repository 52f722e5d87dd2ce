"""Node types written outside the engine: leaves, decorators, control nodes, and types from manifests."""

from typing import Any

import pytest

from behavior_tree import (
    FAILURE,
    IDLE,
    RUNNING,
    SUCCESS,
    Condition,
    Control,
    Decorator,
    Direction,
    Input,
    Node,
    NodeError,
    NodeKind,
    NodeManifest,
    NodeSetup,
    Output,
    PortModel,
    Registry,
    StatefulAction,
    Status,
    SyncAction,
    load_text,
    read_manifests,
)
from behavior_tree.scripted import scripted_registry
from tests.behavior_tree.trees import document, leaf


class CountDown(StatefulAction):
    """Runs for a number of ticks."""

    ticks = Input(int, default=2)
    left = Output(int)

    def on_start(self) -> Status:
        self._left = self.ticks
        return self.on_running()

    def on_running(self) -> Status:
        self.left = self._left
        self._left -= 1
        return SUCCESS if self._left < 0 else RUNNING


class Metric(Decorator):
    """Counts the ticks of its running child, and changes nothing; the shape of a quality requirement."""

    value = Output(int)

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._count = 0

    def tick(self) -> Status:
        self.set_running()
        status = self.child.execute_tick()
        if status == RUNNING:
            self._count += 1
            self.value = self._count
        return status


class Quorum(Control):
    """Succeeds as soon as two children have."""

    min_children = 2

    def tick(self) -> Status:
        self.set_running()
        results = [child.execute_tick() for child in self.children]
        if results.count(SUCCESS) >= 2:
            self.reset_children()
            return SUCCESS
        return RUNNING


class Caller(SyncAction):
    """Stands for any service: takes its ports from a manifest."""

    def __init__(self, setup: NodeSetup, calls: list[dict[str, Any]]) -> None:
        super().__init__(setup)
        self._calls = calls

    def tick(self) -> Status:
        self._calls.append({name: self.read_port(name) for name in self.setup.readers})
        for name in self.setup.writers:
            self.write_port(name, "done")
        return SUCCESS


def registry(*classes: type[Node]) -> Registry:
    result = scripted_registry([])
    result.register_all(classes)
    return result


def test_stateful_action_runs_through_its_phases() -> None:
    tree = load_text(document('<CountDown ticks="1" left="{left}"/>'), registry(CountDown))
    assert [tree.tick_once(), tree.tick_once()] == [RUNNING, SUCCESS]
    assert tree.blackboard.get("left") == 0


def test_decorator_resets_a_child_that_completed_without_being_told() -> None:
    tree = load_text(document(f'<Metric value="{{m}}">{leaf("RRS")}</Metric>'), registry(Metric))
    assert [tree.tick_once() for _ in range(3)] == [RUNNING, RUNNING, SUCCESS]
    assert tree.blackboard.get("m") == 2
    assert [node.status for node in tree.nodes] == [IDLE, IDLE]


def test_control_node_is_transparent_to_halts() -> None:
    text = document(f"<Quorum>{leaf('R', 'a')}{leaf('S', 'b')}{leaf('RS', 'c')}</Quorum>")
    tree = load_text(text, registry(Quorum))
    assert [tree.tick_once(), tree.tick_once()] == [RUNNING, SUCCESS]
    tree.tick_once()
    tree.halt_tree()
    assert [node.status for node in tree.nodes] == [IDLE] * 4


def test_condition_answers_yes_or_no() -> None:
    class Sunny(Condition):
        def holds(self) -> bool:
            return bool(self.blackboard.get("sun"))

    tree = load_text(document("<Sunny/>"), registry(Sunny))
    tree.blackboard.set("sun", 1)
    assert tree.tick_once() == SUCCESS
    tree.blackboard.set("sun", 0)
    assert tree.tick_once() == FAILURE


@pytest.mark.parametrize("result", [IDLE, None, "SUCCESS", 9])
def test_impossible_result_is_an_error_that_names_the_node(result: Any) -> None:
    class Odd(SyncAction):
        def tick(self) -> Status:
            return result  # type: ignore[no-any-return]

    tree = load_text(document("<Sequence><Odd name='strange'/></Sequence>"), registry(Odd))
    with pytest.raises(NodeError, match=r"'strange'.*a tick returns one of RUNNING"):
        tree.tick_once()


def test_failing_node_is_named_and_its_exception_kept() -> None:
    class Broken(SyncAction):
        def tick(self) -> Status:
            raise ZeroDivisionError("no wheel turns")

    tree = load_text(document("<Inverter>\n<Broken name='drive'/></Inverter>"), registry(Broken))
    with pytest.raises(NodeError, match="no wheel turns") as caught:
        tree.tick_once()
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert (caught.value.node, caught.value.line) == ("drive", 2)


def test_class_may_serve_many_types_that_only_a_manifest_describes() -> None:
    model = (
        "<root><TreeNodesModel><Action ID='Spin'><input_port name='angle' type='double' default='1.57'/>"
        "<output_port name='code'/></Action></TreeNodesModel></root>"
    )
    calls: list[dict[str, Any]] = []
    result = Registry()
    for manifest in read_manifests(model).values():
        result.register(Caller, manifest=manifest, calls=calls)
    dock = NodeManifest("Dock", NodeKind.ACTION, {"id": PortModel("id", Direction.INPUT, int)})
    result.register(Caller, manifest=dock, calls=calls)
    tree = load_text(document("<Sequence><Spin code='{code}'/><Dock id='4'/></Sequence>"), result)
    assert tree.tick_once() == SUCCESS
    assert calls == [{"angle": 1.57}, {"id": 4}]
    assert tree.blackboard.get("code") == "done"


def test_registered_types_can_be_listed_with_their_ports() -> None:
    manifests = registry(CountDown).manifests
    assert manifests["CountDown"].description == "Runs for a number of ticks."
    assert manifests["CountDown"].ports["ticks"].default == 2
    assert manifests["Sequence"].kind is NodeKind.CONTROL


def test_leaf_may_ask_for_another_tick_at_once() -> None:
    class Eager(StatefulAction):
        def on_start(self) -> Status:
            self.request_wake_up()
            return RUNNING

        def on_running(self) -> Status:
            return SUCCESS

    assert load_text(document("<Eager/>"), registry(Eager)).tick_once() == SUCCESS
