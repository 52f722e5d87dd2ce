"""Requests to the routes of a mission that must do it no harm, drawn from a seed."""

from __future__ import annotations

import json
from collections.abc import Callable
from random import Random
from typing import Any, Final

import httpx

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionStatus
from regraft.client import Client
from tests.hostile.trees import document, hostile_tree

TAKERS: Final = ("swap", "load")
TOO_SLOW: Final = "takes longer than"
"""The reason of a check that names time: the tree may be right, and would take the mission's place."""
REFUSED: Final = 422

BY_BUS: Final = 0.75
"""The share of the trees that come by the bus; the others come by REST, as all other requests do."""

Note = Callable[[str, str, str], None]
"""Takes the kind of an input, the status of its answer, and the answer's text."""
Body = dict[str, Any]


class Doors:
    """The ways to a mission: the gateway, and the bus."""

    def __init__(self, rest: httpx.Client, bus: Client, note: Note) -> None:
        """Have the answers noted."""
        self._rest = rest
        self._bus = bus
        self._note = note

    def request(self, kind: str, method: str, path: str, how: Body) -> httpx.Response:
        """Send a request to the gateway."""
        answer = self._rest.request(method, path, **how)
        self._note(kind, str(answer.status_code), answer.text)
        return answer

    def by_rest(self, kind: str, command: str, tree: str) -> str:
        """Give a command with a tree by REST; return why it is refused as invalid, empty for any other answer."""
        answer = self.request(kind, "POST", f"/mission/{command}", as_json({"tree": tree}))
        return answer.text if answer.status_code == REFUSED else ""

    def by_bus(self, kind: str, command: str, tree: str) -> str:
        """Give a command with a tree by the bus; return as above."""
        try:
            self._bus.call("mission/command", MissionCommand(Command(command), tree), MissionStatus)
        except SchemaError as error:
            self._note(kind, "unsent", str(error))
        except CallFailed as error:
            status = error.code.value if error.code else error.answer.value if error.answer else "silence"
            self._note(kind, status, error.why)
            return error.why if error.code is RefusalCode.INVALID else ""
        else:
            self._note(kind, "ok", "")
        return ""


def send_one(doors: Doors, random: Random) -> None:
    """Send one hostile input, mostly a tree, by one request or several."""
    if random.random() < 0.7:
        kind, text = hostile_tree(random)
        give = doors.by_bus if random.random() < BY_BUS else doors.by_rest
        send_tree(give, kind, text, random.choice(("", *TAKERS)))
    else:
        doors.request(*random.choice(KINDS)(random))


def send_tree(give: Callable[[str, str, str], str], kind: str, text: str, taker: str) -> None:
    """Have a tree checked; one that is refused may then be to take the mission's place, which is refused as well."""
    refused = give(kind, "check", text)
    if taker and refused and TOO_SLOW not in refused:
        give(f"{taker} {kind}", taker, text)


def as_json(body: object) -> Body:
    """Return a body as JSON: lone surrogates are escaped, which httpx does not do."""
    return {"content": json.dumps(body).encode(), "headers": {"content-type": "application/json"}}


def _odd_name(random: Random) -> str:
    return random.choice(
        (
            *(
                "",
                "rounds",
                "nowhere",
                "Main",
                "Main/Inner::4",
                "@rounds",
                "{rounds}",
                "a\0b",
                "é",
                "x" * 150,
                "x" * 5_000,
            ),
            *("../..", "%00", "a b", "*", "bt_executor", "\U0001f916", " ", "-1", "__class__", "\u202e"),
        )
    )


def _odd_value(random: Random) -> Any:
    return random.choice(
        (
            *("many", "", 1.5, 1e300, -(2**63) - 1, 2**64, 10**400, True, [], {}, [[[[1]]]], {"a": {"b": None}}),
            *("x" * 200_000, "\ud800", "\0", float("nan"), float("inf"), ["1", 2, None], "9" * 5_000),
        )
    )


def wrong_write(random: Random) -> tuple[str, str, str, Body]:
    """Write to the mission's counter what is no whole number, with other entries, which must stay out as well."""
    value: Any = random.choice(("many", "", 1.5, "\0", [], {}, float("nan"), 2**64, "9" * 400, "x" * 200_000))
    entries = {"rounds": value, **{_odd_name(random): _odd_value(random) for _ in range(random.randrange(5))}}
    entries["rounds"] = value
    return "wrong write", "PATCH", "/mission/blackboard", as_json(entries)


def odd_write(random: Random) -> tuple[str, str, str, Body]:
    """Write odd values to odd boards; what fits is written, and harms nothing."""
    board = random.choice(("", "nowhere", _odd_name(random)))
    entries = {random.choice(("odd", "\0", "@odd", "a b", "{", "odd2")): _odd_value(random)}
    if random.random() < 0.2:
        entries = {f"{_odd_name(random)}{n}": n for n in range(random.choice((101, 3_000)))}
    return "odd write", "PATCH", "/mission/blackboard", {"params": {"board": board}, **as_json(entries)}


def odd_read(random: Random) -> tuple[str, str, str, Body]:
    """Read what is not there, of boards and robots that are not there."""
    path = random.choice(("/mission", "/mission/counts", "/mission/blackboard", "/mission/nothing"))
    names = random.sample(("key", "board", "robot", "nonsense"), random.randrange(4))
    return "odd read", "GET", path, {"params": {name: _odd_name(random) for name in names}}


def wrong_state(random: Random) -> tuple[str, str, str, Body]:
    """Command what makes no sense for a mission that runs."""
    path = random.choice(("/mission/start", "/mission/step"))
    return "wrong state", "POST", path, random.choice(({}, as_json({}), as_json(None)))


def wrong_body(random: Random) -> tuple[str, str, str, Body]:
    """Send a body that no route takes, also to those that would end the mission with a right one."""
    command = random.choice(("check", "swap", "load", "pause", "halt", "start", "step"))
    content = random.choice(
        (
            *(
                b"{",
                b"[]",
                b"1",
                b"\xff\xfe{",
                b'{"tree":',
                b"[" * 100_000,
                b'{"a":' * 50_000,
                b'"' + b"x" * 1_100_000 + b'"',
            ),
            *(b'{"tree": 1}', b'{"tree": null}', b'{"tree": ""}', b'{"main": []}', b'{"tree": {"tree": "x"}}'),
            *(b'{"tree": "<root/>", "nonsense": 1}', b'{"tree": "x", "tree": 1e999}', b'{"nonsense": NaN}'),
            *(b"<root/>", b"\0", b'{"main": "Nowhere"}', b'{"main": "\\u0000", "command": "halt"}'),
        )
    )
    kind = random.choice(("application/json", "text/xml", "application/json; charset=utf-16", ""))
    return "wrong body", "POST", f"/mission/{command}", {"content": content, "headers": {"content-type": kind}}


def unknown_tree(random: Random) -> tuple[str, str, str, Body]:
    """Command a tree of the library that is not there, or of a text that lacks it."""
    body = {"main": random.choice(("Nowhere", "\0", "é" * 500, "x" * 200_000))}
    if random.random() < 0.5:
        body["tree"] = document("<AlwaysSuccess/>")
    return "unknown tree", "POST", f"/mission/{random.choice(('check', 'swap', 'load'))}", as_json(body)


KINDS: Final = (wrong_write, odd_write, odd_read, wrong_state, wrong_body, unknown_tree)
