"""The bandits in a stack of real processes."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.messages.protocol.control import Snapshot
from tests.cli.app import whole
from tests.support.machine.processes import kill
from tests.support.systems import System, home
from tests.support.waiting import PATIENCE, wait_until

HERE = Path(__file__).parent
REQUEST = HERE / "request.yaml"


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    folder = tmp_path_factory.mktemp("planners")
    with home(folder / "home"):
        shutil.copy(HERE / "stack.yaml", folder)
        system = System(folder / "stack.yaml")
        yield system
        system.end()


def propose(system: System, **inputs: Any) -> Proposal:
    plain = yaml.safe_load(REQUEST.read_text())
    plain["inputs"] |= inputs
    request = codec.from_plain(plain, ProposalRequest)
    return system.client.call("planners/bandits/propose", request, Proposal, 30.0)


def credited(system: System) -> int:
    """Return how many credits the planner knows of."""
    snapshot = system.client.control("bandits", "state")
    assert isinstance(snapshot, Snapshot)
    kept = snapshot.state.get("turn", {"learned": {}})["learned"]
    return sum(count for count, _, _ in kept["ucb1"][1].values()) if "ucb1" in kept else 0


def test_what_was_learned_and_the_tickets_outlive_a_killed_planner(system: System) -> None:
    process = system.wait_running("bandits")
    assert system.client.architecture(timeout=PATIENCE), "the manager answers once it has taken over"
    chosen: list[Any] = []
    credit: dict[str, Any] = {}
    checkpoints: list[Any] = []
    bus = open_bus(system.info.hub)
    bus.subscribe(system.client.keys.checkpoint("bandits"), checkpoints.append)
    for turn in range(7):
        proposal = propose(system, **credit)
        assert proposal.choice["outcome"] in ("applied", "unchanged"), proposal
        chosen.append(tuple(proposal.choice["option"].values()))
        begin = proposal.choice["measure_from"]
        credit = {"credit": {"ticket": proposal.ticket, "utility": 0.1 * turn, "from": begin, "to": begin}}
    assert len(set(chosen)) == 5
    assert (3.0, 1) not in chosen
    assert credited(system) == 6
    before = len(checkpoints)
    wait_until(lambda: len(checkpoints) > before + 1, "a checkpoint")
    bus.close()
    kill(process.pid)
    system.wait_running("bandits", process.incarnation + 1)
    proposal = propose(system, **credit)
    assert proposal.choice["credit"]["credited"], proposal.choice
    assert proposal.choice["why"].startswith("best index")
    assert credited(system) == 7


def test_the_command_line_lists_planners_and_has_them_propose(system: System) -> None:
    system.wait_running("bandits")
    run = CliRunner()
    listed = run.invoke(whole(), ["planner", "list"])
    assert listed.exit_code == 0
    assert "epsilon=0.1" in listed.output
    dry = run.invoke(whole(), ["planner", "propose", "bandits", str(REQUEST), "--dry-run"])
    assert (dry.exit_code, "outcome: dry" in dry.output) == (0, True), dry.output
    done = run.invoke(whole(), ["planner", "propose", "bandits", str(REQUEST), "--json"])
    assert done.exit_code == 0, done.output
    assert '"ticket": "' in done.output
    unknown = run.invoke(whole(), ["planner", "propose", "bandit", str(REQUEST)])
    assert unknown.exit_code != 0
    assert "did you mean 'bandits'?" in str(unknown.exception) + unknown.output
