"""Measures detectors on pictures whose truth is known.

``python -m tests.detector.measuring --out DIR`` measures both, with the ray camera and the best renderer there is.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from regraft import Component, Output, every
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.perception import Detect, Detections, Sightings
from regraft.bus_schema.messages.sensors import Image, Odometry
from regraft.evaluation.detection_curve import Look, report, write_report
from regraft.services.detector.detector import Detector
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.template_detector import TemplateDetector
from regraft.sim_service.cameras.renderers import RendererName
from regraft.testing import Rig
from tests.detector.gallery import Gallery, Shot
from tests.support.machine.renderers import renderers

DETECTORS: tuple[type[HydrantDetector], ...] = (Detector, TemplateDetector)
WRONG = 0.3
"""m: a sighting farther from the hydrant than this saw something else."""
MOST = 100
"""Pictures in one request."""


class Slides(Component):
    """Shows one shot after another: where the robot is, then the picture."""

    image = Output(Image)
    odometry = Output(Odometry)

    def on_configure(self) -> None:
        self.shots: list[Shot] = []

    @every(hz=100.0)
    def show(self) -> None:
        if self.shots:
            shot, now = self.shots.pop(0), self.kit.now()
            self.odometry.publish(Odometry(now, "map", "base_link", shot.robot_pose, Twist()))
            self.image.publish(replace(shot.image, stamp=now))


def looks(detector: type[HydrantDetector], renderer: str, shots: Iterable[Shot]) -> list[Look]:
    """Have a detector look at shots."""
    waiting, done = list(shots), []
    with Rig() as rig:
        rig.add(detector, "detector")
        slides = rig.add(Slides)
        while waiting:
            some, waiting = waiting[:MOST], waiting[MOST:]
            told = rig.collect("detections", Detections)
            slides.shots = list(some)
            rig.call("detect", Detect(pictures=len(some)), Sightings, timeout=60.0)
            assert len(told[: len(some)]) == len(some)
            done += [_look(detector, renderer, *pair) for pair in zip(some, told, strict=False)]
    return done


def _look(detector: type[HydrantDetector], renderer: str, shot: Shot, told: Detections) -> Look:
    error, confidence = math.nan, math.nan
    hit = wrong = False
    for n, seen in enumerate(told.objects):
        off = math.inf
        if shot.hydrant is not None:
            off = math.hypot(seen.position.x - shot.hydrant.x, seen.position.y - shot.hydrant.y)
        wrong = wrong or off > WRONG
        if n == 0:
            hit, error, confidence = off <= WRONG, off, seen.confidence
    name = detector.__name__
    return Look(name, renderer, shot.darkness, shot.distance, hit, wrong, error, confidence)


def measure(renderers: Sequence[RendererName], seeds: Iterable[int], poses: int) -> list[Look]:
    """Have both detectors look at pictures with and without the hydrant, ten lights for each pose."""
    found: list[Look] = []
    for renderer in renderers:
        gallery = Gallery(renderer)
        for seed in seeds:
            shots = [*gallery.with_hydrant(seed, poses), *gallery.without_hydrant(seed, poses)]
            for detector in DETECTORS:
                found += looks(detector, renderer, shots)
    return found


def main() -> None:
    """Measure, print and write the report."""
    parser = argparse.ArgumentParser(prog="python -m tests.detector.measuring", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the report")
    parser.add_argument("--seeds", type=int, default=20, help="how many rooms")
    parser.add_argument("--poses", type=int, default=10, help="how many poses in each, with and without hydrant")
    chosen = parser.parse_args()
    found = measure(renderers(), range(201, 201 + chosen.seeds), chosen.poses)
    write_report(found, chosen.out)
    print(report(found))


if __name__ == "__main__":
    main()
