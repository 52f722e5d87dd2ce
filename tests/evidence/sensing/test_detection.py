"""How often, how wrongly and how exactly both detectors see the hydrant, in many rooms and all lights."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from regraft.evaluation.detection_curve import by_darkness, false_alarms, groups, percentile_error, report, write_report
from tests.detector.measuring import DETECTORS, measure
from tests.support.machine.renderers import renderers

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]


def test_detection_by_light_and_distance(tmp_path: Path) -> None:
    found = measure(renderers(), range(401, 421), poses=10)
    print(report(found))
    write_report(found, tmp_path)
    for (name, _), own in groups(found).items():
        cls = next(one for one in DETECTORS if one.__name__ == name)
        rates = by_darkness(own)
        for one in rates:
            told = cls.estimate({}, {"darkness": (one.low + one.high) / 2})["detection_rate"]
            assert abs(one.rate - told) < 0.15
        assert max(before.rate - after.rate for before, after in pairwise(rates)) < 0.45
        assert false_alarms(own) <= 0.01
        assert percentile_error(own, 0.95) < 0.3
