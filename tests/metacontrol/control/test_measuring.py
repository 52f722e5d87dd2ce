"""Which measurements count: neither early, late, forged nor senseless ones."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from tests.metacontrol.control.bench import PATROL, perform
from tests.metacontrol.control.parts import Director


async def _report(director: Director, value: object, seconds: float, **more: object) -> str:
    for _ in range(int(seconds / 0.2)):
        director.report("safety", value, **more)  # type: ignore[arg-type]
        await director.wait(0.2)
        realization = (await director.status("patrol")).realization
        if realization != "normal":
            return realization
    return "normal"


def test_a_requirement_that_is_missed_for_less_than_the_hold_changes_nothing(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.wait(0.5)
        director.report("safety", 0.3)
        await director.wait(0.3)
        director.report("safety", 0.9)
        await director.wait(1.5)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, parameters={"hold": 2.0})


def test_a_requirement_that_is_met_between_two_cycles_is_not_missed_all_the_time(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        for number in range(16):
            director.report("safety", 0.9 if number % 4 == 1 else 0.3)
            await director.wait(0.25)
            assert (await director.status("patrol")).realization == "normal"
        assert await _report(director, 0.3, 4.0) == "slow"

    perform(tmp_path, script, parameters={"hold": 0.9, "period": 1.0})


def test_a_requirement_is_missed_since_it_was_measured_and_not_since_the_next_cycle(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        begun = director.kit.now()
        assert await _report(director, 0.3, 6.0) == "slow"
        assert director.kit.now() - begun < 3.5

    perform(tmp_path, script, parameters={"hold": 1.5, "period": 2.0})


def test_a_measurement_just_at_its_limit_is_kept_and_just_beyond_it_is_not(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        assert await _report(director, 0.5, 2.0) == "normal"
        assert await _report(director, 0.4999, 2.0) == "slow"

    perform(tmp_path, script)


def test_a_better_measurement_than_required_is_no_error(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        assert await _report(director, 1.0, 2.0) == "normal"
        assert (await director.status("patrol")).measured == {"safety": 1.0}

    perform(tmp_path, script)


def test_measurements_from_before_a_design_has_settled_or_long_ago_are_unknown(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        begun = director.kit.now()
        assert await _report(director, 0.1, 2.0, at=begun) == "normal"
        assert (await director.status("patrol")).measured == {}
        director.report("safety", 0.9)
        await director.wait(3.0)
        assert (await director.status("patrol")).measured == {}

    perform(tmp_path, script, parameters={"stale_after": 2.0, "settle": 1.0})


def test_senseless_and_forged_measurements_are_left_out_and_reported(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        for value in ("nan", "inf", "1e999", "low", True, None, -0.1, 1.1, [0.1]):
            assert await _report(director, value, 0.6) == "normal", value
        assert await _report(director, 0.1, 0.6, objective="patrl") == "normal"
        assert await _report(director, 0.1, 0.6, at=director.kit.now() + 100.0) == "normal"
        director.report("sfety", 0.1)
        director.report_component("lasr", "FALSE")
        director.report_component("laser", "BROKEN")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"
        await director.told(
            "metacontrol.implausible",
            "did you mean 'safety'",
            "did you mean 'laser'",
            "'BROKEN', must be one of FALSE",
            "not be after now",
        )

    perform(tmp_path, script)


def test_a_measurement_of_one_objective_does_not_count_for_another(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.add(Objective("to_navigate", "calm", {"safety": 0.5}))
        assert await _report(director, 0.1, 1.0, objective="calm") in ("normal", "slow")
        first, second = (await director.all()).objectives
        assert first.attempts == ()
        assert second.attempts != () or second.state is not ObjectiveState.IN_PROGRESS

    perform(tmp_path, script)


def test_a_component_that_only_an_observer_knows_to_have_failed_is_left_until_it_recovers(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component("battery", "FALSE")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "energy_saving"
        director.report_component("battery", "RECOVERED")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_a_recovery_during_an_adaptation_is_left_for_the_next_decision(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component("laser", "FALSE")
        director.report_component("laser", "RECOVERED")
        director.report_component("laser", "FALSE")
        director.report_component("laser", "RECOVERED")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_what_an_objective_required_rests_no_longer_than_the_objective_lasts(tmp_path: Path) -> None:
    recharge = Objective("to_recharge", "recharge")

    async def realization(director: Director, name: str) -> str:
        return next(each.realization for each in (await director.all()).objectives if each.objective == name)

    async def script(director: Director) -> None:
        found = await director.add(recharge)
        required = next(each.objective for each in found.objectives if each.parent)
        first = await realization(director, required)
        for _ in range(6):
            await director.wait(0.3)
            director.report("safety", 0.1, required)
        await director.wait(1.0)
        assert await realization(director, required) != first
        assert (await director.cancel("recharge")).resting == {}
        await director.add(recharge)
        assert await realization(director, required) == first

    perform(tmp_path, script)
