"""What cannot be moved is said before anything moves, all of it at once; what can be, with other changes, is."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    Move,
    Outcome,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.host.moves.moving import HOME, TO_EDGE, Ask, Item, Moving
from tests.host.several import Site
from tests.support.commands import run
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

HOSTS = (
    "{local: {devices: [lidar]}, edge: {lost_after: 1.0, devices: [lidar]}, arm: {lost_after: 1.0}, small: {memory: 1}}"
)
SERVICES = ("count", "ponder", "configured", "walk", "nap", "hurry")
ANOTHER = ComponentSpec(
    cls="tests.host.parts:Holder",
    connections={"items": "items", "totals": "more"},
    services={name: f"another/{name}" for name in SERVICES},
)
PARTS = "tests.handover.parts"
DOUBLER = Swap("totaller", f"{PARTS}:Doubler", {"offset": 5})
MORE = (TopicSpec("more", "handover_tests/Item"),)


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Moving]:
    """Return the stream, with the host edge; the others have not joined."""
    folder = tmp_path_factory.mktemp("moving")
    with home(folder / "home"):
        site = Site(folder)
        made = Moving(site, hosts=HOSTS, rate=200.0)
        made.join()
        made.wait_flowing()
        yield made
        site.close()


def test_all_that_is_wrong_is_said_at_once_and_nothing_moves(moving: Moving) -> None:
    before = moving.wait_alone("local")
    report = moving.adapt(
        Move("totaller", "nowhere"),
        Move("sink", "arm"),
        Move("adaptation_manager", "edge"),
        Move("nobody", "edge"),
        SetParameters("source", {"rate": -1.0}),
        Swap("caller", f"{PARTS}:Nobody"),
        Move("caller", "edge"),
        Swap("sleeper"),
        Move("sleeper", "elsewhere"),
    )
    assert report.outcome is Outcome.REJECTED
    found = {(v.change, v.component, v.field): v.problem for v in report.violations}
    assert "there is no host 'nowhere'" in found[0, "totaller", "host"]
    assert "host 'arm' has not joined" in found[1, "sink", "host"]
    assert "it carries out the move" in found[2, "adaptation_manager", "component"]
    assert (3, "nobody", "component") in found
    assert (4, "source", "parameters.rate") in found
    assert "'Nobody'" in found[5, "caller", "class"]
    assert "there is no host 'elsewhere'" in found[8, "sleeper", "host"]
    assert moving.wait_alone("local").pid == before.pid


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ((TO_EDGE, TO_EDGE), "moved twice"),
        ((TO_EDGE, Remove("totaller")), "leave that out"),
        ((TO_EDGE, Swap("totaller"), Swap("totaller")), "swapped twice"),
        ((Swap("totaller"), TO_EDGE, TO_EDGE), "moved twice"),
        ((Swap("totaller", f"{PARTS}:Newer"), TO_EDGE), "goes on from version 2"),
        ((Remove("totaller"), TO_EDGE), "removed earlier"),
        ((Add("new", ANOTHER, MORE), Move("new", "edge")), "add it where it is to be"),
        (
            (ChangeState("sleeper", Transition.CLEANUP), Move("sleeper", "edge")),
            "only an active or inactive component hands over",
        ),
        ((Move("totaller", "small"),), "host 'small' has not joined"),
    ],
)
def test_contradictions_are_rejected(moving: Moving, changes: tuple[Change, ...], text: str) -> None:
    report = moving.adapt(*changes)
    assert report.outcome is Outcome.REJECTED, report
    assert any(text in violation.problem for violation in report.violations), report.violations


def test_a_dry_run_says_what_would_be_and_touches_nothing(moving: Moving) -> None:
    before = moving.wait_alone("local")
    report = moving.adapt(TO_EDGE, dry_run=True)
    assert report.outcome is Outcome.PENDING, report
    assert report.architecture is not None
    assert report.architecture.components["totaller"].host == "edge"
    assert moving.wait_alone("local").pid == before.pid


def test_where_a_component_is_already_it_stays(moving: Moving) -> None:
    before = moving.wait_alone("local")
    report = moving.adapt(HOME)
    assert (report.outcome, report.steps) == (Outcome.APPLIED, ())
    assert moving.wait_alone("local").pid == before.pid


def test_a_device_stays_on_its_machine_unless_the_other_has_one_too(moving: Moving) -> None:
    assert moving.adapt(Add("another", ANOTHER, MORE)).outcome is Outcome.APPLIED
    full = moving.adapt(Move("another", "small"))
    assert any("offers 1 MiB, but its components need 8" in v.problem for v in full.violations), full
    refused = moving.adapt(Move("another", "arm"))
    (device,) = [v.problem for v in refused.violations if v.field == "resources.devices"]
    assert device.startswith("needs lidar for itself, and host 'arm' has none")
    assert device.endswith("offered by: local, edge")
    assert moving.adapt(Move("another", "edge")).outcome is Outcome.APPLIED
    wait_until(lambda: moving.site.host_of("another") == "edge", "it to be seen on edge")
    assert moving.adapt(Remove("another", ("more",))).outcome is Outcome.APPLIED


@pytest.mark.parametrize(
    "changes",
    [
        (SetParameters("totaller", {"offset": 4}), TO_EDGE),
        (TO_EDGE, Add("another", replace(ANOTHER, cls="tests.handover.parts:Totaller"), MORE)),
        (TO_EDGE, Move("sink", "edge"), Move("caller", "edge")),
        (TO_EDGE, Swap("sink")),
        (TO_EDGE, Connect("totaller", "config", "items"), DOUBLER),
        (Swap("totaller", "tests.host.parts:Holder"), SetParameters("totaller", {"offset": 6}), TO_EDGE),
        # The same in other orders, and in part.
        pytest.param((TO_EDGE, SetParameters("totaller", {"offset": 4})), marks=pytest.mark.evidence),
        pytest.param((TO_EDGE, Connect("totaller", "config", "items")), marks=pytest.mark.evidence),
        pytest.param((DOUBLER, TO_EDGE), marks=pytest.mark.evidence),
        pytest.param(
            (SetParameters("totaller", {"offset": 4}), TO_EDGE, Swap("totaller", DOUBLER.cls)),
            marks=pytest.mark.evidence,
        ),
    ],
)
def test_with_other_changes_in_one_adaptation_and_back(moving: Moving, changes: tuple[Change, ...]) -> None:
    report = moving.adapt(*changes)
    if report.outcome is not Outcome.APPLIED:
        moving.forget_calls()
        raise AssertionError((report.error, report.steps))
    moving.wait_alone("edge")
    moving.check()
    undone = moving.undo(report)
    assert undone.outcome is Outcome.APPLIED, (undone.error, undone.steps)
    moving.wait_alone("local")
    assert moving.system.client.view("totaller").parameters["offset"] == 3
    moving.check()


def test_to_swap_and_move_is_one_hand_over_to_another_class_on_another_host(moving: Moving) -> None:
    report = moving.adapt(TO_EDGE, DOUBLER)
    assert [step.action for step in report.steps] == [
        f"start {PARTS}:Doubler on edge beside that on local",
        f"hand over to {PARTS}:Doubler on edge",
    ]
    moving.wait_alone("edge")
    assert moving.system.client.call("double", Ask(4), Item, PATIENCE) == Item(8)
    assert moving.system.client.view("totaller").parameters["offset"] == 5
    moving.check()
    assert moving.undo(report).outcome is Outcome.APPLIED
    moving.wait_alone("local")


def test_what_is_inactive_stays_so_and_without_its_state_it_begins_anew(moving: Moving) -> None:
    report = moving.adapt(Move("sleeper", "edge"))
    assert report.outcome is Outcome.APPLIED, report
    assert moving.system.client.view("sleeper").state is State.INACTIVE
    assert moving.adapt(Move("sleeper", "local", with_state=False)).outcome is Outcome.APPLIED


def _regraft(*arguments: str) -> str:
    done = run(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_by_the_command_line_and_seen_by_it(moving: Moving) -> None:
    assert json.loads(_regraft("move", "totaller", "edge", "--reason", "to see", "--json"))["outcome"] == "applied"
    there = moving.wait_alone("edge")
    components = json.loads(_regraft("ps", "--json"))["systems"][0]["components"]
    (shown,) = [one for one in components if one["name"] == "totaller"]
    assert (shown["host"], shown["state"], shown["pid"]) == ("edge", "active", there.pid)
    assert "totaller" in _regraft("host")
    logs = Path(os.environ["REGRAFT_HOME"]) / "tests@edge" / "logs" / "totaller.log"
    assert logs.exists()
    assert _regraft("swap", "totaller", f"{PARTS}:Totaller", "--host", "local")
    moving.wait_alone("local")
    moving.check()


def test_the_log_of_a_moved_component_is_that_of_its_present_host(moving: Moving) -> None:
    here = Path(os.environ["REGRAFT_HOME"]) / "tests" / "logs" / "totaller.log"
    assert json.loads(_regraft("logs", "totaller", "--json"))["file"] == str(here)
    assert moving.adapt(TO_EDGE).outcome is Outcome.APPLIED
    moving.wait_alone("edge")
    assert here.exists()
    assert json.loads(_regraft("logs", "totaller", "--json"))["file"] is None
    assert moving.adapt(HOME).outcome is Outcome.APPLIED
    moving.wait_alone("local")
    assert json.loads(_regraft("logs", "totaller", "--json"))["file"] == str(here)
    moving.check()


def test_a_class_that_is_another_on_the_other_host_is_not_moved(site: Site) -> None:
    text = "from regraft import Component, Parameter\n\n\nclass Part(Component):\n    size = Parameter(1)\n"
    (site.folder / "partly.py").write_text(text)
    other = site.folder / "other"
    other.mkdir()
    (other / "partly.py").write_text(text.replace("size", "length"))
    site.up("  part: {class: 'partly:Part'}\n  lone: {class: 'partly:Part'}\n")
    site.join("edge", "", "--stack-folder", str(other))
    site.wait_active("part")
    report = site.adapt(Move("part", "edge"))
    assert report.outcome is Outcome.REJECTED
    assert "host 'edge' has another partly:Part: its parameters differ" in report.violations[0].problem
    (other / "partly.py").unlink()
    report = site.adapt(Move("lone", "edge"))
    assert "cannot import 'partly'" in report.violations[0].problem
