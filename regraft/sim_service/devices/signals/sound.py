"""Loudspeakers, and microphones that hear them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

from regraft import Input, Output, Parameter
from regraft.bus_schema.messages.devices.signals import HeardSound, Hearing, Sound
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE, NONE, SILENT
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.signals.sight import obstacles, root_of

SPEED = 343.0
"""m/s, in dry air of 20 degrees Celsius."""
NEAREST = 0.01
"""m: the inverse square would be infinite at the loudspeaker itself."""
KEPT = 1.0
"""s for which a sound is on its way at most, which is 343 m."""
LOUDEST = 300.0
"""dB: a level beyond it counts as it, and one below its negative as that, so that powers stay numbers."""


@dataclass(frozen=True, slots=True)
class Emission:
    """A sound that a loudspeaker makes between two times (s); its level (dB) is that at 1 m."""

    start: float
    end: float
    word: str
    level: float


class Loudspeaker(Device):
    """Makes sounds at an MJCF site; a sound ends the one before. A silent one makes none.

    The largest level is an assumption. Normal speech has 60 dB at 1 m, loud speech 72 dB (ISO 9921).
    """

    say = Input(Sound, description="the sound to make", required=False)

    site = Parameter("loudspeaker", "the MJCF site where it is", read_only=True)
    max_level = Parameter(80.0, "largest level at 1 m; louder sounds have this one", unit="dB", read_only=True)
    failure = Parameter(NONE, "how it fails now", choices=(NONE, SILENT))

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self.site_index = self.kit.index("site", self.site)
        self.root = root_of(self.kit, self.site_index)
        self._emissions: list[Emission] = []

    @say.handler
    def on_say(self, sound: Sound) -> None:
        """Make a sound from now on."""
        if self.kit.failing == SILENT:
            return
        now = self.kit.time
        self._end_sounds(now)
        level = min(sound.level, self.max_level)
        self._emissions.append(Emission(now, now + sound.duration, sound.word, level))

    def act(self) -> None:
        """End the sound that is made once it is silent; what is on its way arrives."""
        if self.kit.failing == SILENT:
            self._end_sounds(self.kit.time)

    def _end_sounds(self, now: float) -> None:
        kept = (e for e in self._emissions if now - e.end < KEPT)
        self._emissions = [Emission(e.start, min(e.end, now), e.word, e.level) for e in kept]

    def emitted(self, time: float) -> Emission | None:
        """Return the sound that it made at a time (s)."""
        return next((e for e in self._emissions if e.start <= time + 1e-9 < e.end), None)

    def snapshot(self) -> dict[str, Any]:
        """Return the sounds that are made and on their way."""
        return {"emissions": [[e.start, e.end, e.word, e.level] for e in self._emissions]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over the sounds."""
        self._emissions = [Emission(float(s), float(e), str(w), float(level)) for s, e, w, level in state["emissions"]]


class Microphone(Sensor):
    """Hears the loudspeakers of all robots, its own too, at an MJCF site.

    A sound arrives after its way at 343 m/s, and is taken from where the loudspeaker is now. It is weaker by the
    inverse square of the distance. Each thing between takes ``damping``, all together at most ``most_damping``: sound
    bends around, and ISO 9613-2 allows a single barrier 20 dB. Sounds and ambient noise add up in power. A sound is
    recognised if it lies ``margin`` above all else. The ambient noise of 35 dB is that which the WHO wants in class
    rooms (Guidelines for community noise, 1999). Damping, margin and the noise of 1 dB are assumptions.
    """

    measures = "hearing"

    hearing = Output(Hearing, description="how loud it is, and the sounds that are recognised")

    site = Parameter("microphone", "the MJCF site where it is", read_only=True)
    rate = Parameter(10.0, "measurements per second", minimum=0.1, unit="Hz", read_only=True)
    ambient = Parameter(35.0, "level of the noise that is always there", unit="dB")
    damping = Parameter(10.0, "what each thing between takes", minimum=0.0, unit="dB", read_only=True)
    most_damping = Parameter(20.0, "what all things between take at most", minimum=0.0, unit="dB", read_only=True)
    margin = Parameter(0.0, "how far a sound must lie above all else to be recognised", unit="dB", read_only=True)
    noise = Parameter(1.0, "standard deviation of a level", minimum=0.0, unit="dB", read_only=True)
    failure = failure_parameter(BIAS, NOISE)
    bias = Parameter(-20.0, "what a bias adds to each level, as dirt before it does", unit="dB")
    more_noise = Parameter(60.0, "level of the noise that the failure noise adds", unit="dB")

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self._site = self.kit.index("site", self.site)
        self._root = root_of(self.kit, self._site)

    def measure(self) -> Hearing:
        """Return what it hears, spoiled by what fails."""
        bias = self.bias if self.kit.failing == BIAS else 0.0
        sounds = [HeardSound(sound.word, sound.level + bias) for sound in self._arriving()]
        powers = [_power(sound.level) for sound in sounds]
        background = _power(self.ambient + bias)
        if self.kit.failing == NOISE:
            background += _power(self.more_noise)
        total = background + sum(powers)
        recognised = [
            sound
            for sound, power in zip(sounds, powers, strict=True)
            if sound.level - _level(max(total - power, background)) >= self.margin
        ]
        recognised.sort(key=lambda sound: -sound.level)
        return Hearing(self.kit.stamp, _level(total), tuple(recognised))

    def _arriving(self) -> Iterator[HeardSound]:
        kit = self.kit
        own = ((kit.robot.name, device) for device in kit.siblings.values() if isinstance(device, Loudspeaker))
        here = kit.data.site_xpos[self._site]
        for robot, speaker in chain(kit.others_of(Loudspeaker), own):
            there = kit.data.site_xpos[speaker.site_index]
            distance = max(NEAREST, math.dist(here, there))
            sound = speaker.emitted(kit.time - distance / SPEED)
            if sound is None:
                continue
            between = obstacles(kit, here, there, self._root, speaker.root)
            level = sound.level - 20.0 * math.log10(distance) - min(self.damping * between, self.most_damping)
            # Each loudspeaker has noise of its own: one more in the world does not change it.
            random = kit.random(f"{kit.name} {robot} {speaker.kit.name}", kit.progress.tick)
            yield HeardSound(sound.word, level + self.noise * float(random.standard_normal()))


def _power(level: float) -> float:
    return float(10.0 ** (min(level, LOUDEST) / 10.0))


def _level(power: float) -> float:
    return 10.0 * math.log10(max(power, _power(-LOUDEST)))
