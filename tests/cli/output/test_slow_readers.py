"""Commands that show messages keep no more of them than they promise, however slowly they are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import pytest

from regraft.cli.bus import sampling
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


@pytest.mark.parametrize("end", [KeyboardInterrupt, BrokenPipeError])
def test_messages_that_did_not_fit_are_counted_whatever_ends_the_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, end: type[BaseException]
) -> None:
    monkeypatch.setattr(sampling, "LOOK_INTERVAL", 0.01)
    looks = 0

    def check() -> None:
        nonlocal looks
        looks += 1
        assert "was no message: how" in capsys.readouterr().err or looks > 1, "the first one is reported meanwhile"
        if looks > 3:
            raise end

    with pytest.raises(end):
        list(samples(_refusing, None, None, check))
    assert "7 messages did not fit, the last one: was no message: how" in capsys.readouterr().err


def _refusing(take: Callable[[TopicSample], object]) -> Subscription:
    subscription = Subscription("numbers", None, take)
    subscription.refused, subscription.last_problem = 7, "was no message: how"
    return subscription


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
