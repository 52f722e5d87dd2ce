"""Commands that show messages keep no more of them than they promise, however slowly they are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import pytest

from regraft.cli.bus.gaps import with_gaps_told
from regraft.cli.bus.sampling import MAX_WAITING, samples
from regraft.client import Subscription, TopicSample


def test_messages_behind_a_slow_reader_are_bounded_and_the_others_counted(capsys: pytest.CaptureFixture[str]) -> None:
    def subscribe(take: Callable[[TopicSample], object]) -> Subscription:
        for number in range(MAX_WAITING + 200):
            take(cast("Any", number))
        return Subscription("numbers", None, take)

    assert len(list(samples(subscribe, None, 0.05, lambda: None))) == MAX_WAITING
    assert "200 messages came too fast and were not shown" in capsys.readouterr().err


def test_what_is_missing_is_printed_before_the_message_that_comes_after_it(capsys: pytest.CaptureFixture[str]) -> None:
    told = [
        (1, 5, ""),
        (1, 7, "s: 1 message is missing before number 7"),
        (2, 90, ""),
        (1, 8, ""),
        (2, 100, "s: 9 messages are missing before number 100"),
    ]
    samples = [TopicSample("t", "a/B", "s", run, number, 0, 1, {}) for run, number, _ in told]
    coming = with_gaps_told(samples)
    for sample, (_, _, line) in zip(samples, told, strict=True):
        assert next(coming) is sample
        assert capsys.readouterr().err == (f"regraft: {line}\n" if line else "")
