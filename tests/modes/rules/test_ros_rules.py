"""Rules of a modes file of ROS 2's system_modes: read with their lines, and refused where they lead in a circle."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import EnterMode
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.stack import StackError, load
from regraft.stack.yaml.problems import Problem
from tests.modes.in_memory import STACK as IN_MEMORY
from tests.modes.in_memory import Director, entered, perform, running
from tests.modes.stacks import STACK, write

FILE = """\
chassis:
  ros__parameters:
    type: system
    parts:
      laser
      driver
    modes:
      __DEFAULT__: {laser: active, driver: active}
      CAREFUL: {laser: inactive, driver: active.SLOW}
      BLIND: {laser: inactive, driver: active.SLOW}
    rules:
      part_in_mode:
        if_target: active.CAREFUL
        if_part: [driver, active.__DEFAULT__]
        new_target: active.BLIND
      degrade:
        if_target: active
        if_part: [laser, unconfigured]
        new_target: active.CAREFUL
      lost:
        if_target: active.__DEFAULT__
        if_part: ['laser', unknown]
        new_target: active.CAREFUL
driver:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__: {ros__parameters: {speed: 1.0}}
      SLOW: {ros__parameters: {speed: 0.3}}
"""
NAMED = STACK + "modes: modes.yaml\n"


def _stack(folder: Path, modes: str = FILE, stack: str = NAMED) -> Path:
    (folder / "modes.yaml").write_text(modes)
    return write(folder, stack)


def _problems(folder: Path, modes: str) -> tuple[Problem, ...]:
    with pytest.raises(StackError) as caught:
        load(_stack(folder, modes))
    return caught.value.problems


def test_they_become_rules_of_the_stack_in_their_order(tmp_path: Path) -> None:
    assert load(_stack(tmp_path)).architecture.mode_rules == (
        ModeRule("chassis.part_in_mode", "driver.mode == 'driver.__DEFAULT__'", "chassis.BLIND", ("chassis.CAREFUL",)),
        ModeRule("chassis.degrade", "laser.state == 'unconfigured'", "chassis.CAREFUL", ("chassis.__DEFAULT__",)),
        ModeRule("chassis.lost", "laser.state == 'gone'", "chassis.CAREFUL", ("chassis.__DEFAULT__",)),
    )


def test_a_planner_enforces_them(tmp_path: Path) -> None:
    seen = []

    async def script(director: Director) -> None:
        await director.adapt(EnterMode("chassis.__DEFAULT__"))
        await director.until(2.0)
        seen.append((await director.modes("chassis")).actual)
        await director.adapt(EnterMode("driver.__DEFAULT__"))
        await director.kit.sleep(1.0)
        seen.append((await director.modes("chassis")).actual)

    broken = IN_MEMORY.replace("failures: 0", "failures: 1, recovers_after: 1000.0")
    eager = broken.replace(":ModePlanner'", ":ModePlanner', parameters: {manual_hold: 0.0}")
    (tmp_path / "modes.yaml").write_text(FILE)
    with running(tmp_path, eager + "modes: modes.yaml\n", script) as system:
        perform(system)
        assert seen == ["chassis.CAREFUL", "chassis.BLIND"]
        assert entered(system) == [("chassis.CAREFUL", "applied"), ("chassis.BLIND", "applied")]


def test_rules_of_the_stack_come_behind_them(tmp_path: Path) -> None:
    own = "rules:\n  back: {when: laser.state == 'inactive', from: chassis.BLIND, mode: chassis.CAREFUL}\n"
    rules = load(_stack(tmp_path, stack=NAMED + own)).architecture.mode_rules
    assert [rule.name for rule in rules] == ["chassis.part_in_mode", "chassis.degrade", "chassis.lost", "back"]


def test_a_rule_of_the_stack_has_a_name_of_its_own(tmp_path: Path) -> None:
    own = "rules:\n  chassis.lost: {when: laser.failed, from: chassis.BLIND, mode: chassis.CAREFUL}\n"
    with pytest.raises(StackError) as caught:
        load(_stack(tmp_path, stack=NAMED + own))
    (found,) = caught.value.problems
    assert (found.field, Path(found.file).name) == ("rules.chassis.lost", "stack.yaml")
    assert "a file of system_modes has a rule of this name, too" in found.problem


def test_without_a_planner_they_are_read_all_the_same(tmp_path: Path) -> None:
    alone = NAMED.replace(NAMED[NAMED.index("  mode_planner:") : NAMED.index("modes: ")], "")
    assert len(load(_stack(tmp_path, stack=alone)).architecture.mode_rules) == 3


def test_a_circle_among_them_is_refused_with_the_modes_on_the_way(tmp_path: Path) -> None:
    back = """\
      return:
        if_target: active.CAREFUL
        if_part: [laser, inactive]
        new_target: active
      leave:
        if_target: active
        if_part: [laser, active]
        new_target: active.CAREFUL
"""
    modes = FILE.replace("driver:\n  ros__", f"{back}driver:\n  ros__")
    (found,) = _problems(tmp_path, modes)
    line = 1 + next(number for number, text in enumerate(modes.splitlines()) if text.strip() == "leave:")
    assert (Path(found.file).name, found.line, found.field) == ("modes.yaml", line, "rules.chassis.leave")
    assert "leads in a circle with 'chassis.return': " in found.problem
    first, second = "chassis.__DEFAULT__", "chassis.CAREFUL"
    assert f"{first} > {second} > {first}" in found.problem or f"{second} > {first} > {second}" in found.problem


def test_a_circle_with_a_rule_of_the_stack_is_refused_at_that_rule(tmp_path: Path) -> None:
    own = "rules:\n  back: {when: laser.state != 'active', from: chassis.CAREFUL, mode: chassis.__DEFAULT__}\n"
    stray = FILE.replace("if_part: [laser, unconfigured]", "if_part: [laser, active]")
    with pytest.raises(StackError) as caught:
        load(_stack(tmp_path, stray, NAMED + own))
    (found,) = caught.value.problems
    assert (found.field, Path(found.file).name) == ("rules.back", "stack.yaml")
    assert "leads in a circle with 'chassis.degrade': " in found.problem


@pytest.mark.parametrize(
    ("right", "wrong", "problem"),
    [
        ("new_target: active.BLIND", "new_target: active.BLND", "no mode 'BLND'; did you mean 'BLIND'?"),
        ("new_target: active.BLIND", "new_target: inactive", "'inactive': must be active.MODE"),
        ("new_target: active.BLIND", "new_target: active.CAREFUL", "is 'if_target': must be another mode"),
        ("if_target: active.CAREFUL", "if_target: activ.CAREFUL", "'activ.CAREFUL': must be active.MODE"),
        ("[driver, active.__DEFAULT__]", "[drivr, active.SLOW]", "no part 'drivr'; did you mean 'driver'?"),
        ("[driver, active.__DEFAULT__]", "[driver, active.SLWO]", "no mode 'SLWO'; did you mean 'SLOW'?"),
        ("[driver, active.__DEFAULT__]", "[driver, actve]", "'actve' is no state; did you mean 'active'?"),
        ("[driver, active.__DEFAULT__]", "driver", "must be a list of a part and its state"),
        ("new_target: active.BLIND", "new_targt: active.BLIND", "did you mean 'new_target'?"),
    ],
)
def test_a_rule_that_cannot_be_is_refused_with_the_modes_file_and_its_line(
    tmp_path: Path, right: str, wrong: str, problem: str
) -> None:
    assert FILE.count(right) == 1
    modes = FILE.replace(right, wrong)
    found = [one for one in _problems(tmp_path, modes) if problem in one.problem]
    assert found, _problems(tmp_path, modes)
    lines = FILE.splitlines()
    line = 1 + next(number for number, line in enumerate(lines) if right in line)
    assert (Path(found[0].file).name, found[0].line) == ("modes.yaml", line)
    assert found[0].field.startswith("chassis.rules.part_in_mode")
