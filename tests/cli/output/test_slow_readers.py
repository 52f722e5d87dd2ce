"""Commands that show messages keep no more of them than they promise, however slowly they are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import pytest

from regraft.cli.bus.sampling import MAX_WAITING, samples
from regraft.client import Subscription, TopicSample


def test_messages_behind_a_slow_reader_are_bounded_and_the_others_counted(capsys: pytest.CaptureFixture[str]) -> None:
    def subscribe(take: Callable[[TopicSample], object]) -> Subscription:
        for number in range(MAX_WAITING + 200):
            take(cast("Any", number))
        return Subscription("numbers", None, take)

    assert len(list(samples(subscribe, None, 0.05, lambda: None))) == MAX_WAITING
    assert "200 messages came too fast and were not shown" in capsys.readouterr().err
