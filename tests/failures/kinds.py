"""The kinds of change that are walked through, and the system that they change."""

from __future__ import annotations

from dataclasses import replace

from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    EnterMode,
    Move,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import Transition

STACK = """\
system: tests
clock: real
imports: [tests.failures.parts, tests.failures.injecting]
topics:
  numbers: {type: failures/Number}
  others: {type: failures/Number}
  relayed: {type: failures/Number}
  aside: {type: failures/Number}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  source: {class: 'tests.failures.parts:Source', connect: {numbers: numbers}}
  other: {class: 'tests.failures.parts:Source', connect: {numbers: others}}
  relay:
    class: tests.failures.parts:Relay
    parameters: {flags: $RUN/flags}
    restart: {limit: 100, window: 1, backoff: 0.01}
  second:
    class: tests.failures.parts:Relay
    parameters: {flags: $RUN/flags}
    connect: {numbers: others, relayed: aside}
    restart: {limit: 100, window: 1, backoff: 0.01}
  meter: {class: 'tests.failures.parts:Meter', connect: {relayed: relayed, aside: aside}}
  adaptation_manager:
    class: tests.failures.injecting:FaultyManager
    restart: {limit: 100, window: 1, backoff: 0.01}
    parameters:
      fault: $RUN/fault.json
      journal: $RUN/journal.sqlite
      answer_within: 0.5
      undo_within: 3.0
      start_within: 5.0
modes:
  loud:
    - {change: set_parameters, component: relay, parameters: {gain: 5.0}}
    - {change: connect, component: relay, port: numbers, topic: others}
"""

OF_TWO_HOSTS = STACK.replace(
    "topics:", "hosts: {edge: {lost_after: 1.0}}\ntopics:\n  away: {type: failures/Number}"
).replace(
    "  meter:",
    """\
  far:
    class: tests.failures.parts:Relay
    host: edge
    parameters: {flags: $RUN/flags}
    connect: {numbers: others, relayed: away}
    restart: {limit: 100, window: 1, backoff: 0.01}
  meter:""",
)
"""The same with a component on a second host."""

THIRD = ComponentSpec(
    cls="tests.failures.parts:Relay",
    connections={"numbers": "numbers", "relayed": "more"},
    parameters={"flags": "$RUN/flags"},
)

KINDS: dict[str, tuple[Change, ...]] = {
    "set_parameters": (SetParameters("relay", {"gain": 2.0}), SetParameters("second", {"gain": 3.0})),
    "connect": (Connect("relay", "numbers", "others"), Connect("second", "numbers", "numbers")),
    "disconnect": (
        SetParameters("second", {"gain": 3.0}),
        Connect("second", "numbers", None),
        Connect("meter", "aside", None),
        Connect("second", "relayed", None),
    ),
    "transition": (ChangeState("second", Transition.DEACTIVATE), ChangeState("second", Transition.CLEANUP)),
    "add": (Add("third", THIRD, (TopicSpec("more", "failures/Number"),)),),
    "remove": (Remove("second"),),
    "swap": (Swap("relay", "tests.failures.parts:Loud", {"loudness": 5}),),
    "mode": (EnterMode("loud"),),
    "several": (
        SetParameters("relay", {"gain": 2.0}),
        Connect("relay", "numbers", "others"),
        Add("third", THIRD, (TopicSpec("more", "failures/Number"),)),
        Remove("second"),
    ),
    "several with a swap": (
        Swap("second", "tests.failures.parts:Loud", {"gain": 4.0}),
        Add("third", THIRD, (TopicSpec("more", "failures/Number"),)),
        SetParameters("relay", {"gain": 3.0}),
    ),
}
KINDS_OF_TWO_HOSTS: dict[str, tuple[Change, ...]] = {
    "move": (Move("relay", "edge"),),
    "move home": (Move("far", "local"),),
    "swap and move": (Move("relay", "edge"), Swap("relay", "tests.failures.parts:Loud", {"loudness": 5})),
    "several with a move": (
        SetParameters("far", {"gain": 2.0}),
        Move("relay", "edge"),
        Swap("second", "tests.failures.parts:Loud", {"gain": 4.0}),
    ),
}
ELSEWHERE: dict[str, tuple[Change, ...]] = {
    "set_parameters": (SetParameters("far", {"gain": 2.0}),),
    "connect": (Connect("far", "numbers", "numbers"),),
    "transition": (ChangeState("far", Transition.DEACTIVATE), ChangeState("far", Transition.CLEANUP)),
    "add": (Add("third", replace(THIRD, host="edge"), (TopicSpec("more", "failures/Number"),)),),
    "remove": (Remove("far"),),
    "swap": (Swap("far", "tests.failures.parts:Loud", {"loudness": 5}),),
}
"""The same kinds, of components on the second host.

Each of all these begins and ends with the stack as it is in ``STACK``, or ``OF_TWO_HOSTS``.
"""
WITH_A_GAP = {"connect", "disconnect", "mode", "several", "transition"}
"""Kinds that move inputs, or make a component inactive: what is told where nobody listens then is not lost."""
