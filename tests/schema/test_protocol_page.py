"""docs/protocol.md says what the code does: its bytes, tables, types, keys and times."""

from __future__ import annotations

import json
import re
import struct
from itertools import pairwise
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from regraft import request_protocol
from regraft.bus_schema.encoding import codec, envelope
from regraft.bus_schema.encoding.arrays import ARRAY_EXTENSION, KNOWN_DTYPES, TAIL_EXTENSION
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.encoding.shapes import MAX_PLAIN_DEPTH
from regraft.bus_schema.keys import CONTROL_VERBS, Keys
from regraft.bus_schema.messages.protocol.clock import StepKind
from regraft.bus_schema.messages.protocol.control import ControlCode, RewireStep
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer, Verb
from regraft.bus_schema.model.lifecycle import TRANSITIONS, State, Transition
from regraft.client.json_view import as_json
from regraft.dashboard_api.backend.refusal_statuses import KINDS
from regraft.host import supervisor
from regraft.host.watchdog import hang_detection
from regraft.lockstep import member, step_dispatch
from regraft.process import forked
from regraft.runtime.core import pending
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.data import status_reporter, stream
from regraft.runtime.handover import incumbent, successor
from regraft.runtime.requests import request_server
from tests.schema.spelling import line_of, members_of
from tests.schema.strategies import all_types
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "protocol.md").read_text()
FENCES = re.findall(r"^```(\w+) ?([^\n]*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
DUMPS = [
    (what, bytes.fromhex(dump), json.loads(shown))
    for (language, what, dump), (_, _, shown) in pairwise(FENCES)
    if language == "hex"
]
MESSAGES = [dump for dump in DUMPS if dump[0].startswith("regraft/")]

all_types()


def rows(*heads: str) -> list[list[str]]:
    """Return the rows of the table with these column heads."""
    head = "| " + " | ".join(heads) + " |\n"
    assert PAGE.count(head) == 1, f"the page must have one table headed {heads}"
    body = PAGE.split(head)[1].split("\n\n")[0].splitlines()[1:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in body]


def test_the_page_shows_each_kind_of_payload() -> None:
    assert [what for what, _, _ in DUMPS] == [
        "regraft/LightLevel",
        "value",
        "regraft/Image",
        "envelope",
        "regraft/Request",
    ]


@pytest.mark.parametrize(("name", "payload", "shown"), MESSAGES, ids=[what for what, _, _ in MESSAGES])
def test_a_dump_is_the_message_shown_beside_it(name: str, payload: bytes, shown: Any) -> None:
    kind = type_named(name)
    message: Any = codec.decode(payload, kind.cls)
    assert as_json(message) == shown
    assert codec.encode(message) == payload
    assert f"`{kind.encoding}`:" in PAGE
    Draft202012Validator(kind.json_schema()).validate(shown)


def test_the_dump_of_an_array_is_the_array_shown_beside_it() -> None:
    (value,) = [(payload, shown) for what, payload, shown in DUMPS if what == "value"]
    assert as_json(codec.unpack_plain(value[0])) == value[1]


def test_the_dump_of_an_envelope_is_the_envelope_shown_beside_it() -> None:
    (found,) = [(attachment, shown) for what, attachment, shown in DUMPS if what == "envelope"]
    sent = Envelope.from_bytes(found[0])
    assert {name: getattr(sent, name) for name in found[1]} == found[1]
    assert sent.to_bytes() == found[0]


def test_the_table_of_the_envelope_is_its_layout() -> None:
    *fixed, source = rows("offset", "size", "type", "field")
    codes = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i64": "q"}
    layout = "<"
    for offset, size, kind, _ in fixed:
        assert struct.calcsize(layout) == int(offset)
        layout += codes[kind]
        assert struct.calcsize(layout) == int(offset) + int(size)
    assert layout == envelope.LAYOUT.format
    assert source[:2] == [str(envelope.LAYOUT.size), f"1 to {envelope.MAX_SOURCE_LENGTH}"]
    assert [int(fixed[0][3].split(": ")[1])] == [envelope.VERSION]


def test_the_page_names_every_dtype_and_both_extensions() -> None:
    listed = re.search(r"^Dtypes: (.*?)\. A type", PAGE, re.MULTILINE)
    assert listed
    assert {dtype.encode() for dtype in re.findall(r"`(.{3})`", listed[1])} == KNOWN_DTYPES
    assert f"| array | extension type {ARRAY_EXTENSION} |" in PAGE
    assert f"| array as the tail | extension type {TAIL_EXTENSION}, and the payload's tail |" in PAGE
    assert f"at most {MAX_PLAIN_DEPTH} levels deep" in PAGE
    assert f"at most {codec.MAX_MESSAGE_SIZE // 2**20} MiB" in PAGE


def test_the_table_of_keys_is_how_keys_are_spelled() -> None:
    keys = Keys("SYSTEM")
    spelled = {
        keys.topic("TOPIC"),
        keys.alive("NAME", "INCARNATION"),
        keys.status("NAME"),
        keys.standby("NAME"),
        keys.standby("NAME", "INCARNATION"),
        keys.checkpoint("NAME"),
        keys.qualities("NAME"),
        keys.control("NAME", 0, "VERB").replace("/0/", "/INCARNATION/"),
        keys.request("SERVICE"),
        keys.reply("SERVICE", "CLIENT"),
        *(keys.host("NAME", verb) for verb in ("alive", "status", "VERB")),
        keys.quality("QR"),
        keys.diagnostics,
        keys.event,
        keys.clock("PART"),
    }
    assert {row[0].strip("`") for row in rows("key expression", "kind", "what")} == spelled


def test_the_table_of_the_lifecycle_is_the_lifecycle() -> None:
    told = {
        (State(start), Transition(name)): (State(way), State(end))
        for start, name, way, end in rows("from", "transition", "on the way", "to")
    }
    assert told == TRANSITIONS


def test_the_page_explains_every_code_verb_step_and_answer() -> None:
    assert {row[0].strip("`") for row in rows("code", "meaning")} == {code.value for code in ControlCode}
    control, hosts = PAGE.split("### Hosts")
    heads = "| verb | payload | reply |"
    verbs = re.findall(r"^\| `(\w+)` \|", control.split(heads)[1].split("\n\n")[0], re.MULTILINE)
    assert tuple(verbs) == CONTROL_VERBS
    of_hosts = {row[0].strip("`") for row in rows("verb", "payload", "reply", "what")}
    asked = {"view", "runs", "specs", "journal", "describe", "estimate", "start", "stop", "succeed", "speak", "logs"}
    assert of_hosts == asked | {"usage", "inject", "bring_back"}
    assert hosts
    steps = {row[0].strip("`") for row in rows("step", "of", "do", "detail")}
    assert steps == {step.value for step in RewireStep} - {"read"}
    handovers = {row[0].strip("`") for row in rows("handover", "of", "do")}
    assert handovers == {step.value for step in HandoverStep}
    assert {row[0].strip("`") for row in rows("verb", "number", "the service")} == {verb.value for verb in Verb}
    assert {row[0].strip("`") for row in rows("kind", "do")} == {kind.value for kind in StepKind}
    assert all(f"`{answer.value}`" in PAGE for answer in Answer)
    codes = {row[0].strip("`"): int(row[2]) for row in rows("code", "means", "REST")}
    assert codes == {code.value: KINDS[code].status for code in RefusalCode}


def test_the_lines_of_the_types_are_the_types() -> None:
    told = re.findall(r"^- `(regraft/\w+)@\d+`.*$", PAGE, re.MULTILINE)
    lines = [line for line in PAGE.splitlines() if line.startswith("- `regraft/")]
    right = [line_of(type_named(name)) for name in told]
    assert lines == right, "docs/protocol.md, section 13, should read:\n" + "\n".join(right)
    assert f"`State` is `{members_of(State)}`." in " ".join(PAGE.split())


def test_every_type_that_the_page_speaks_of_has_a_line_or_a_dump() -> None:
    spoken_of = set(re.findall(r"`(regraft/\w+)`", PAGE))
    told = set(re.findall(r"^- `(regraft/\w+)@", PAGE, re.MULTILINE)) | {what for what, _, _ in DUMPS}
    assert spoken_of - told <= {"regraft/Architecture"}
    assert all(type_named(name) for name in spoken_of)


def test_the_fields_of_the_assignment_that_the_page_explains_exist() -> None:
    table = rows("field", "meaning")
    named = set(re.findall(r"`(\w+)`", " ".join(row[0] for row in table)))
    assert named <= type_named("regraft/Assignment").shape.names | {"checkpoint_file"}
    assert f"`{forked.ASSIGNMENT_VARIABLE}` holds" in PAGE


def test_the_times_are_those_of_the_code() -> None:
    told = [float(seconds) for _, seconds in rows("what", "seconds")]
    assert told == [
        Assignment.__dataclass_fields__["heartbeat"].default,
        stream.HOLE_TIMEOUT / 1e9,
        status_reporter.REPEAT_INTERVAL,
        pending.AWAIT_AT_MOST / 1e9,
        request_protocol.ASK_INTERVAL / 1e9,
        hang_detection.HUNG_TIMEOUT,
        supervisor.FIRST_BEAT_TIMEOUT,
        member.JOIN_INTERVAL,
        member.IDLE_JOIN_TIMEOUT,
        member.SLOT_REQUEST_INTERVAL,
        member.INPUTS_TIMEOUT,
        step_dispatch.STEP_INTERVAL,
        step_dispatch.STEP_BOUND,
        successor.PREPARE_TIMEOUT,
        incumbent.CATCH_UP / 1e9,
        incumbent.DRAIN,
        successor.PULL_TIMEOUT,
        successor.TAKE_OVER_TIMEOUT,
    ]
    assert f"heartbeat stays away for {hang_detection.HUNG_TIMEOUT} s" in PAGE
    assert (
        f"the last {request_server.REMEMBERED_REPLIES} replies of each of {request_server.MAX_CLIENTS} clients" in PAGE
    )
    assert f"Of the {request_server.REMEMBERED_NUMBERS} numbers before these" in PAGE
    assert f"A client that {request_server.MAX_CLIENTS} others have followed is forgotten" in PAGE
    assert f"has failed after {request_protocol.MAX_UNANSWERED} repetitions" in PAGE
    assert f"With {request_server.MAX_REQUESTS:,} requests under way" in PAGE
