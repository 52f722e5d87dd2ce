"""Names are checked, keys are well formed for Zenoh, and matching agrees with Zenoh's."""

from __future__ import annotations

import re

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.keys import (
    CONTROL_VERBS,
    Keys,
    client_name,
    component_name,
    matches,
    system_name,
    topic_name,
)

word = st.from_regex(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,63}", fullmatch=True)
component = word | st.tuples(word, word).map(".".join)
topic = st.tuples(component, st.lists(word, max_size=7)).map(lambda parts: "/".join((parts[0], *parts[1])))
client = st.from_regex(r"[A-Za-z0-9_.-]{1,160}", fullmatch=True)

chunk = st.sampled_from(["a", "b", "ab", "1"])
key = st.lists(chunk, min_size=1, max_size=5).map("/".join)
expression = (
    st.lists(chunk | st.sampled_from(["*", "**"]), min_size=1, max_size=5)
    .map("/".join)
    .map(lambda text: str(zenoh.KeyExpr.autocanonize(text)))
)


@given(word, component, topic, client)
def test_well_formed_names_are_returned_as_they_are(system: str, part: str, place: str, asker: str) -> None:
    assert system_name(system) == system
    assert component_name(part) == part
    assert topic_name(place) == place
    assert client_name(asker) == asker


@pytest.mark.parametrize("check", [system_name, component_name, topic_name, client_name])
@pytest.mark.parametrize(
    "name", ["", "a b", "/a", "a/", "a//b", "*", "**", "a/*", "a$", "@a", "a#b", "a?b", "é", "a\n"]
)
def test_names_that_no_key_can_hold_are_refused(check: object, name: str) -> None:
    assert callable(check)
    with pytest.raises(BadKey, match=re.escape(repr(name))):
        check(name)


@pytest.mark.parametrize("name", ["-a", ".a", "a.", "a.b.c", "a/b", "x" * 65, None, 3])
def test_names_that_no_component_can_have_are_refused(name: str) -> None:
    with pytest.raises(BadKey, match=r"robot\.word"):
        component_name(name)


def test_a_topic_has_at_most_eight_words() -> None:
    assert topic_name("/".join("abcdefgh"))
    with pytest.raises(BadKey):
        topic_name("/".join("abcdefghi"))


@given(word, component, topic, client, st.integers(0, 2**32 - 1))
def test_every_key_is_a_key_expression_without_wildcards(
    system: str, part: str, place: str, asker: str, incarnation: int
) -> None:
    keys = Keys(system)
    spelled = [
        keys.topic(place),
        keys.alive(part, incarnation),
        keys.status(part),
        keys.checkpoint(part),
        *(keys.control(part, incarnation, verb) for verb in CONTROL_VERBS),
        keys.request(place),
        keys.reply(place, asker),
        keys.host(part, "status"),
        keys.quality(part),
        keys.diagnostics,
        keys.event,
        keys.clock(f"step/{part}"),
    ]
    for text in spelled:
        assert str(zenoh.KeyExpr(text)) == text
        assert "*" not in text
    assert len(set(spelled)) == len(spelled)


@given(word, topic)
def test_the_topic_of_a_topics_key_is_that_topic(system: str, place: str) -> None:
    keys = Keys(system)
    assert keys.topic_of(keys.topic(place)) == place
    assert keys.topic_of(keys.event) is None


@given(expression, key)
def test_an_expression_matches_the_keys_that_it_matches_in_zenoh(pattern: str, text: str) -> None:
    ours, theirs = zenoh.KeyExpr(pattern), zenoh.KeyExpr(text)
    assert matches(pattern, text) == ours.intersects(theirs) == ours.includes(theirs)


@given(component, topic, client)
def test_the_wildcards_of_the_kit_match_what_they_are_for(part: str, place: str, asker: str) -> None:
    keys = Keys("robots")
    assert matches(keys.reply("**", asker), keys.reply(place, asker))
    assert matches(keys.status("*"), keys.status(part))
    assert matches(keys.alive("*", "*"), keys.alive(part, 7))
    assert matches(keys.control(part, 7, "*"), keys.control(part, 7, "describe"))
    assert not matches(keys.control(part, 7, "*"), keys.control(part, 8, "describe"))
    assert not matches(keys.status("*"), keys.checkpoint(part))
