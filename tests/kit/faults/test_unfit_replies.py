"""Every request is answered: also one whose refusal, failure or result does not fit its message."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from regraft import CallFailed, Component, RefusalCode, RequestRefused, action, service
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.testing import Rig
from tests.kit.parts import Number, Other, Speechless

SURROGATE = "no file caf\udce9"
"""A file name that is not UTF-8, as Python reads it from the system."""

UNFIT: list[Any] = [
    RequestRefused("later", retry_after=-1.0),
    RequestRefused("later", retry_after=math.inf),
    RequestRefused("later", retry_after=math.nan),
    RequestRefused("later", retry_after="1 s"),  # type: ignore[arg-type]
    RequestRefused("later", "busy"),  # type: ignore[arg-type]
    RequestRefused("later", field=SURROGATE),
    RequestRefused("later", field=("goal", "frame")),  # type: ignore[arg-type]
]
"""Refusals that fit no reply."""


class Refuser(Component):
    """Refuses as a test has it."""

    def __init__(self) -> None:
        self.error: BaseException | None = None

    @service("ask")
    def ask(self, number: Number) -> Number:
        return self._refuse(number)

    @service("ask_later")
    async def ask_later(self, number: Number) -> Number:
        await self.kit.sleep(0.5)
        return self._refuse(number)

    @action("pursue")
    async def pursue(self, number: Number) -> Number:
        await self.kit.sleep(0.5)
        return self._refuse(number)

    def _refuse(self, number: Number) -> Number:
        if self.error is not None:
            raise self.error
        return number


@pytest.mark.parametrize("which", ["ask", "ask_later"])
@pytest.mark.parametrize("error", UNFIT, ids=repr)
def test_a_refusal_that_fits_no_reply_is_a_failed_call(which: str, error: RequestRefused) -> None:
    with Rig() as rig:
        rig.add(Refuser).error = error
        with pytest.raises(CallFailed, match=r"RequestRefused: .*later") as failed:
            rig.call(which, Number(1), Number)
        assert failed.value.answer is Answer.FAILED
        assert rig.clock.now() / 1e9 < 1.0
        (fault,) = rig.take_faults()
        assert "BadMessage" in fault


@pytest.mark.parametrize("error", UNFIT, ids=repr)
def test_a_goal_ends_whose_refusal_fits_no_reply(error: RequestRefused) -> None:
    with Rig() as rig:
        refuser = rig.add(Refuser)
        refuser.error = error
        goal = rig.goal("pursue", Number(1), Number, Number)
        rig.advance(1.0)
        assert goal.error is not None
        assert goal.error.answer is Answer.FAILED
        refuser.error = None
        following = rig.goal("pursue", Number(2), Number, Number)
        rig.advance(1.0)
        assert following.result == Number(2)
        assert len(rig.take_faults()) == 1


class Archive(Component):
    """Gives a text that is as long as it is asked for."""

    @service("fetch")
    def fetch(self, number: Number) -> Other:
        return Other("x" * number.value)


def test_a_reply_that_is_too_large_is_a_failed_call_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codec, "MAX_MESSAGE_SIZE", 10_000)
    with Rig() as rig:
        rig.add(Archive)
        with pytest.raises(CallFailed, match="at most 10000") as failed:
            rig.call("fetch", Number(20_000), Other)
        assert failed.value.answer is Answer.FAILED
        assert rig.clock.now() / 1e9 < 1.0
        assert rig.call("fetch", Number(1_000), Other) == Other("x" * 1_000)
        assert len(rig.take_faults()) == 1


@pytest.mark.parametrize("which", ["ask", "ask_later"])
def test_a_refusal_with_any_text_keeps_its_code(which: str) -> None:
    with Rig() as rig:
        rig.add(Refuser).error = RequestRefused(SURROGATE, RefusalCode.NOT_FOUND, field="path")
        with pytest.raises(CallFailed, match=r"path: no file caf\\udce9") as refused:
            rig.call(which, Number(1), Number)
        assert (refused.value.answer, refused.value.code) == (Answer.REFUSED, RefusalCode.NOT_FOUND)


RAISED = [(ValueError(SURROGATE), r"ValueError: no file caf\\udce9"), (Speechless(), "Speechless")]


@pytest.mark.parametrize("which", ["ask", "ask_later"])
@pytest.mark.parametrize(("error", "told"), RAISED)
def test_an_exception_with_any_text_is_a_failed_call(which: str, error: Exception, told: str) -> None:
    with Rig() as rig:
        rig.add(Refuser).error = error
        with pytest.raises(CallFailed, match=told) as failed:
            rig.call(which, Number(1), Number)
        assert failed.value.answer is Answer.FAILED
        assert len(rig.take_faults()) == 1


@pytest.mark.parametrize(("error", "told"), RAISED)
def test_a_goal_that_raises_with_any_text_ends(error: Exception, told: str) -> None:
    with Rig() as rig:
        rig.add(Refuser).error = error
        goal = rig.goal("pursue", Number(1), Number, Number)
        rig.advance(1.0)
        assert goal.error is not None
        assert goal.error.answer is Answer.FAILED
        assert re.search(told, goal.error.why)
        assert len(rig.take_faults()) == 1


class Muddler(Component):
    """Gives feedback of another type than it declares."""

    @action("muddle", feedback=Number)
    async def muddle(self, number: Number) -> Number:
        await self.kit.sleep(0.5)
        self.kit.feedback(Other("half-way"))
        return number

    @action("whisper")
    async def whisper(self, number: Number) -> Number:
        await self.kit.sleep(0.5)
        self.kit.feedback(number)
        return number


@pytest.mark.parametrize(("which", "told"), [("muddle", "Other .*Number"), ("whisper", "Number .*nothing")])
def test_feedback_of_an_undeclared_type_is_a_fault_of_its_action(which: str, told: str) -> None:
    with Rig() as rig:
        rig.add(Muddler)
        goal = rig.goal(which, Number(1), Number, Number)
        rig.advance(1.0)
        assert goal.error is not None
        assert goal.error.answer is Answer.FAILED
        assert goal.feedback is None
        (fault,) = rig.take_faults()
        assert re.search(f"TypeError: gives {told}", fault)
        assert "TypeError" in goal.error.why
