"""Rules decide by what components measure and by how requirements are met; nonsense is unknown, and holds nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.model.adaptation import SetParameters
from regraft.bus_schema.model.modes.mode_deciders import fed_as_needed
from regraft.bus_schema.model.system_topics import MEASUREMENTS
from regraft.stack import load
from tests.modes.in_memory import STACK, Director, entered, perform, running

RULED = (
    STACK
    + """\
modes:
  driver.fast: [{change: set_parameters, component: driver, parameters: {speed: 1.0}}]
  driver.slow: [{change: set_parameters, component: driver, parameters: {speed: 0.3}}]
  lamp.on: [{change: transition, component: lamp, transition: activate}]
  lamp.off: [{change: transition, component: lamp, transition: deactivate}]
rules:
  slow_down: {when: laser.clearness < 0.3, mode: driver.slow}
  speed_up: {when: laser.clearness > 0.5, from: driver.slow, mode: driver.fast}
  warn: {when: not qualities.MoveSafely.satisfied, mode: lamp.on}
  all_clear: {when: qualities.MoveSafely.satisfied and qualities.MoveSafely.degree > 0.5, from: lamp.on, mode: lamp.off}
"""
)


def test_they_hold_and_recover_by_what_is_measured(tmp_path: Path) -> None:
    seen = []

    async def script(director: Director) -> None:
        await director.until(2.0)
        seen.append((await director.modes("driver")).target)
        for air in (0.2, 0.4, 0.6):
            await director.adapt(SetParameters("laser", {"air": air}))
            await director.kit.sleep(3.0)
            seen.append((await director.modes("driver")).actual)

    with running(tmp_path, RULED, script) as system:
        perform(system)
        assert seen == ["", "driver.slow", "driver.slow", "driver.fast"]
        assert entered(system) == [("driver.slow", "applied"), ("driver.fast", "applied")]


def test_they_hold_and_recover_by_how_a_requirement_is_met(tmp_path: Path) -> None:
    seen: list[Any] = []

    async def script(director: Director) -> None:
        await director.until(1.0)
        seen.append((await director.rule("warn")).why)
        for satisfied, more in (
            (None, {}),
            (False, {}),
            (True, {"degree": 0.2}),
            (False, {"active": False}),
            (True, {"degree": 0.9}),
        ):
            director.tell("MoveSafely", satisfied, **more)
            await director.kit.sleep(1.5)
            rule = await director.rule("warn")
            seen.append((rule.holds, rule.why, (await director.modes("lamp")).actual))

    with running(tmp_path, RULED, script) as system:
        perform(system)
        name = "qualities.MoveSafely.satisfied"
        assert seen == [
            f"{name} is not known: the requirement was never reported",
            (None, f"{name} is not known: not measured", "lamp.off"),
            (True, "", "lamp.on"),
            (False, "", "lamp.on"),
            (None, f"{name} is not known: the requirement is not active", "lamp.on"),
            (False, "", "lamp.off"),
        ]


NONSENSE = {
    "nan": "nan: must be finite",
    "inf": "inf: must be finite",
    "minus inf": "must be finite",
    "text": "must be a number",
    "truth": "must be a number",
    "percent": "30: must be at most 1",
    "negative": "must be at least 0",
    "nothing": "not given",
    "raises": "evaluate raised RuntimeError: no air",
    "no map": "",
}
"""Values that do not count as a quality, and why not. Thirty per cent is the wrong unit of a share."""


def test_nonsense_is_unknown_holds_nothing_and_the_planner_says_so(tmp_path: Path) -> None:
    seen: dict[str, tuple[bool | None, str]] = {}

    async def script(director: Director) -> None:
        await director.until(1.0)
        for kind in NONSENSE:
            await director.adapt(SetParameters("laser", {"nonsense": kind, "air": 0.1}))
            await director.kit.sleep(2.0)
            rule = await director.rule("slow_down")
            seen[kind] = (rule.holds, rule.why)
        await director.adapt(SetParameters("laser", {"nonsense": ""}))
        await director.kit.sleep(2.0)
        assert (await director.modes("driver")).actual == "driver.slow"

    with running(tmp_path, RULED, script) as system:
        perform(system)
        assert entered(system) == [("driver.slow", "applied")]
    for kind, (holds, why) in seen.items():
        assert holds is None, (kind, holds, why)
        assert why.startswith("laser.clearness is not known: "), (kind, why)
        assert NONSENSE[kind] in why, (kind, why)


BY_STATES = RULED.replace("laser.clearness < 0.3", "laser.failed").replace("laser.clearness > 0.5", "not laser.failed")


@pytest.mark.parametrize(
    ("text", "topic"),
    [
        (RULED, MEASUREMENTS),
        (BY_STATES, None),
        (STACK, None),
        (
            BY_STATES.replace(":ModePlanner'", ":ModePlanner', connect: {measurements: system/measurements}"),
            MEASUREMENTS,
        ),
    ],
    ids=["a rule names a quality", "rules name states", "no rules", "the stack asks for them"],
)
def test_measurements_are_asked_for_only_if_something_reads_them(tmp_path: Path, text: str, topic: str | None) -> None:
    (tmp_path / "stack.yaml").write_text(text)
    architecture = load(tmp_path / "stack.yaml").architecture
    assert architecture.components["mode_planner"].connections["measurements"] == topic
    read = {topic for spec in architecture.components.values() for topic in spec.connections.values()}
    assert (MEASUREMENTS in read) == (topic is not None)


def test_a_planner_that_is_added_asks_for_measurements_only_if_a_rule_names_a_quality(tmp_path: Path) -> None:
    (tmp_path / "stack.yaml").write_text(STACK)
    without = load(tmp_path / "stack.yaml").architecture
    (tmp_path / "stack.yaml").write_text(RULED)
    ruled = load(tmp_path / "stack.yaml").architecture
    planner = ruled.components["mode_planner"]
    assert fed_as_needed(planner, (), ruled) == planner
    assert fed_as_needed(planner, (), without).connections["measurements"] is None
    assert fed_as_needed(planner, ("measurements",), without) == planner
    laser = ruled.components["laser"]
    assert fed_as_needed(laser, (), without) == laser
