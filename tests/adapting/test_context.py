"""What an adaptation's request says of the moment of its decision."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import MAX_CONTEXT_SIZE, AdaptationRequest, plain_size
from tests.adapting.helpers import FakeContext, bench

SLOWER = 'rules="near : navigator.max_velocity := 0.1"'


def test_a_request_tells_the_qualities_as_they_are_the_node_and_the_rule() -> None:
    book = (
        Quality(1.0, "MoveSafely", "Safety", node="Safe", metric=0.4, satisfied=True, degree=0.9, status="safe"),
        Quality(1.0, "MoveQuickly", "MovementEfficiency", node="Quick"),
        Quality(1.0, "Over", "Power", metric=3.0, active=False),
    )
    at = bench("AdaptOnStart", SLOWER, context=FakeContext(book=book), near=1)
    at.tick()
    assert at.context.adaptations[0].context == {
        "node": "adapt",
        "rule": "near : navigator.max_velocity := 0.1",
        "qualities": {
            "MoveSafely": {"metric": 0.4, "satisfied": True, "degree": 0.9, "status": "safe"},
            "MoveQuickly": {},
        },
    }


def test_more_requirements_than_there_is_room_for_do_no_harm() -> None:
    book = tuple(Quality(0.0, f"Requirement{number}", "Safety", status="x" * 200) for number in range(1000))
    at = bench("AdaptOnStart", SLOWER, context=FakeContext(book=book), near=1)
    at.tick()
    (request,) = at.context.adaptations
    assert "Requirement0" in request.context["qualities"]
    assert plain_size(request.context, MAX_CONTEXT_SIZE) <= MAX_CONTEXT_SIZE


@given(st.integers(0, 2 * MAX_CONTEXT_SIZE))
def test_a_context_is_bounded_for_who_sends_it_and_for_who_receives_it(length: int) -> None:
    context = {"text": "x" * length}
    plain = codec.to_plain(AdaptationRequest(())) | {"context": context}
    if plain_size(context, MAX_CONTEXT_SIZE) <= MAX_CONTEXT_SIZE:
        assert AdaptationRequest((), context=context) == codec.from_plain(plain, AdaptationRequest)
        return
    with pytest.raises(BadMessage, match=r"context.*must be at most 16384"):
        AdaptationRequest((), context=context)
    with pytest.raises(BadMessage, match=r"context.*must be at most 16384"):
        codec.from_plain(plain, AdaptationRequest)
