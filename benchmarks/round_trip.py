"""Component to component and back: the kit against a raw zenoh-python callback echo over the same links."""

from __future__ import annotations

from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.sides.links import Site
from benchmarks.sides.raw import ASKED, READY, VOLLEY, VOLLEY_TIMEOUT, echo, pinger
from benchmarks.sides.volleys import Echo, ImageEcho, ImagePinger, Pinger, Times, Volley
from regraft.component.component import Component

SMALL = ((64, "64 B"), (1024, "1 KB"))
LARGE = ((1_000_000, "1 MB", 1.4, 60), (6_000_000, "6 MB frame", 1.5, 20))
SMALL_LIMIT = 1.3
SMALL_COUNT = 400
TURNS = 4
"""Small messages are measured in more and shorter turns: what else the machine does changes within seconds."""
ATTEMPTS = 3
"""How often the raw side is asked: on a busy machine a link is closed at which large messages wait for too long."""
WARM_UP = 0.2


def small(effort: Effort) -> list[Result]:
    """Measure round trips of 64 B and 1 KB."""
    results = []
    with Site() as site:
        _start(site, Pinger, Echo)
        for size, name in SMALL:
            count = effort.count(SMALL_COUNT)
            rounds = TURNS * effort.rounds
            sides = _play(site, "volley", count, size, rounds)
            note = f"{rounds} rounds of {count}"
            against = "raw zenoh callback echo"
            results.append(compared(f"round trip, {name}", sides, "µs", against, SMALL_LIMIT, scale=1e6, note=note))
    return results


def large(effort: Effort) -> list[Result]:
    """Measure round trips of 1 MB and 6 MB images through shared memory."""
    results = []
    with Site() as site:
        _start(site, ImagePinger, ImageEcho)
        for size, name, limit, usual in LARGE:
            count = effort.count(usual)
            sides = _play(site, "image_volley", count, size, effort.rounds)
            note = f"{effort.rounds} rounds of {count}"
            against = "the same in bytes, shared memory"
            results.append(compared(f"round trip, {name}", sides, "ms", against, limit, scale=1e3, note=note))
    return results


def _start(site: Site, pinging: type[Component], echoing: type[Component]) -> None:
    site.component(pinging, "pinger")
    site.component(echoing, "echo")
    site.spawn(echo, site.link)
    site.spawn(pinger, site.link)
    site.wait_for_components("pinger", "echo")
    site.wait_for_token(f"{READY}/echo")
    site.wait_for_token(f"{READY}/pinger")


def _play(site: Site, service: str, count: int, size: int, rounds: int) -> Sides:
    def ours(number: int) -> list[float]:
        times = site.client.call(service, Volley(number, size), Times, VOLLEY_TIMEOUT)
        return list(times.seconds)

    def theirs(number: int) -> list[float]:
        for _ in range(ATTEMPTS):
            for answer in site.bus.query(VOLLEY, ASKED.pack(number, size), VOLLEY_TIMEOUT):
                return [float(number) for number in memoryview(answer.payload).cast("d")]
        raise TimeoutError(f"the raw side has not answered {ATTEMPTS} times")

    warm_up = max(1, round(count * WARM_UP))
    ours(warm_up), theirs(warm_up)
    return in_turns(rounds, lambda: ours(count), lambda: theirs(count))
