"""The library has the published realizations of navigation."""

from __future__ import annotations

from regraft.adaptation_manager.planners.metacontrol.skills.generators.system_modes import system_modes
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import choosable, configurations_of, mode_name
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, checked_skills, read_skills
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Better, Realization

NAVIGATION = LIBRARY / "navigation.skills"
PUBLISHED = {
    "normal": (0.4, {"laser_resender", "battery"}, (0.8, 0.7, 0.5)),
    "performance": (0.5, {"laser_resender", "battery"}, (0.55, 0.9, 0.7)),
    "slow": (0.1, {"laser_resender", "battery"}, (0.7, 0.4, 0.3)),
    "energy_saving": (0.1, {"laser_resender"}, (0.6, 0.3, 0.34)),
    "degraded": (0.1, {"camera", "battery"}, (0.55, 0.2, 0.45)),
    "degraded_energy_save": (0.1, {"camera"}, (0.6, 0.1, 0.34)),
}


def speed(realization: Realization) -> object:
    """Return the speed (m/s) that a realization sets."""
    controller = realization.component("controller_server")
    assert controller is not None
    found = configurations_of(read_skills(NAVIGATION))
    return found.parameters("controller_server", mode_name(controller.target))["FollowPath.max_vel_x"]


def test_the_library_has_nothing_to_complain_about() -> None:
    for file in LIBRARY.glob("*.skills"):
        assert checked_skills(file).diagnostics == ()


def test_it_has_the_six_published_realizations() -> None:
    found = read_skills(NAVIGATION)
    assert [each.name for each in choosable(found)] == list(PUBLISHED)
    for realization in found.realizations:
        velocity, needs, qualities = PUBLISHED[realization.name]
        estimates = {each.quality: each.value for each in realization.estimates}
        assert speed(realization) == velocity
        assert (estimates["safety"], estimates["performance"], estimates["energy"]) == qualities
        active = {each.name for each in realization.components if each.is_active}
        assert active & {"laser_resender", "camera", "battery"} == needs


def test_a_realization_takes_at_most_five_lines() -> None:
    blocks = NAVIGATION.read_text().split("\nRealization ")[1:]
    assert len(blocks) == 6
    assert [block for block in blocks if len(block.strip().splitlines()) > 5] == []


def test_it_has_skills_contexts_and_directions_of_qualities() -> None:
    found = read_skills(NAVIGATION)
    assert [each.name for each in found.skills] == ["to_navigate", "to_recharge"]
    assert [each.text for each in found.contexts] == ["Default", "BatteryCharging", "OnChargingStation"]
    directions = {each.name: each.better for each in found.qualities}
    assert directions == {"safety": Better.HIGHER, "performance": Better.HIGHER, "energy": Better.LOWER}


def test_a_robot_takes_the_definitions_without_the_realizations() -> None:
    found = read_skills(LIBRARY / "navigation_definitions.skills")
    assert (len(found.skills), found.realizations) == (2, ())
    assert "system" not in system_modes(found).replace("'regraft skills", "")


def test_no_name_of_a_skill_or_quality_is_in_python() -> None:
    found = read_skills(NAVIGATION)
    names = [*(each.name for each in found.skills), *(each.name for each in found.qualities)]
    sources = list(LIBRARY.parent.rglob("*.py"))
    assert len(sources) > 20
    assert [(path.name, name) for path in sources for name in names if f'"{name}' in path.read_text()] == []
