"""Measured hit rates: what estimates promise, and how they are told."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from regraft.evaluation.detection_curve import (
    Look,
    by_darkness,
    by_distance,
    false_alarms,
    main,
    read_looks,
    write_looks,
)
from regraft.services.detector.detector import Detector
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.template_detector import TemplateDetector

from .gallery import Gallery, Shot
from .measuring import looks


@pytest.fixture(scope="module")
def shots() -> list[Shot]:
    gallery = Gallery("ray")
    return [shot for seed in range(301, 305) for shot in gallery.with_hydrant(seed, poses=3)]


@pytest.mark.parametrize("detector", [Detector, TemplateDetector])
def test_an_estimate_is_what_pictures_show(detector: type[HydrantDetector], shots: list[Shot]) -> None:
    found = by_darkness(looks(detector, "ray", shots))
    told = [detector.estimate({}, {"darkness": (one.low + one.high) / 2})["detection_rate"] for one in found]
    off = [abs(one.rate - rate) for one, rate in zip(found, told, strict=True)]
    assert sum(off) / len(off) < 0.1
    assert max(off) < 0.35


@pytest.mark.parametrize("detector", [Detector, TemplateDetector])
def test_with_the_light_the_estimate_fades_step_by_step(detector: type[HydrantDetector]) -> None:
    rates = [detector.estimate({}, {"darkness": n / 20})["detection_rate"] for n in range(21)]
    steps = [before - after for before, after in pairwise(rates)]
    assert all(step >= 0.0 for step in steps)
    assert max(steps) < 0.2
    assert rates[0] > 0.9
    assert rates[-1] < 0.05


def look(darkness: float, distance: float, *, hit: bool) -> Look:
    return Look("Detector", "ray", darkness, distance, hit, not hit and math.isinf(distance), 0.1, 0.9)


def test_rates_are_taken_by_bin_of_the_looks_with_the_hydrant_in_view() -> None:
    told = [
        look(0.02, 1.1, hit=True),
        look(0.05, 1.1, hit=False),
        look(1.0, 0.5, hit=False),
        look(0.0, math.inf, hit=False),
    ]
    rates = by_darkness(told)
    assert (rates[0].rate, rates[0].looks) == (0.5, 2)
    assert (rates[-1].rate, rates[-1].looks) == (0.0, 1)
    assert math.isnan(rates[4].rate)
    assert sum(one.looks for one in by_distance(told)) == 2
    assert false_alarms(told) == 1.0


def test_a_report_is_made_from_a_file_of_looks(tmp_path: Path) -> None:
    told = [look(n / 20, 0.5 + n / 10, hit=n < 8) for n in range(20)]
    write_looks(tmp_path / "looks.csv", told)
    assert read_looks(tmp_path / "looks.csv") == told
    main(["--looks", str(tmp_path / "looks.csv"), "--out", str(tmp_path / "out")])
    assert "| 0.0 to 0.1 | 1.00 (2) |" in (tmp_path / "out" / "detection_curve.md").read_text()


def test_a_file_that_holds_no_looks_is_refused_with_the_line(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("detector,darkness\nDetector,much\n")
    with pytest.raises(ValueError, match=r"bad\.csv, line 2: not a look"):
        read_looks(tmp_path / "bad.csv")
