"""Promises about loudspeakers and microphones."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.messages.devices.signals import Hearing, Sound
from regraft.sim_service.devices.signals.sound import Loudspeaker, Microphone
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, PUCK, device, found, robot, run, simulated

BODY = PUCK + '<site name="loudspeaker" pos="0 0 .05"/><site name="microphone" pos="0 0 .05"/>'
QUIET: dict[str, Any] = {"noise": 0.0, "ambient": -60.0}
WALL = '<body name="wall{0}" pos="{0} 0 .2"><geom type="box" size=".01 .5 .2"/></body>'


def talk(folder: Path, *speakers: float, body: str = FLOOR, **how: Any) -> Simulation:
    """Return a robot that listens, and some that speak at distances (m) along x."""
    listener = robot(folder, "ear", [device(Microphone, **{**QUIET, **how})], body=BODY)
    others = [
        robot(folder, f"mouth{number}", [device(Loudspeaker)], (distance, 0.0, 0.0), body=BODY)
        for number, distance in enumerate(speakers)
    ]
    return simulated(folder, listener, *others, body=body)


def say(
    simulation: Simulation, mouth: int = 0, word: str = "hello", level: float = 60.0, duration: float = 0.5
) -> None:
    """Let a robot make a sound."""
    found(simulation, Loudspeaker, of=f"mouth{mouth}").on_say(Sound(word, level, duration))


def heard(simulation: Simulation) -> Hearing:
    """Return what the listening robot hears."""
    return found(simulation, Microphone, of="ear").measure()


@settings(max_examples=15, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(0.0, 80.0))
def test_a_sound_fades_by_the_inverse_square(distance: float, level: float) -> None:
    with TemporaryDirectory() as folder:
        simulation = talk(Path(folder), distance)
    say(simulation, level=level)
    run(simulation)
    (sound,) = heard(simulation).sounds
    assert sound.word == "hello"
    assert sound.level == pytest.approx(level - 20.0 * math.log10(distance))
    assert heard(simulation).level == pytest.approx(sound.level, abs=1e-3)


def test_two_equal_sources_are_3_db_louder_than_one(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 1.0, -1.0, margin=-3.0)
    say(simulation, 0)
    say(simulation, 1)
    run(simulation)
    assert heard(simulation).level == pytest.approx(60.0 + 10.0 * math.log10(2.0), abs=1e-6)
    assert len(heard(simulation).sounds) == 2


def test_a_sound_comes_late_and_ends_late(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 34.3)
    say(simulation, level=80.0, duration=0.2)
    loud = []
    for _ in range(8):
        run(simulation)
        loud.append(bool(heard(simulation).sounds))
    assert loud == [False, True, True, True, True, False, False, False]


def test_things_between_damp_a_sound_up_to_a_limit(tmp_path: Path) -> None:
    levels = []
    for count in range(4):
        walls = "".join(WALL.format(0.3 + 0.2 * number) for number in range(count))
        simulation = talk(tmp_path, 1.0, body=FLOOR + walls)
        say(simulation)
        run(simulation)
        levels.append(heard(simulation).level)
    assert levels == pytest.approx([60.0, 50.0, 40.0, 40.0], abs=1e-3)


def test_noise_and_louder_sounds_mask_a_sound(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 1.0, -1.0, ambient=50.0, margin=3.0)
    say(simulation, 0, "soft", 52.0)
    run(simulation)
    assert heard(simulation).sounds == ()
    say(simulation, 0, "loud", 54.0)
    run(simulation)
    assert [sound.word for sound in heard(simulation).sounds] == ["loud"]
    say(simulation, 1, "louder", 60.0)
    run(simulation)
    assert [sound.word for sound in heard(simulation).sounds] == ["louder"]


def test_silence_is_as_loud_as_the_ambient_noise(tmp_path: Path) -> None:
    assert heard(talk(tmp_path, ambient=42.0)).level == pytest.approx(42.0)


def test_a_sound_ends_the_one_before_and_is_no_louder_than_the_loudspeaker(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 1.0)
    say(simulation, word="first", duration=10.0)
    run(simulation)
    say(simulation, word="second", level=200.0, duration=10.0)
    run(simulation)
    (sound,) = heard(simulation).sounds
    assert sound.word == "second"
    assert sound.level == pytest.approx(80.0)


def test_a_robot_hears_itself(tmp_path: Path) -> None:
    alone = robot(tmp_path, "", [device(Loudspeaker, "mouth"), device(Microphone, "ear", **QUIET)], body=BODY)
    simulation = simulated(tmp_path, alone)
    found(simulation, Loudspeaker, "mouth").on_say(Sound("me"))
    run(simulation)
    assert [sound.word for sound in found(simulation, Microphone, "ear").measure().sounds] == ["me"]


def test_another_robot_changes_nobodys_noise(tmp_path: Path) -> None:
    few, many = talk(tmp_path, 1.0, noise=2.0), talk(tmp_path, 1.0, 3.0, noise=2.0)
    for simulation in (few, many):
        say(simulation, duration=9.0)
        run(simulation)
    assert heard(few) == heard(many)


def test_each_failure_spoils_in_its_way(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 1.0, bias=-15.0, more_noise=70.0)
    say(simulation, duration=9.0)
    run(simulation)
    microphone = found(simulation, Microphone, of="ear")
    microphone.kit.failing = "bias"
    assert heard(simulation).sounds[0].level == pytest.approx(45.0)
    microphone.kit.failing = "noise"
    assert heard(simulation).sounds == ()
    microphone.kit.failing = "none"
    assert [sound.word for sound in heard(simulation).sounds] == ["hello"]


def test_a_loudspeaker_that_becomes_silent_ends_its_sound_and_what_is_on_its_way_arrives(tmp_path: Path) -> None:
    simulation = talk(tmp_path, 34.3)
    mouth = found(simulation, Loudspeaker, of="mouth0")
    say(simulation, level=80.0, duration=9.0)
    run(simulation, 0.3)
    mouth.kit.failing = "silent"
    say(simulation, word="unheard", level=80.0)
    loud = []
    for failing in ("silent", "silent", "silent", "none", "none"):
        mouth.kit.failing = failing
        run(simulation)
        loud.append([sound.word for sound in heard(simulation).sounds])
    assert loud == [["hello"], [], [], [], []]


def test_a_restored_run_goes_on_hearing(tmp_path: Path) -> None:
    original, successor = talk(tmp_path, 34.3, noise=1.0), talk(tmp_path, 34.3, noise=1.0)
    say(original, level=80.0)
    run(original)
    successor.restore(original.snapshot())
    for simulation in (original, successor):
        run(simulation, 0.2)
    assert heard(successor).sounds == heard(original).sounds != ()


@pytest.mark.parametrize("kind", [Loudspeaker, Microphone])
def test_a_site_that_is_not_there_is_refused(tmp_path: Path, kind: type) -> None:
    with pytest.raises(SceneError, match="no site named"):
        simulated(tmp_path, robot(tmp_path, "", [device(kind)]))


@pytest.mark.parametrize("ambient", [-1e6, -100.0, 1e6])
def test_any_ambient_noise_is_a_level(tmp_path: Path, ambient: float) -> None:
    simulation = talk(tmp_path, 1.0, ambient=ambient)
    assert math.isfinite(heard(simulation).level)
    say(simulation, level=80.0)
    run(simulation)
    assert [sound.level for sound in heard(simulation).sounds] == ([80.0] if ambient < 0.0 else [])
