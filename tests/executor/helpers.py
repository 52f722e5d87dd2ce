"""What the tests of the executor share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed, stacks
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardEntry,
    BlackboardRequest,
    Command,
    MissionCommand,
    MissionRequest,
    MissionStatus,
    NodeStatus,
)
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig

FROG = Path(stacks.__file__).parent / "frog" / "mission.xml"


def tree(*nodes: str, name: str = "Main") -> str:
    """Return the XML of a tree whose root is a sequence of nodes; their first one is on line 2."""
    return (
        f'<root BTCPP_format="4"><BehaviorTree ID="{name}"><Sequence>\n'
        + "\n".join(nodes)
        + ("\n</Sequence></BehaviorTree></root>")
    )


def run(rig: Rig, xml: str, **parameters: Any) -> Executor:
    """Start an executor with a tree."""
    executor = rig.add(Executor, "bt_executor", {"autostart": False, **parameters})
    command(rig, Command.LOAD, xml)
    command(rig, Command.START)
    return executor


def command(rig: Rig, what: Command, xml: str = "", main: str = "") -> MissionStatus:
    """Give the executor a command."""
    return rig.call("mission/command", MissionCommand(what, xml, main), MissionStatus)


def refusal(rig: Rig, what: Command, xml: str = "") -> str:
    """Give a command that must be refused; returns why."""
    with pytest.raises(CallFailed) as refused:
        command(rig, what, xml)
    return refused.value.why


def status(rig: Rig) -> MissionStatus:
    """Return the mission's status."""
    return rig.call("mission/status", MissionRequest(), MissionStatus)


def entry(rig: Rig, key: str, board: str = "") -> BlackboardEntry:
    """Return a blackboard entry."""
    return rig.call("mission/blackboard", BlackboardRequest(key, board), BlackboardEntries).entries[0]


def node_statuses(now: MissionStatus) -> dict[str, NodeStatus]:
    """Return the nodes' statuses by their paths."""
    return {node.path: node.status for node in now.nodes}


def kinds(rig: Rig) -> list[str]:
    """Return the kinds of the mission's events so far."""
    return [event.kind for event in rig.events if event.kind.startswith("mission.")]
