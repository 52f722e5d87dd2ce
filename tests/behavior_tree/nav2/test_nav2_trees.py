"""Whole trees in the style of Nav2's and ReBeT's, with leaves that are known by their models only."""

import pytest

from behavior_tree import (
    FAILURE,
    RUNNING,
    SUCCESS,
    Direction,
    LoadError,
    ManualClock,
    MockConfig,
    Registry,
    Status,
    Tree,
    load_text,
    mock_models,
    read_manifests,
)
from behavior_tree.nav2 import register_nav2

MODELS = """<root BTCPP_format="4"><TreeNodesModel>
<Action ID="ComputePathToPose"><input_port name="goal"/><input_port name="planner_id"/>
  <output_port name="path"/><output_port name="error_code_id">why not</output_port></Action>
<Action ID="FollowPath"><input_port name="path"/><input_port name="controller_id" default="FollowPath"/>
  <output_port name="error_code_id"/></Action>
<Action ID="ClearCostmap"><input_port name="service_name"/></Action>
<Action ID="Spin"><input_port name="spin_dist"/></Action>
<Action ID="Wait"><input_port name="wait_duration"/></Action>
<Action ID="BackUp"><input_port name="backup_dist"/><input_port name="backup_speed"/></Action>
<Action ID="CancelControl"/>
<Action ID="SelectPlanner"><input_port name="topic_name"/><output_port name="selected_planner"/></Action>
<Action ID="TruncatePath"><input_port name="distance"/><input_port name="input_path"/>
  <output_port name="output_path"/></Action>
<Condition ID="GoalUpdated"/><Condition ID="IsPathValid"><input_port name="path"/></Condition>
<Condition ID="RecoveryHelps"><input_port name="error_code"/></Condition>
<Control ID="RecoveryNode"><input_port name="number_of_retries">tries</input_port></Control>
<Control ID="PersistentSequence"><bidirectional_port name="current_child_idx">place</bidirectional_port></Control>
<Decorator ID="RateController"><input_port name="hz"/></Decorator>
</TreeNodesModel></root>"""

PLAN = '<ComputePathToPose goal="{goal}" path="{path}" planner_id="{planner}" error_code_id="{plan_error}"/>'
FOLLOW = '<FollowPath path="{path}" error_code_id="{follow_error}"/>'
CLEAR = '<ClearCostmap name="{0}" service_name="{0}/clear"/>'
RECOVER = (
    '<ReactiveFallback name="Recovery"><GoalUpdated/><RoundRobin name="Actions">'
    f"<Sequence>{CLEAR.format('local')}{CLEAR.format('global')}</Sequence>"
    '<Spin spin_dist="1.57"/><Wait wait_duration="5.0"/><BackUp backup_dist="0.3" backup_speed="0.15"/>'
    "</RoundRobin></ReactiveFallback>"
)


def retried(number: int, first: str, second: str) -> str:
    return f'<RecoveryNode number_of_retries="{number}">{first}{second}</RecoveryNode>'


def replanned(decorator: str, ports: str = "") -> str:
    """Return a pipeline that plans again whenever a decorator says so, while the robot follows the path."""
    return f"<PipelineSequence><{decorator} {ports}>{PLAN}</{decorator}>{FOLLOW}</PipelineSequence>"


def checked(error: str, costmap: str) -> str:
    return f'<Sequence><RecoveryHelps error_code="{{{error}}}"/>{CLEAR.format(costmap)}</Sequence>'


VALID = '<Fallback><ReactiveSequence><Inverter><GoalUpdated/></Inverter><IsPathValid path="{path}"/></ReactiveSequence>'
PATIENT = (
    '<ReactiveSequence><PathLongerOnApproach path="{path}" prox_len="3.0" length_factor="2.0">'
    '<RetryUntilSuccessful num_attempts="1"><SequenceWithMemory><CancelControl name="cancel"/><Wait wait_duration="5"/>'
    f"</SequenceWithMemory></RetryUntilSuccessful></PathLongerOnApproach>{FOLLOW}</ReactiveSequence>"
)
TREES = {
    "time": replanned("RateController", 'hz="1.0"'),
    "distance": replanned("DistanceController", 'distance="1.0" pose="{here}"'),
    "speed": replanned("SpeedController", 'min_rate="0.1" max_rate="1.0" min_speed="0.0" max_speed="0.26"'),
    "goal": replanned("GoalUpdatedController"),
    "trigger": f"<Sequence><SingleTrigger>{PLAN}</SingleTrigger>{FOLLOW}</Sequence>",
    "becomes invalid": f"<PipelineSequence><RateController hz='1'>{VALID}{PLAN}</Fallback></RateController>{FOLLOW}"
    "</PipelineSequence>",
    "recovery": retried(
        6,
        f"<PipelineSequence><RateController hz='1.0'>{retried(1, PLAN, checked('plan_error', 'global'))}"
        f"</RateController>{retried(1, FOLLOW, checked('follow_error', 'local'))}</PipelineSequence>",
        RECOVER,
    ),
    "patience": retried(6, f"<PipelineSequence><RateController hz='1'>{PLAN}</RateController>{PATIENT}"
                        "</PipelineSequence>", RECOVER),
    "moving goal": '<PipelineSequence><SelectPlanner selected_planner="{planner}" topic_name="planner"/>'
    '<RateController hz="1.0"><Sequence><GoalUpdater input_goal="{goal}" output_goal="{new}">'
    f"{PLAN.replace('{goal}', '{new}')}</GoalUpdater>"
    '<TruncatePath distance="1.0" input_path="{path}" output_path="{short}"/></Sequence></RateController>'
    f"{FOLLOW}</PipelineSequence>",
    "bounds": f"<ReactiveSequence><IsPathValid path='{{path}}'/><Sequence>{PLAN}{FOLLOW}</Sequence></ReactiveSequence>",
    "square": '<Repeat num_cycles="4"><Sequence><Spin spin_dist="1.57"/><Wait wait_duration="1"/></Sequence></Repeat>',
    "errands": f'<PersistentSequence current_child_idx="{{place}}">{PLAN}{FOLLOW}<Spin spin_dist="3"/>'
    "</PersistentSequence>",
    "pausing": '<PauseResumeController pause_service_name="/pause" resume_service_name="/resume">'
    f"{replanned('RateController')}<Wait wait_duration='1'/></PauseResumeController>",
    "parallel": f"<NonblockingSequence>{PLAN}{FOLLOW}</NonblockingSequence>",
}  # fmt: skip


def robot() -> Registry:
    registry = Registry()
    register_nav2(registry)
    mocked = mock_models(registry, read_manifests(MODELS).values())
    assert "FollowPath" in mocked
    assert "RecoveryNode" not in mocked
    registry.substitute("FollowPath", MockConfig(async_delay=2500))
    registry.substitute("GoalUpdated", MockConfig(FAILURE))
    return registry


def load(body: str, registry: Registry, clock: ManualClock) -> Tree:
    tree = load_text(
        f'<root BTCPP_format="4"><BehaviorTree ID="Main">{body}</BehaviorTree></root>', registry, clock=clock
    )
    tree.blackboard.set("here", (0.0, 0.0))
    tree.blackboard.set("place", 0)
    assert not tree.warnings
    return tree


def run(tree: Tree, clock: ManualClock) -> Status:
    def wait(seconds: float) -> None:
        clock.advance(seconds)
        assert clock.now() < 300.0, "the tree does not end"

    return tree.tick_while_running(wait, period_s=0.1)


@pytest.mark.parametrize("name", TREES)
def test_tree_in_nav2s_style_runs_to_its_success(name: str) -> None:
    clock = ManualClock()
    assert run(load(TREES[name], robot(), clock), clock) == SUCCESS


@pytest.mark.parametrize("name", TREES)
def test_tree_in_nav2s_style_fails_when_its_actions_do(name: str) -> None:
    clock = ManualClock()
    registry = robot()
    for action in ("ComputePathToPose", "Spin", "IsPathValid"):
        registry.substitute(action, MockConfig(FAILURE))
    assert run(load(TREES[name], registry, clock), clock) == FAILURE


def test_robot_plans_once_a_second_while_it_drives() -> None:
    clock = ManualClock()
    registry = robot()
    registry.substitute("ComputePathToPose", MockConfig(success_script="plans += 1"))
    tree = load(TREES["time"], registry, clock)
    tree.blackboard.set("plans", 0)
    run(tree, clock)
    assert tree.blackboard.get("plans") == 3


def test_failing_controller_is_recovered_from_and_the_mission_succeeds() -> None:
    clock = ManualClock()
    script = "follows += 1; follows <= 2 ? FAILURE : SUCCESS"
    other = Registry()
    register_nav2(other)
    mock_models(other, read_manifests(MODELS).values())
    other.substitute("GoalUpdated", MockConfig(FAILURE))
    other.substitute("FollowPath", MockConfig(return_status_script=script))
    other.substitute("*/never", MockConfig(FAILURE))
    tree = load(TREES["recovery"], other, clock)
    tree.blackboard.set("follows", 0)
    cleared: list[str] = []
    tree.add_transition_hook(
        lambda uid, _before, status, _time: cleared.append(tree.nodes[uid - 1].name) if status == SUCCESS else None
    )
    assert run(tree, clock) == SUCCESS
    assert tree.blackboard.get("follows") == 3
    assert [name for name in cleared if name in ("local", "global")] == ["local", "local", "global"]


QUALITY = """<root BTCPP_format="4" main_tree_to_execute="FROG"><BehaviorTree ID="FROG"><Sequence>
<Script code="power_weight := 1.0; @power := -10.0; @safety := -10.0; safe_weight := 1.0"/>
<Sleep msec="3000"/>
<RetryUntilSuccessful num_attempts="-1"><getPose topic="/odom" out_pose="{pose}"/></RetryUntilSuccessful>
<filterObstacles number="{obstacles}"/>
<Repeat num_cycles="{obstacles}"><Parallel>
  <SafetyQR weight="{safe_weight}" metric="{@safety}" in_laser_scan="{@scan}">
  <PowerQR weight="{power_weight}" metric="{@power}" mean_metric="{mean_power}">
    <AdaptMaxSpeed adaptation_strategy="ucb" adaptation_options="0.10;0.18;0.26" adaptation_period="3">
      <ForceSuccess><visitObs poses="{poses}" name_of_task="{@current_task}"/></ForceSuccess>
    </AdaptMaxSpeed>
  </PowerQR></SafetyQR>
  <Repeat num_cycles="5"><NewIDObj number_detected="{found}"/></Repeat>
</Parallel></Repeat>
<Switch2 variable="{state}" case_1="Rest." case_2="Wake up!"><Wake/><Sleep msec="10"/>
  <SetBlackboard value="Rest." output_key="state"/></Switch2>
</Sequence></BehaviorTree></root>"""


def test_tree_with_quality_requirements_runs_without_any_of_its_types() -> None:
    clock = ManualClock()
    registry = Registry()
    registry.substitute("filterObstacles", MockConfig(success_script="obstacles := 3"))
    registry.substitute("visitObs", MockConfig(FAILURE, async_delay=700))
    tree = load_text(QUALITY, registry, clock=clock, mock_unknown=True)
    assert run(tree, clock) == SUCCESS
    assert clock.now() == pytest.approx(3.0 + 3 * 0.7, abs=0.2)
    assert tree.blackboard.get("state") == "Rest."
    mocked = "\n".join(tree.warnings)
    assert "PowerQR is unknown and mocked as decorator" in mocked
    assert "<text>:6: filterObstacles is unknown and mocked as action" not in mocked
    assert "filterObstacles is unknown and mocked as action" in mocked
    assert "Sequence" not in mocked


def test_models_in_the_document_say_what_its_unknown_types_are() -> None:
    model = '<TreeNodesModel><Condition ID="Ready"/><Action ID="Go"><input_port name="to"/></Action></TreeNodesModel>'
    text = '<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence><Ready/>\n<Go {0}/></Sequence></BehaviorTree>' + model
    tree = load_text(text.replace("{0}", 'to="home"') + "</root>", Registry(), mock_unknown=True)
    assert tree.tick_once() == SUCCESS
    assert [node.kind.value for node in tree.nodes] == ["Control", "Condition", "Action"]
    assert "<text>:2: Go is known by its model only and mocked" in tree.warnings
    with pytest.raises(LoadError, match="Go has no port 'from'") as caught:
        load_text(text.replace("{0}", 'from="home"') + "</root>", Registry(), mock_unknown=True)
    assert caught.value.line == 2
    with pytest.raises(LoadError, match="unknown node type 'Ready'"):
        load_text(text.replace("{0}", "") + "</root>", Registry())


def test_models_of_nav2_are_read_with_their_bidirectional_ports() -> None:
    manifests = read_manifests(MODELS)
    assert manifests["PersistentSequence"].ports["current_child_idx"].direction is Direction.INOUT
    assert manifests["FollowPath"].ports["controller_id"].default == "FollowPath"
    assert manifests["ComputePathToPose"].ports["error_code_id"].direction is Direction.OUTPUT


def test_mocks_do_not_stay_in_the_registry() -> None:
    registry = Registry()
    text = "<root BTCPP_format='4'><BehaviorTree ID='M'><Dance><A/><B/></Dance></BehaviorTree></root>"
    assert load_text(text, registry, mock_unknown=True).tick_once() == SUCCESS
    assert "Dance" not in registry.manifests


def test_running_robot_is_stopped_by_a_halt_from_every_tree() -> None:
    for name, body in TREES.items():
        clock = ManualClock()
        tree = load(body, robot(), clock)
        if tree.tick_once() != RUNNING:
            continue
        tree.halt_tree()
        assert {node.status for node in tree.nodes} == {0}, name
        assert tree.next_wake_up() is None or tree.next_wake_up() == clock.now(), name
