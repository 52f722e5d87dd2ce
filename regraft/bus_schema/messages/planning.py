"""Planners: all that decide on adaptations are asked by the same two messages.

A planner NAME is a component that offers two services:

- ``planners/NAME/propose``: ``ProposalRequest`` -> ``Proposal``
- ``planners/NAME/describe``: ``PlannerQuery`` -> ``PlannerDescription``

Planners differ inside ``inputs`` and ``choice``, plain data; ``PlannerDescription.inputs`` states the
form of the inputs as JSON Schema. Inputs that do not fit are refused, naming what is wrong and what would be right.

``planners/bandits/propose`` takes these inputs, of which only ``strategy`` and ``options`` are needed::

    {"strategy": "ucb1",
     "knobs": {"low": 0.0, "high": 1.0},                      # the utility's range, and the strategy's own
     "options": [                                             # the dimensions of the space
        {"component": "navigator", "parameter": "max_velocity", "values": [0.1, 0.18, 0.26]},
        {"component": "detector", "port": "image", "topics": ["camera/image", "corner_camera/image"]},
        {"component": "camera", "transitions": ["activate", "deactivate"]}],
     "constraints": [                                         # dimensions by name: component.parameter, component.port,
        {"if": {"detector.image": "camera/image"},            # component.transition, or the "name" they were given
         "then": {"camera.transition": "activate"}}],
     "settle": 1.0,                                           # seconds from applied until the effect can be measured
     "credit": {"ticket": "3-5f0c...", "utility": 0.7, "from": 12.0, "to": 15.0}}

and answers with this choice; ``applied`` and ``measure_from`` are there with a ticket, ``credit`` if one was given::

    {"strategy": "ucb1", "option": {"navigator.max_velocity": 0.18, ...}, "options": 12, "why": "not tried yet",
     "outcome": "applied", "applied": 12.4, "measure_from": 13.4,
     "credit": {"ticket": "3-5f0c...", "credited": true, "utility": 0.7, "why": ""}, "notes": []}

``outcome`` is one of these, or that of the report (``rejected``, ``rolled_back``, ``cancelled``, ``stuck``):
``applied``; ``unchanged``: the option chosen is in force already; ``dry``: nothing was asked for. ``no_answer``: the
adaptation manager timed out, and the changes may still happen. ``refused``: it did not take the request up, for the
reason in ``notes``. After an outcome of the report, ``rests`` is for how many proposals the option is left out.
``applied``, ``applied_state_lost`` and ``unchanged`` give a ticket, the others none. Utility measured in ``[from, to]``
is credited once, to the option of the ticket. ``from`` must not be before ``measure_from``: what was measured earlier
was earned by the previous option. A credit is taken without ``apply`` too, so that the last one of a mission is not
lost.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from regraft.bus_schema.annotations import PlainValue, Text
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.adaptation import AdaptationReport, Change


@message("regraft/ProposalRequest")
@dataclass(frozen=True, slots=True)
class ProposalRequest:
    """Ask a planner what to change for the sake of ``task``: the name under which it keeps what it learns and knows.

    With ``apply`` the planner has the adaptation manager carry its changes out, in the name of ``who``, because of
    ``reason``. It answers when that has ended. Without ``apply`` nothing is touched. ``inputs`` is what this planner
    needs. ``context`` is the state of the world: a map of numbers, texts and maps of them.
    """

    task: Annotated[str, Text(200)]
    reason: Annotated[str, Text(1000)] = ""
    actor: Annotated[str, Text(200)] = ""
    apply: bool = True
    inputs: dict[str, PlainValue] = field(default_factory=dict)
    context: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/Proposal")
@dataclass(frozen=True, slots=True)
class Proposal:
    """A planner's proposal: the changes, none if things are best left as they are.

    ``choice`` is for people and trees: what was chosen and why. ``ticket`` names the choice when its effect is reported
    to the planner later. It is empty where there is nothing to report: no option is in force, or the planner does not
    learn. ``report`` is the report of the adaptation, null if none was asked for or the request timed out.
    """

    task: Annotated[str, Text(200)]
    changes: tuple[Change, ...] = ()
    choice: dict[str, PlainValue] = field(default_factory=dict)
    ticket: Annotated[str, Text(200)] = ""
    report: AdaptationReport | None = None


@message("regraft/PlannerQuery")
@dataclass(frozen=True, slots=True)
class PlannerQuery:
    """Ask a planner to describe itself."""


@message("regraft/StrategyDescription")
@dataclass(frozen=True, slots=True)
class StrategyDescription:
    """One of the ways in which a planner can decide; ``knobs`` is the JSON Schema of what can be set about it."""

    name: str
    text: str = ""
    knobs: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/PlannerDescription")
@dataclass(frozen=True, slots=True)
class PlannerDescription:
    """A planner: its name in ``planners/NAME/propose``, the component that it is, what it does.

    ``inputs`` is the JSON Schema of its requests' ``inputs``. A planner with one way of deciding lists no strategies.
    """

    planner: str
    component: str
    text: str = ""
    inputs: dict[str, PlainValue] = field(default_factory=dict)
    strategies: tuple[StrategyDescription, ...] = ()
