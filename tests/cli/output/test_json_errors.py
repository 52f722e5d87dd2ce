"""With ``--json`` an error is an object, and its code is the same whatever its text says."""

from __future__ import annotations

import json
from typing import Any

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.cli.group import as_document, exit_code
from regraft.cli.outcomes import BAD_INPUT, FAILED, NOT_REACHABLE, Failed, Unreachable
from regraft.client import ControlRefused, NoSuchComponent
from tests.cli import live
from tests.cli.conftest import Regraft
from tests.cli.live import System

QUEUE_FULL = CallFailed("adapt", Answer.REFUSED, "later", code=RefusalCode.QUEUE_FULL, retry_after=0.8)
ERRORS: list[tuple[Exception, int, dict[str, Any]]] = [
    (QUEUE_FULL, FAILED, {"code": "queue_full", "retry_after": 0.8}),
    (
        CallFailed("a", Answer.REFUSED, "b", code=RefusalCode.INVALID, field="tree"),
        2,
        {"code": "invalid", "field": "tree"},
    ),
    (CallFailed("a", Answer.FAILED, "b"), FAILED, {"code": "failed"}),
    (CallFailed("a", Answer.CANCELLED, "b"), FAILED, {"code": "cancelled"}),
    (CallFailed("a", None, "b"), FAILED, {"code": "no_answer"}),
    (ControlRefused("a", ControlError(ControlCode.FENCED, ("b",))), FAILED, {"code": "fenced"}),
    (NoSuchComponent("a"), BAD_INPUT, {"code": "bad_input"}),
    (Unreachable("a"), NOT_REACHABLE, {"code": "not_reachable"}),
    (Failed("a"), FAILED, {"code": "failed"}),
]


@pytest.mark.parametrize(("error", "code", "expected"), ERRORS, ids=[repr(error) for error, _, _ in ERRORS])
def test_an_error_has_a_code(error: Exception, code: int, expected: dict[str, Any]) -> None:
    assert exit_code(error) == code
    assert as_document(error, code) == {"error": str(error), "exit_code": code, **expected}


def test_a_command_prints_its_error_as_an_object(regraft: Regraft) -> None:
    found = regraft("ps", "--system", "ghost", "--json")
    assert (found.exit_code, found.stdout) == (NOT_REACHABLE, "")
    assert json.loads(found.stderr)["code"] == "not_reachable"
    assert regraft("ps", "--system", "ghost").stderr.startswith("regraft: ")


@pytest.mark.parametrize("words", [("--json", "show", "1"), ("--json", "diff", "0", "1")], ids=" ".join)
def test_a_group_takes_the_option_for_its_commands(regraft: Regraft, words: tuple[str, ...]) -> None:
    found = regraft("journal", *words)
    assert (found.exit_code, json.loads(found.stderr)["code"]) == (NOT_REACHABLE, "not_reachable")


def test_a_value_that_looks_like_the_option_asks_for_no_json(regraft: Regraft) -> None:
    assert regraft("undo", "1", "--reason", "--json").stderr.startswith("regraft: ")


MISTYPED = [
    (("journal", "--limit", "0", "--json"), "'--limit'"),
    (("ps", "--json", "--sytem", "frog"), "--sytem"),
    (("param", "get", "battery", "--json"), "PARAMETER"),
    (("lifecycle", "set", "battery", "activat", "--json"), "did you mean 'activate'?"),
    (("--sytem", "frog", "ps", "--json"), "--sytem"),
    (("param", "lst", "--json"), "'lst'"),
    (("mission", "show", "--json", "frog"), "frog"),
    (("journal", "show", "--json"), "ID"),
    (("journal", "shw", "--json"), "'shw'"),
    (("journal", "--limit", "5", "show", "1", "--json"), "--limit"),
]
"""Mistakes that are found while words are read, some before the option ``--json`` is."""


@pytest.mark.parametrize(("words", "named"), MISTYPED, ids=[" ".join(words) for words, _ in MISTYPED])
def test_a_mistake_in_options_is_an_object_too(regraft: Regraft, words: tuple[str, ...], named: str) -> None:
    found = regraft(*words)
    assert (found.exit_code, found.stdout) == (BAD_INPUT, "")
    document = json.loads(found.stderr)
    assert (document["code"], document["exit_code"]) == ("bad_input", BAD_INPUT)
    assert named in document["error"]


@pytest.mark.parametrize(
    "words",
    [("journal", "--limit", "0"), ("--sytem", "frog", "ps"), ("topic", "info", "--", "a", "--json")],
    ids=" ".join,
)
def test_without_the_option_a_mistake_is_shown_with_the_usage(regraft: Regraft, words: tuple[str, ...]) -> None:
    found = regraft(*words)
    assert (found.exit_code, found.stdout) == (BAD_INPUT, "")
    assert found.stderr.startswith("Usage: ")
    assert "Error: " in found.stderr


def test_a_goal_without_a_result_in_time_has_a_code(tiny: System) -> None:
    found = live.regraft(tiny.home, "goal", "send", "wait_for", '{"value": 1e9}', "--timeout", "0.2", "--json")
    assert (found.returncode, json.loads(found.stderr.splitlines()[-1])["code"]) == (FAILED, "no_answer")
