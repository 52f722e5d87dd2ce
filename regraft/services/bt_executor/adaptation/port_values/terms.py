"""The consequences of an attempt to adapt, as the ports of a decorator state them when it begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from behavior_tree import BlackboardError, Node, PortError, ScriptError
from regraft.services.bt_executor.adaptation.port_values.policies import Policy
from regraft.services.bt_executor.adaptation.port_values.ports import POLICIES, duration_of, policy_of

BAD_VALUES: Final = (ValueError, BlackboardError, PortError, ScriptError)
"""Raised where a port, or an entry that a script needs, holds something that makes no sense there."""


@dataclass(frozen=True, slots=True)
class Terms:
    """The pauses after an attempt in seconds, the policy of each port ``on_...``, and what cannot be read of them."""

    retry_after: float = 1.0
    settle: float = 1.0
    policies: Mapping[str, Policy] = field(default_factory=dict)
    problem: str = ""


def terms_of(node: Node) -> Terms:
    """Return the terms now; a port that cannot be read has its default, and the first of them is the problem."""
    problems: list[str] = []

    def read(port: str, ask: Any, default: Any) -> Any:
        try:
            return ask(node, port)
        except BAD_VALUES as error:
            problems.append(str(error))
            return default

    retry_after, settle = (read(port, duration_of, 1.0) for port in ("retry_after", "settle"))
    policies = {port: read(port, policy_of, Policy()) for port in POLICIES}
    return Terms(retry_after, settle, policies, problems[0] if problems else "")
