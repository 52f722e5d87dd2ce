"""The source of time waits for who lives, also when a list of them is not whole."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from regraft.bus.known_runs import run_of, runs_shown
from regraft.bus_schema.keys import Keys
from regraft.lockstep.joining import gathering
from regraft.patience import Patience
from tests.support.waiting import PATIENCE

KEYS = Keys("s")


class _Lists:
    """A bus whose lists of tokens are told in turn, the last for ever."""

    def __init__(self, *lists: set[str]) -> None:
        self._lists = list(lists)
        self.asked = 0

    def present(self, key: str, timeout: float) -> list[str]:
        self.asked += 1
        names = self._lists.pop(0) if len(self._lists) > 1 else self._lists[0]
        return [KEYS.alive(name, 1) for name in names]


@pytest.fixture(autouse=True)
def _fast(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gathering, "LIST_INTERVAL", 0.001)


def _gather(bus: _Lists, joins_after: int | None) -> list[str]:
    runtime: Any = SimpleNamespace(bus=bus, keys=KEYS, assignment=SimpleNamespace(name="sim"))

    def joined() -> set[str]:
        return {"sim", "slow"} if joins_after is not None and bus.asked > joins_after else {"sim"}

    return gathering.wait_for_members(
        {"sim", "slow"}, joined, runtime, lambda: None, Patience(PATIENCE), without_sign=Patience(0.0)
    )


@pytest.mark.parametrize("first", [set(), {"sim"}, {"slow"}])
def test_a_list_of_a_session_that_just_began_gives_up_nobody(first: set[str]) -> None:
    assert _gather(_Lists(first, {"sim", "slow"}), joins_after=20) == []


def test_lists_of_a_lost_link_give_up_nobody() -> None:
    assert _gather(_Lists({"sim", "slow"}, set(), set(), set(), {"sim", "slow"}), joins_after=20) == []


def test_who_shows_no_sign_of_life_is_given_up() -> None:
    bus = _Lists({"sim"})
    assert _gather(bus, joins_after=None) == ["slow"]
    assert bus.asked >= 2


def test_tokens_with_numbers_that_no_run_has_show_nobody() -> None:
    forged = [KEYS.alive("slow", 1).removesuffix("1") + number for number in ("", "x", "\u0661", "1" * 11, "1" * 5000)]
    assert runs_shown([KEYS.alive("sim", 1), *forged]) == {"sim": {1}}
    assert [run_of(token) for token in forged] == [None] * len(forged)
