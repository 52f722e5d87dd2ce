"""Reads when a component's process is started again."""

from __future__ import annotations

from regraft.bus_schema.encoding.codec import from_plain, to_plain
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Restart, RestartPolicy
from regraft.stack.yaml.section import Section


def read_restart(section: Section) -> RestartPolicy:
    """Return the policy. ``restart: never`` is short for ``restart: {when: never}``."""
    node = section.node("restart")
    if node is None:
        return RestartPolicy()
    if not isinstance(node.value, dict):
        return RestartPolicy(section.choice("restart", Restart, Restart.ALWAYS))
    inner = section.section("restart")
    inner.only("when", "limit", "window", "backoff")
    usual = RestartPolicy()
    window, backoff = inner.number("window"), inner.number("backoff")
    policy = RestartPolicy(
        inner.choice("when", Restart, usual.when),
        inner.integer("limit", usual.limit, 0, 2**31),
        usual.window if window is None else window,
        usual.backoff if backoff is None else backoff,
    )
    return _within_bounds(inner, policy)


def _within_bounds(section: Section, policy: RestartPolicy) -> RestartPolicy:
    # The bounds are part of the policy's definition, and are checked where it is packed.
    try:
        return from_plain(to_plain(policy), RestartPolicy)
    except BadMessage as error:
        section.wrong(".".join(error.where), error.why)
        return RestartPolicy()
