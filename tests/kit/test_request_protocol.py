"""Promises of a client's requests, for replies in any order; without time and without a bus."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft import CallFailed
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadKey, BadMessage
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.request_protocol import ASK_INTERVAL, MAX_UNANSWERED, PendingRequest, RequestProtocol, reader
from tests.kit.parts import Number

ENDS = (Answer.RESULT, Answer.CANCELLED, Answer.REFUSED, Answer.FAILED)
PATIENCE = 3.0


class Asking(RequestProtocol):
    """Keeps what is sent instead of sending it."""

    def __init__(self) -> None:
        super().__init__("asker-1")
        self.sent: list[Request] = []
        self.broken: Exception | None = None

    def send(self, pending: PendingRequest, request: Request) -> None:
        if self.broken is not None:
            raise self.broken
        self.sent.append(request)

    def call(self, value: int = 1) -> PendingRequest:
        return self.begin(Verb.CALL, "double", {"value": value}, PATIENCE, 0, reader(Number))

    def goal(self, heard: list[Number] | None = None, *, outlives: bool = False) -> PendingRequest:
        on_feedback = heard.append if heard is not None else None
        return self.begin(
            Verb.GOAL, "walk", {"value": 3}, PATIENCE, 0, reader(Number), reader(Number), on_feedback, outlives=outlives
        )

    def reply(self, pending: PendingRequest, answer: Answer, body: Any = None, now: int = 0) -> str | None:
        return self.take(codec.encode(Reply(pending.request.number, answer, body)), now)


def number(value: int) -> dict[str, Any]:
    return {"value": value, "share": 0.0}


@dataclass
class Model:
    """Return the end that a goal should have, by the simplest rules."""

    accepted: bool = False
    end: Answer | None = None
    value: int | None = None
    feedback: list[int] = field(default_factory=list)

    def take(self, answer: Answer, value: int) -> None:
        if self.end is not None:
            return
        if answer is Answer.ACCEPTED:
            self.accepted = True
        elif answer is Answer.FEEDBACK:
            self.feedback.append(value)
        else:
            self.end = answer
            self.value = value if answer is Answer.RESULT else None


replies = st.lists(st.tuples(st.sampled_from(Answer), st.integers(0, 9)), max_size=12)


@given(replies)
def test_a_goal_takes_replies_in_any_order_and_ends_once(told: list[tuple[Answer, int]]) -> None:
    requests, heard, model = Asking(), list[Number](), Model()
    ends: list[None] = []
    goal = requests.goal(heard)
    goal.outcome.when_done(lambda: ends.append(None))
    for answer, value in told:
        assert requests.reply(goal, answer, number(value)) is None
        model.take(answer, value)
    assert goal.accepted.done is model.accepted
    assert [message.value for message in heard] == model.feedback
    assert goal.feedback == (heard[-1] if heard else None)
    assert goal.outcome.done is (model.end is not None)
    assert len(ends) == (model.end is not None)
    assert requests.under_way() == ([] if model.end else [goal])
    if model.end is Answer.RESULT:
        assert goal.outcome.value == Number(model.value or 0)
    elif model.end is not None:
        assert isinstance(goal.outcome.error, CallFailed)
        assert goal.outcome.error.answer is model.end


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(-1, 9)), max_size=30))
def test_every_request_gets_the_replies_of_its_own_number(told: list[tuple[int, int]]) -> None:
    requests = Asking()
    calls = [requests.call(value) for value in range(4)]
    first: dict[int, int] = {}
    for which, value in told:
        body = number(value) if value >= 0 else {"value": "none"}
        problem = requests.reply(calls[which], Answer.RESULT, body)
        assert (problem is not None) is (value < 0 and which not in first)
        first.setdefault(which, value)
    for which, pending in enumerate(calls):
        assert pending.outcome.done is (which in first)
        if which in first and first[which] >= 0:
            assert pending.outcome.value == Number(first[which])
        elif which in first:
            assert isinstance(pending.outcome.error, CallFailed)
            assert pending.outcome.error.answer is Answer.FAILED
    assert requests.under_way() == [pending for pending in calls if not pending.outcome.done]


moments = st.lists(
    st.tuples(st.integers(0, 2 * ASK_INTERVAL), st.sampled_from([None, Answer.ACCEPTED, Answer.FEEDBACK])), max_size=20
)


@given(moments)
def test_a_goal_is_asked_for_again_after_a_second_of_silence_and_not_earlier(
    told: list[tuple[int, Answer | None]],
) -> None:
    requests, now, heard_at, accepted = Asking(), 0, 0, False
    goal = requests.goal()
    expected = [Verb.GOAL]
    for passes, answer in told:
        now += passes
        if answer is None:
            if now - heard_at >= ASK_INTERVAL:
                expected.append(Verb.RESULT if accepted else Verb.GOAL)
                heard_at = now
            requests.repeat_if_silent(goal, now)
        else:
            requests.reply(goal, answer, number(1), now)
            heard_at, accepted = now, accepted or answer is Answer.ACCEPTED
    assert [request.verb for request in requests.sent] == expected
    assert {request.number for request in requests.sent} == {goal.request.number}
    assert all((request.body is None) is (request.verb is Verb.RESULT) for request in requests.sent)


def test_an_accepted_goal_fails_and_is_cancelled_when_nobody_answers_for_its_result() -> None:
    requests = Asking()
    goal = requests.goal()
    requests.reply(goal, Answer.ACCEPTED)
    for second in range(1, MAX_UNANSWERED + 1):
        requests.repeat_if_silent(goal, second * ASK_INTERVAL)
        assert not goal.outcome.done
    requests.repeat_if_silent(goal, (MAX_UNANSWERED + 1) * ASK_INTERVAL)
    assert isinstance(goal.outcome.error, CallFailed)
    assert goal.outcome.error.answer is Answer.ACCEPTED
    assert [request.verb for request in requests.sent[1:]] == [Verb.RESULT] * MAX_UNANSWERED + [Verb.CANCEL]
    assert requests.under_way() == []


def test_a_goal_whose_server_answers_now_and_then_is_waited_for() -> None:
    requests = Asking()
    goal = requests.goal()
    for second in range(10 * MAX_UNANSWERED):
        if second % MAX_UNANSWERED == 0:
            requests.reply(goal, Answer.ACCEPTED, now=second * ASK_INTERVAL)
        requests.repeat_if_silent(goal, second * ASK_INTERVAL)
    assert not goal.outcome.done


def test_a_goal_is_waited_for_while_somebody_offers_its_service() -> None:
    requests = Asking()
    goal = requests.goal()
    requests.reply(goal, Answer.ACCEPTED)
    for second in range(10 * MAX_UNANSWERED):
        requests.repeat_if_silent(goal, second * ASK_INTERVAL, offered=True)
    assert not goal.outcome.done


def test_a_machine_that_has_slept_gives_up_no_goal_for_that() -> None:
    requests = Asking()
    goal = requests.goal()
    requests.reply(goal, Answer.ACCEPTED)
    requests.repeat_if_silent(goal, 3600 * ASK_INTERVAL)
    assert not goal.outcome.done
    assert requests.sent[-1].verb is Verb.RESULT


@given(st.lists(st.booleans(), max_size=12))
def test_a_service_that_is_offered_again_is_asked_again_at_once(looks: list[bool]) -> None:
    requests = Asking()
    call = requests.call()
    for offered in looks:
        requests.repeat_if_silent(call, 0, offered=offered)
    came_back = sum(now and not before for before, now in zip([True, *looks], looks, strict=False))
    assert [request.verb for request in requests.sent] == [Verb.CALL] * (1 + came_back)


def test_numbers_rise_from_one_over_all_services() -> None:
    requests = Asking()
    pending = [requests.call(), requests.goal(), requests.call()]
    assert [request.number for request in requests.sent] == [1, 2, 3]
    assert requests.asked == 3
    assert requests.under_way() == pending


def test_only_goals_are_accepted() -> None:
    requests = Asking()
    call = requests.call()
    requests.reply(call, Answer.ACCEPTED)
    assert not call.accepted.done
    requests.repeat_if_silent(call, ASK_INTERVAL)
    assert [request.verb for request in requests.sent] == [Verb.CALL, Verb.CALL]


def test_a_refusal_keeps_its_code_its_field_and_when_to_come_again() -> None:
    requests = Asking()
    call = requests.call()
    refusal = Reply(1, Answer.REFUSED, None, "too often", 2.0, RefusalCode.THROTTLED, "value")
    assert requests.take(codec.encode(refusal), 0) is None
    error = call.outcome.error
    assert isinstance(error, CallFailed)
    assert (error.problem, error.retry_after, error.code, error.field) == (
        "too often",
        2.0,
        RefusalCode.THROTTLED,
        "value",
    )


@given(st.binary(max_size=40))
def test_nonsense_is_said_to_be_nonsense_and_changes_nothing(payload: bytes) -> None:
    requests = Asking()
    call = requests.call()
    problem = requests.take(payload, 5)
    assert problem
    assert not call.outcome.done
    assert call.heard_at == 0


@pytest.mark.parametrize(
    ("answer", "sent"), [(Answer.RESULT, [Verb.GOAL]), (Answer.FEEDBACK, [Verb.GOAL, Verb.CANCEL])]
)
def test_a_reply_that_does_not_fit_ends_its_request_everywhere(answer: Answer, sent: list[Verb]) -> None:
    requests = Asking()
    goal = requests.goal([])
    requests.reply(goal, Answer.ACCEPTED)
    problem = requests.reply(goal, answer, {"value": "three"})
    assert problem is not None
    assert isinstance(goal.outcome.error, CallFailed)
    assert goal.outcome.error.answer is Answer.FAILED
    assert problem in goal.outcome.error.why
    assert [request.verb for request in requests.sent] == sent


def test_a_goal_continues_whose_client_makes_a_mistake_with_feedback_that_fits() -> None:
    def mistaken(_: Number) -> None:
        raise BadMessage("of the client's own")

    requests = Asking()
    goal = requests.begin(Verb.GOAL, "walk", None, PATIENCE, 0, reader(Number), reader(Number), mistaken)
    with pytest.raises(BadMessage, match="own"):
        requests.reply(goal, Answer.FEEDBACK, number(1))
    assert requests.under_way() == [goal]
    requests.reply(goal, Answer.RESULT, number(2))
    assert goal.outcome.value == Number(2)


def test_feedback_that_nobody_reads_is_ignored_whatever_it_is() -> None:
    requests = Asking()
    goal = requests.begin(Verb.GOAL, "walk", None, PATIENCE, 0, reader(Number))
    assert requests.reply(goal, Answer.FEEDBACK, "nonsense") is None
    assert not goal.outcome.done


@pytest.mark.parametrize(
    ("offered", "why"), [(True, "no answer within 3 s"), (False, "nobody offers this service (waited 3 s)")]
)
def test_a_request_that_is_given_up_says_why_and_ignores_what_comes_late(offered: bool, why: str) -> None:
    requests = Asking()
    call = requests.call()
    requests.give_up(call, offered=offered)
    requests.reply(call, Answer.RESULT, number(2))
    assert isinstance(call.outcome.error, CallFailed)
    assert (call.outcome.error.why, call.outcome.error.answer) == (why, None)


def test_a_goal_that_is_given_up_is_cancelled_and_a_call_is_not() -> None:
    requests = Asking()
    for asked in (requests.call(), requests.goal()):
        requests.give_up(asked, offered=True)
    assert [request.verb for request in requests.sent] == [Verb.CALL, Verb.GOAL, Verb.CANCEL]
    assert requests.sent[2].number == requests.sent[1].number


@pytest.mark.parametrize("accepted", [False, True])
def test_a_goal_that_is_cancelled_ends_at_once_only_if_nobody_has_accepted_it(accepted: bool) -> None:
    requests = Asking()
    goal = requests.goal()
    if accepted:
        requests.reply(goal, Answer.ACCEPTED)
    requests.cancel(goal)
    assert goal.outcome.done is not accepted
    requests.reply(goal, Answer.CANCELLED)
    requests.cancel(goal)
    assert [request.verb for request in requests.sent] == [Verb.GOAL, Verb.CANCEL]
    assert isinstance(goal.outcome.error, CallFailed)
    assert goal.outcome.error.answer is Answer.CANCELLED


@pytest.mark.parametrize("answer", ENDS)
def test_a_goal_that_has_ended_is_not_cancelled(answer: Answer) -> None:
    requests = Asking()
    goal = requests.goal()
    requests.reply(goal, answer, number(1))
    requests.cancel(goal)
    assert len(requests.sent) == 1


def test_a_request_that_cannot_be_sent_is_not_under_way() -> None:
    requests = Asking()
    requests.broken = OSError("no link")
    with pytest.raises(OSError, match="no link"):
        requests.call()
    with pytest.raises(BadKey):
        requests.begin(Verb.CALL, "**", None, PATIENCE, 0, reader(Number))
    assert requests.under_way() == []


def test_a_client_that_is_closed_ends_all_and_begins_nothing() -> None:
    requests = Asking()
    goal = requests.goal()
    requests.close()
    assert isinstance(goal.outcome.error, CallFailed)
    with pytest.raises(CallFailed, match="closed"):
        requests.call()
    assert len(requests.sent) == 1


def test_requests_from_many_threads_have_numbers_of_their_own_and_end_once() -> None:
    requests = Asking()
    ends: list[int] = []

    def ask() -> None:
        for _ in range(25):
            call = requests.call()
            call.outcome.when_done(lambda: ends.append(1))
            late = threading.Thread(target=requests.give_up, args=(call,), kwargs={"offered": True})
            late.start()
            requests.reply(call, Answer.RESULT, number(1))
            late.join()

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(request.number for request in requests.sent) == list(range(1, 101))
    assert len(ends) == 100
    assert requests.under_way() == []
