"""What a refusal becomes is decided by its code: no wording changes an answer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft import RequestRefused
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from tests.gateway.conftest import Running
from tests.gateway.test_adaptations import adaptation

KINDS = {
    RefusalCode.REFUSED: (409, "refused"),
    RefusalCode.MALFORMED: (422, "malformed"),
    RefusalCode.INVALID: (422, "invalid"),
    RefusalCode.NOT_FOUND: (404, "not-found"),
    RefusalCode.CONFLICT: (409, "conflict"),
    RefusalCode.KEY_REUSED: (422, "idempotency-key-reused"),
    RefusalCode.THROTTLED: (429, "throttled"),
    RefusalCode.QUEUE_FULL: (503, "queue-full"),
    RefusalCode.BUSY: (503, "busy"),
    RefusalCode.STARTING: (503, "starting"),
    RefusalCode.NOT_ACTIVE: (503, "not-active"),
    RefusalCode.UNAVAILABLE: (503, "unavailable"),
}
WORDINGS = ("", "the queue is full", "there is no adaptation", "idempotency key 'a' was used", "task: is empty")


@pytest.fixture
def reworded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give every refusal of a service another text."""
    original = RequestRefused.__init__

    def init(self: RequestRefused, why: str = "", *others: Any, **more: Any) -> None:
        original(self, f"in other words ({len(why)})", *others, **more)

    monkeypatch.setattr(RequestRefused, "__init__", init)


@pytest.fixture
def refusing(shared: Running) -> Iterator[Running]:
    """Return the robot of the file, whose manager is to refuse during the test."""
    yield shared
    shared.manager.refusal = None


@pytest.mark.parametrize("code", [code for code in RefusalCode if code is not RefusalCode.NOT_FOUND])
def test_the_code_decides_the_answer_whatever_the_text_says(refusing: Running, code: RefusalCode) -> None:
    for words in WORDINGS:
        refusing.manager.refusal = RequestRefused(words, code)
        answer = refusing.post("/adaptations", adaptation())
        assert (answer.status_code, answer.json()["type"]) == (KINDS[code][0], f"urn:regraft:problem:{KINDS[code][1]}")
        assert answer.json()["detail"] == (words or "refused")
        assert ("retry-after" in answer.headers) is (answer.status_code == 503)


@pytest.mark.parametrize("code", [RefusalCode.THROTTLED, RefusalCode.QUEUE_FULL, RefusalCode.STARTING])
def test_a_refusal_says_when_to_come_again(refusing: Running, code: RefusalCode) -> None:
    for seconds, told in ((0.2, "1"), (1.2, "2"), (7.0, "7")):
        refusing.manager.refusal = RequestRefused("later", code, retry_after=seconds)
        assert refusing.post("/adaptations", adaptation()).headers["retry-after"] == told


def test_a_refusal_names_the_field_at_fault(refusing: Running) -> None:
    refusing.manager.refusal = RequestRefused("must be a topic", RefusalCode.MALFORMED, field="changes.0.topic")
    (violation,) = refusing.post("/adaptations", adaptation()).json()["violations"]
    assert (violation["field"], violation["problem"]) == ("changes.0.topic", "must be a topic")


@pytest.mark.usefixtures("reworded")
def test_other_words_change_no_answer(running: Running) -> None:
    def answered(method: str, path: str, body: object = None, **headers: str) -> tuple[int, str]:
        got = running.http.request(method, path, json=body, headers=headers)
        return got.status_code, got.json().get("type", "").rpartition(":")[2]

    key = {"Idempotency-Key": "one"}
    assert answered("POST", "/adaptations", adaptation(), **key) == (200, "")
    assert answered("POST", "/adaptations", adaptation(reason="another"), **key) == (422, "idempotency-key-reused")
    assert answered("POST", "/adaptations/1/confirm") == (409, "conflict")
    assert answered("DELETE", "/adaptations/1") == (409, "conflict")
    assert answered("POST", "/adaptations/99/undo") == (404, "not-found")
    assert answered("GET", "/adaptations?before=x") == (404, "not-found")
    assert answered("GET", "/architecture?revision=99") == (404, "not-found")
    assert answered("POST", "/mission/start", {}) == (409, "conflict")
    assert answered("POST", "/mission/load", {"tree": "no tree"}) == (422, "invalid")
    running.manager.unreadable = True
    assert answered("GET", "/adaptations") == (503, "unavailable")
