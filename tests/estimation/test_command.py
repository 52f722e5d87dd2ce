"""``regraft estimate --stack`` predicts a stack that does not run, and says what is wrong with what was typed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.cli.app import whole

FROG = "regraft/stacks/frog"


@pytest.fixture
def small(tmp_path: Path) -> str:
    """Return a stack of three components that has estimators without faults."""
    file = tmp_path / "stack.yaml"
    file.write_text(
        """\
system: small
topics:
  a: {type: regraft/Twist}
  b: {type: regraft/Twist}
  d: {type: regraft/Twist}
components:
  source: {class: tests.estimation.parts:Source, connect: {made: a}}
  other: {class: tests.estimation.parts:Source, connect: {made: d}, parameters: {rate: 40.0}}
  first: {class: tests.estimation.parts:Filter, connect: {taken: a, given: b}}
modes:
  slow:
    - {change: set_parameters, component: source, parameters: {rate: 1.0}}
  awake:
    - {change: transition, component: source, transition: activate}
    - {change: transition, component: other, transition: deactivate}
    - {change: set_parameters, component: source, parameters: {rate: 1.0}}
"""
    )
    return str(file)


def estimate(*arguments: str) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(whole(), ["estimate", *arguments])


def after(small: str, *changes: str, context: tuple[str, ...] = ()) -> dict[str, float | None]:
    """Return the predicted qualities after changes."""
    options = [word for change in changes for word in ("--change", change)]
    options += [word for one in context for word in ("--context", one)]
    done = estimate("--stack", small, *options, "--json")
    assert done.exit_code == 0, done.stderr
    lines = json.loads(done.stdout)["qualities"]
    return {f"{line['component']}.{line['quality']}": line["after"]["value"] for line in lines}


def test_a_whole_stack_is_predicted(small: str) -> None:
    assert after(small) == {"source.flow": 10.0, "other.flow": 40.0, "first.flow": 5.0}
    assert after(small, context=("scale=2",))["first.flow"] == 10.0


@pytest.mark.parametrize(
    ("change", "flow"),
    [
        ("source.rate=20", 10.0),
        ("first.taken=d", 20.0),
        ("source.state=inactive", None),
        ("source.class=tests.estimation.parts:Raising", None),
        ("{change: mode, mode: slow}", 0.5),
        ("{change: mode, mode: awake}", 0.5),
        ("{change: set_parameters, component: first, parameters: {share: 1.0}}", 10.0),
    ],
)
def test_changes_are_typed_short_or_as_in_a_file(small: str, change: str, flow: float | None) -> None:
    assert after(small, change)["first.flow"] == flow


def test_changes_apply_in_their_order(small: str) -> None:
    assert after(small, "source.rate=20", "first.taken=d", "other.rate=1", "first.share=1")["first.flow"] == 1.0


def test_before_and_after_are_shown_with_where_they_come_from(small: str) -> None:
    done = estimate("--stack", small, "--change", "source.state=inactive")
    rows = {row.split()[0]: row for row in done.stdout.splitlines()}
    assert rows["source.flow"].split()[1:] == ["10", "Hz", "unknown:", "the", "component", "is", "inactive"]
    assert rows["first.flow"].split()[1:] == ["5", "Hz", "unknown:", "not", "given"]
    assert "other.flow" not in rows


def test_what_the_manager_would_reject_is_estimated_and_said(small: str) -> None:
    done = estimate("--stack", small, "--change", "other.made=a")
    assert done.exit_code == 0
    assert "an adaptation manager would reject this" in done.stderr


def test_null_disconnects_a_port_and_one_that_must_be_fed_is_named_with_what_would_feed_it(small: str) -> None:
    assert after(small, "first.taken=null")["first.flow"] is None
    done = estimate("--stack", FROG, "--change", "detector.image=null")
    assert (
        "detector.connect.image: input 'image' is required while the component is active, but is connected to no "
        "topic; topics that carry regraft/Image: camera/image, corner_camera/image"
    ) in done.stderr


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--change", "source.rat=20"), "source has no parameter or port 'rat'; did you mean 'rate'?"),
        (("--change", "sorce.rate=20"), "there is no component 'sorce'; did you mean 'source'?"),
        (("--change", "source.rate=fast"), "source.rate = 'fast': must be a number"),
        (("--change", "source.rate=1e400"), "--change source.rate: 1e400 is too large for a number"),
        (("--change", "source.rate=null"), "source.rate = null: must be a number"),
        (("--change", "source.class=null"), "'null' must look like 'package.module:Class'"),
        (("--context", "scale=1e400"), "--context scale: 1e400 is too large for a number"),
        (("--change", "source.rate=-1"), "source.rate = -1: must be at least 0"),
        (("--change", "first.taken=nothing"), "first: input 'taken' is connected to 'nothing'"),
        (("--change", "source.state=inactve"), "there is no state 'inactve'; did you mean 'inactive'?"),
        (("--change", "source.state=active"), "source is active: no single transition leads to active"),
        (("--change", "source.class=tests.estimation.parts:Sauce"), "has no class 'Sauce'; did you mean 'Source'?"),
        (("--change", "rate=20"), "must look like navigator.max_velocity=0.1"),
        (("--change", "source"), "must look like navigator.max_velocity=0.1"),
        (("--change", "{change: swop}"), "must be one of: add, connect, mode"),
        (("--change", "{change"), "is not YAML"),
        (("--change", "{change: mode, mode: slwo}"), "there is no mode 'slwo'; did you mean 'slow'?"),
        (("--change", "{change: remove, component: sorce}"), "there is no component 'sorce'; did you mean 'source'?"),
        (("sorce",), "there is no component 'sorce'; did you mean 'source'?"),
        (("--set", "rate=1"), "--set goes with a COMPONENT alone"),
    ],
)
def test_what_is_wrong_is_said_with_the_nearest_name(small: str, arguments: tuple[str, ...], problem: str) -> None:
    done = estimate("--stack", small, *arguments)
    assert done.exit_code == 2
    assert problem in done.stderr


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ((), "name a COMPONENT, a MODULE:CLASS or a --stack"),
        (("navigator", "--change", "navigator.max_velocity=0.1"), "--change goes with --stack"),
        (("--stack", "frg"), "did you mean 'frog'?"),
    ],
)
def test_a_command_that_means_nothing_is_refused(arguments: tuple[str, ...], problem: str) -> None:
    done = estimate(*arguments)
    assert done.exit_code == 2
    assert problem in done.stderr


def test_an_estimate_of_a_class_that_does_not_count_is_said_with_the_reason() -> None:
    done = estimate("tests.qualities.parts:Gauge", "--context", "level=9")
    assert done.stderr == "regraft: the quality 'level' is unknown: 9: must be at most 1 m\n"
    assert "cost" in done.stdout
    assert "level" not in done.stdout


def test_frog_s_detector_is_estimated_at_the_rate_of_its_camera() -> None:
    slow = after(FROG, "camera.rate=0.5")
    assert (slow["camera.rate"], slow["detector.time_per_request"]) == (0.5, 2.0)
    assert (
        after(FROG, "camera.rate=0.5", "corner_camera.rate=5", "detector.image=corner_camera/image")[
            "detector.time_per_request"
        ]
        == 1.0
    )


def test_what_is_added_is_of_the_stacks_robot_and_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "rover.xml").write_text("<mujoco/>")
    (tmp_path / "robot.yaml").write_text("model: rover.xml\nparameters: {radius: 0.3}\n")
    stack = tmp_path / "stack.yaml"
    stack.write_text(
        "system: one\nworld: rover.xml\nrobot: robot.yaml\ntopics: {a: regraft/Twist}\n"
        "components: {first: {class: 'tests.estimation.parts:Round', connect: {made: a}}}\n"
    )
    added = "{{change: add, component: more, spec: {{class: 'tests.estimation.parts:Round', parameters: {}}}}}"

    def sizes(parameters: str) -> dict[str, float | None]:
        return after(str(stack), added.format(parameters))

    assert sizes("{}") == {"first.size": 0.3, "more.size": 0.3}
    assert sizes("{file: $world}")["more.size"] == sizes("{file: rover.xml}")["more.size"] == 10.3
    refused = estimate("--stack", str(stack), "--change", added.format("{radius: 0.4}"))
    assert "more.radius = 0.4: must be at most 0.3" in refused.stderr
