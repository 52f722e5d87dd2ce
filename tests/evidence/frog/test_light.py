"""The hydrant is found in light and not in the dark, and nothing else is taken for it."""

from __future__ import annotations

import math

import pytest

from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.messages.world import GroundTruth
from regraft.sim_service.layout.placement import draw_placement
from tests.frog.conftest import StartFrog
from tests.support.worlds import frog_scene

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

NEAR = 0.6
"""Metres between a sighting and the hydrant beyond which something else was taken for it."""


def test_sightings_by_light(start_frog: StartFrog) -> None:
    pictures = {"light": 0, "dark": 0}
    hits = {"light": 0, "dark": 0}
    wrong = 0
    scene = frog_scene()
    for seed in (11, 12, 13, 14):
        frog = start_frog("--speed", "max", "--seed", str(seed))
        hydrant = draw_placement(scene, seed).poses["hydrant"]
        light = frog.listen("light", LightLevel)
        seen = frog.listen("detections", Detections)
        truth = frog.listen("ground_truth", GroundTruth)
        frog.wait_for_time(300.0)
        darkness = {round(told.stamp, 1): told.darkness for told in light}
        for detections in seen:
            dark = darkness.get(round(math.floor(detections.stamp * 2) / 2, 1), 0.5)
            kind = "light" if dark < 0.4 else "dark" if dark > 0.75 else ""
            if kind:
                pictures[kind] += 1
                hits[kind] += bool(detections.objects)
            for found in detections.objects:
                wrong += math.hypot(found.position.x - hydrant.x, found.position.y - hydrant.y) > NEAR
        assert truth
        frog.end()
    total = sum(pictures.values())
    print(f"pictures {pictures}, hits {hits}, wrong {wrong}")
    assert hits["light"] / pictures["light"] > 0.1
    assert hits["dark"] / pictures["dark"] < 0.02
    assert wrong / total <= 0.01
