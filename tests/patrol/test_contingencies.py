"""Contingencies of a run are drawn from its seed, the same for all managers."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from regraft.stacks.patrol.studies.contingencies import LASER_FAILURES, SECONDS, contingencies
from regraft.stacks.patrol.studies.managers import STUDY

seeds = st.integers(0, 2**31)


@given(seeds)
def test_each_contingency_begins_within_the_run_and_ends_after_it_has_begun(seed: int) -> None:
    drawn = contingencies(seed)
    assert drawn == contingencies(seed)
    assert drawn.laser_failure in LASER_FAILURES
    for spell in (drawn.laser, drawn.camera, drawn.drain, drawn.crowd):
        assert 0.0 < spell.begin < spell.end
        assert spell.begin < SECONDS
        assert spell.holds(spell.begin)
        assert not spell.holds(spell.end)


@given(seeds)
def test_all_managers_meet_the_same_contingencies(seed: int) -> None:
    found = []
    for arm in STUDY.configurations["measured"]:
        components = arm.changes(seed)["components"]
        parts = {name: components[name]["parameters"] for name in ("world", "battery", "rows")}
        found.append((parts, components["camera"]["parameters"]["failures"]))
    assert all(each == found[0] for each in found)


def test_the_camera_fails_together_with_the_laser_in_about_half_of_the_runs() -> None:
    drawn = [contingencies(seed) for seed in range(200)]
    meets = sum(each.laser.holds(each.camera.begin) for each in drawn)
    assert 80 <= meets <= 120
