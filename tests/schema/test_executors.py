"""Promises about finding the executor of a mission: by robot, by component, or as the only one."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.robots.executors import MissionExecutor, NoSuchExecutor, WhichExecutor, executor_of

LEFT, RIGHT = MissionExecutor("left.bt_executor", "left"), MissionExecutor("right.bt_executor", "right")
SHARED = MissionExecutor("watch")
SPARE = MissionExecutor("left.spare", "left")


@pytest.mark.parametrize(
    ("known", "name", "found"),
    [
        ([], "", None),
        ([SHARED], "", SHARED),
        ([LEFT], "", LEFT),
        ([LEFT, RIGHT], "left", LEFT),
        ([LEFT, RIGHT], "right.bt_executor", RIGHT),
        ([LEFT, RIGHT, SHARED], "watch", SHARED),
        ([LEFT, SPARE], "left.spare", SPARE),
    ],
)
def test_an_executor_is_found_by_robot_or_component_or_as_the_only_one(
    known: list[MissionExecutor], name: str, found: MissionExecutor | None
) -> None:
    assert executor_of(known, name) is found


@pytest.mark.parametrize(
    ("known", "name", "error", "text"),
    [
        ([LEFT, RIGHT], "", WhichExecutor, "several robots run missions: left, right: name one of them"),
        ([LEFT, RIGHT, SHARED], "", WhichExecutor, "left, right, watch"),
        ([LEFT, SPARE], "left", WhichExecutor, "'left' run missions: left.bt_executor, left.spare"),
        ([LEFT, RIGHT], "rigth", NoSuchExecutor, "did you mean 'right'"),
        ([], "left", NoSuchExecutor, "there are none"),
    ],
)
def test_what_is_not_there_or_not_clear_is_refused_with_the_names(
    known: list[MissionExecutor], name: str, error: type[ValueError], text: str
) -> None:
    with pytest.raises(error, match=text):
        executor_of(known, name)
