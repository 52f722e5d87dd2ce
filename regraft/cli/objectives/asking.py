"""Asks the metacontroller that is meant."""

from __future__ import annotations

from typing import TypeVar

from regraft.bus_schema.messages.management.objectives import ADD
from regraft.bus_schema.model.robots.metacontrollers import (
    NoMetacontroller,
    NoSuchMetacontroller,
    WhichMetacontroller,
    metacontroller,
)
from regraft.bus_schema.model.robots.planners import planner_service, planners_with
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.cli.running_system import Reached

A = TypeVar("A")

ANSWER_TIMEOUT = 5.0
"""Seconds for an answer that waits for nothing."""


def planner_meant(there: Reached, name: str, robot: str) -> str:
    """Return the metacontroller that is meant, among those of a robot if it is named; raises BadInput, Unreachable."""
    known = planners_with(ADD, there.known.of_robot(robot).components)
    try:
        return metacontroller(known, name)
    except NoMetacontroller as error:
        raise Unreachable(f"{error}{f', as one of the robot {robot}' if robot else ''}") from None
    except NoSuchMetacontroller as error:
        raise BadInput(str(error)) from None
    except WhichMetacontroller as error:
        raise BadInput(f"{error} with --planner") from None


def ask(there: Reached, planner: str, verb: str, request: object, reply: type[A], timeout: float = ANSWER_TIMEOUT) -> A:
    """Ask a metacontroller; raises CallFailed."""
    return there.client.call(planner_service(planner, verb), request, reply, timeout)
