"""FROG's detector goes on at another host, and comes back, while it drives."""

from __future__ import annotations

from pathlib import Path

from bus_schema.messages.mission import MissionState, MissionStatus
from bus_schema.messages.perception import Detections
from tests.frog.frog import Frog
from tests.host.guests import Guest
from tests.kit.site import wait_until


def test_the_detector_moves_to_a_second_host_and_back_and_the_mission_does_not_notice(
    frog: Frog, tmp_path: Path
) -> None:
    looks = frog.listen("detections", Detections)
    missions = frog.listen("mission", MissionStatus)
    edge = Guest(frog.info.join, "edge", tmp_path / "edge.log")
    try:
        edge.wait_joined(frog)
        for host in ("edge", "local"):
            answer = frog.rest.post("/components/detector/move", json={"host": host})
            assert answer.status_code == 200, answer.text
            assert (answer.json()["outcome"], answer.json()["steps"][1]["state"]) == ("applied", "done")
            wait_until(lambda host=host: _host_of(frog, "detector") == host, f"the detector at {host}")  # type: ignore[misc]
            heard = len(looks)
            wait_until(lambda heard=heard: len(looks) > heard, "the detector to look again")  # type: ignore[misc]
        told = frog.client.clock()
        assert told is not None
        assert (told.reproducible, told.dropped) == (True, ())
        assert not [one for one in missions if one.state in (MissionState.FAILED, MissionState.HALTED)]
    finally:
        assert edge.end() == 0


def _host_of(frog: Frog, component: str) -> str | None:
    seen = frog.client.components().get(component)
    return seen.host if seen else None
