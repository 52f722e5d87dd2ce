"""Key expressions: where on the bus everything is. The only place that spells them.

Names are words of letters, digits, ``_`` and ``-``; a component's may be ``robot.word``, a topic's ``a/b/c``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from regraft.bus_schema.errors import BadKey

MAX_WORD_LENGTH = 64
MAX_OWN_NAME_LENGTH = 128
"""Characters of a name that is part of no key: of a parameter, port or mode, or a class's name for its service."""
WORD = rf"[A-Za-z0-9_][A-Za-z0-9_-]{{0,{MAX_WORD_LENGTH - 1}}}"
SYSTEM_NAME = re.compile(WORD)
COMPONENT_NAME = re.compile(rf"{WORD}(\.{WORD})?")
CLIENT_NAME = re.compile(r"[A-Za-z0-9_.-]{1,160}")
TOPIC_NAME = re.compile(rf"{WORD}(\.{WORD})?(/{WORD}){{0,7}}")

RESOURCE_NAME = re.compile(rf"[^\s=\x00-\x1f\x7f]{{1,{MAX_OWN_NAME_LENGTH}}}")
"""``NAME`` and ``NAME=AMOUNT`` stand among the words of a command."""

OF_A_WORD = f"letters, digits, _ and -, at most {MAX_WORD_LENGTH}"
MAX_SHOWN_LENGTH = 100
VOWELS = "aeiou"

CONTROL_VERBS = (
    *("describe", "transition", "parameters", "connections"),
    *("state", "handover", "resend", "types", "qualities", "fault"),
)


def system_name(name: str) -> str:
    """Return ``name`` if it can name a system; raises BadKey."""
    return _matched(SYSTEM_NAME, name, "system", f"a word of {OF_A_WORD}")


def host_name(name: str) -> str:
    """Return ``name`` if it can name a host; raises BadKey."""
    return _matched(SYSTEM_NAME, name, "host", f"a word of {OF_A_WORD}")


def robot_name(name: str) -> str:
    """Return ``name`` if it can name a robot; raises BadKey."""
    return _matched(SYSTEM_NAME, name, "robot", f"a word of {OF_A_WORD}")


def component_name(name: str) -> str:
    """Return ``name`` if it can name a component; raises BadKey."""
    return _matched(COMPONENT_NAME, name, "component", f"'word' or 'robot.word', each of {OF_A_WORD}")


def topic_name(name: str) -> str:
    """Return ``name`` if it can name a topic; raises BadKey."""
    return _matched(TOPIC_NAME, name, "topic", f"at most 8 words joined by '/', each of {OF_A_WORD}")


def service_name(name: str) -> str:
    """Return ``name`` if a service can be offered under it; raises BadKey."""
    return _matched(TOPIC_NAME, name, "service", f"at most 8 words joined by '/', each of {OF_A_WORD}")


def client_name(name: str) -> str:
    """Return ``name`` if it can name a client of services; raises BadKey."""
    return _matched(CLIENT_NAME, name, "client", "letters, digits, '_', '-' and '.', at most 160")


def own_name(name: str, kind: str) -> str:
    """Return ``name`` if it can name a ``kind`` of thing that is part of no key, such as a parameter; raises BadKey."""
    if not 0 < len(name) <= MAX_OWN_NAME_LENGTH:
        raise BadKey(f"{_shown(name)} cannot name a {kind}: must be 1 to {MAX_OWN_NAME_LENGTH} characters")
    return name


def resource_name(name: str, kind: str) -> str:
    """Return ``name`` if it can name a ``kind`` of resource, such as the device ``/dev/video0``; raises BadKey."""
    return _matched(RESOURCE_NAME, name, kind, f"1 to {MAX_OWN_NAME_LENGTH} characters without blanks and '='")


def _matched(pattern: re.Pattern[str], name: str, kind: str, right: str) -> str:
    if not isinstance(name, str) or not pattern.fullmatch(name):
        raise BadKey(f"{_shown(name)} cannot name {'an' if kind[0] in VOWELS else 'a'} {kind}: must be {right}")
    return name


def _shown(name: object) -> str:
    if isinstance(name, str) and len(name) > MAX_SHOWN_LENGTH:
        return f"{name[:MAX_SHOWN_LENGTH]!r}... ({len(name)} characters)"
    return repr(name)


@dataclass(frozen=True, slots=True)
class Keys:
    """All key expressions of one system."""

    system: str

    def topic(self, topic: str) -> str:
        """Where a topic's data is put."""
        return f"{self.system}/topic/{topic}"

    def topic_of(self, key: str) -> str | None:
        """Return the topic whose data is put at ``key``, None for any other key."""
        prefix = f"{self.system}/topic/"
        return key[len(prefix) :] if key.startswith(prefix) else None

    def alive(self, component: str, incarnation: int | str) -> str:
        """The liveliness token of one run of a component (``*`` matches any)."""
        return f"{self.system}/component/{component}/alive/{incarnation}"

    def status(self, component: str) -> str:
        """Where a component puts its status (``*`` matches any component)."""
        return f"{self.system}/component/{component}/status"

    def standby(self, component: str, incarnation: int | str = "") -> str:
        """The liveliness token of a run that does not speak for its component; without an incarnation, its status."""
        return f"{self.system}/component/{component}/standby" + (f"/{incarnation}" if incarnation != "" else "")

    def checkpoint(self, component: str) -> str:
        """Where a component puts its checkpoints, for its host to keep."""
        return f"{self.system}/component/{component}/checkpoint"

    def qualities(self, component: str) -> str:
        """Where a component puts the qualities that it measures (``*`` matches any component)."""
        return f"{self.system}/component/{component}/qualities"

    def control(self, component: str, incarnation: int | str, verb: str) -> str:
        """A control query of one run of a component (``*`` asks any; ``verb`` ``*`` declares them all)."""
        return f"{self.system}/component/{component}/{incarnation}/{verb}"

    def request(self, service: str) -> str:
        """Where clients put their requests to a service or action."""
        return f"{self.system}/service/{service}/request"

    def reply(self, service: str, client: str) -> str:
        """Where a service puts its replies to one client (``service`` ``**`` for all that a client is sent)."""
        return f"{self.system}/service/{service}/reply/{client}"

    def host(self, host: str, verb: str) -> str:
        """A host's ``alive`` token, ``status`` data and control queries."""
        return f"{self.system}/host/{host}/{verb}"

    def quality(self, requirement: str) -> str:
        """Where the satisfaction of a quality requirement is put, and can be asked."""
        return f"{self.system}/quality/{requirement}"

    @property
    def diagnostics(self) -> str:
        """Where components put diagnostics."""
        return f"{self.system}/diagnostics"

    @property
    def event(self) -> str:
        """Where adaptations, faults and transitions are published as they happen."""
        return f"{self.system}/event"

    def clock(self, part: str) -> str:
        """A part of the clock's protocol: ``step/MEMBER``, ``ack``, ``join``, ``marker_ack``, ``slot_request``,
        ``time``, ``admit``, ``release``, ``succeed``.
        """
        return f"{self.system}/clock/{part}"


@lru_cache(maxsize=4096)
def matches(expression: str, key: str) -> bool:
    """Return whether two key expressions with ``*`` and ``**`` have a key in common, as Zenoh would."""
    return _meet(expression.split("/"), key.split("/"))


def _meet(one: list[str], other: list[str]) -> bool:
    if not one or not other:
        return all(chunk == "**" for chunk in (*one, *other))
    if one[0] == "**":
        return any(_meet(one[1:], other[skip:]) for skip in range(len(other) + 1))
    if other[0] == "**":
        return _meet(other, one)
    return (one[0] == other[0] or "*" in (one[0], other[0])) and _meet(one[1:], other[1:])
