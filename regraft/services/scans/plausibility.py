"""Whether scans can be those of a lidar that works, by the scans alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from regraft.bus_schema.messages.sensors import LaserScan
from regraft.services.sensor_checks import FROZEN, SILENT, Finding, Sameness, scan_fingerprint

ZEROS, EMPTY, AHEAD = "zeros", "empty", "ahead"
EARLY = 1.0
"""s by which the lidar's clock may be ahead."""


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Limits of a working lidar: silence and equal scans (s), the share of zeros, and useless scans in a row."""

    silent: float
    first: float
    frozen: float
    zero_share: float
    in_a_row: int


@dataclass(slots=True)
class ScanJudge:
    """Follows the scans of one lidar from a time ``since`` (s) on."""

    since: float
    _newest: float = field(init=False, default=-math.inf)
    _sameness: Sameness = field(init=False, default_factory=Sameness)
    _implausible: int = field(init=False, default=0)

    def silence(self, now: float, tolerances: Tolerances) -> Finding | None:
        """Return whether no scan has come for too long at ``now`` (s)."""
        if self._newest < self.since:
            quiet, allowed = now - self.since, tolerances.first
        else:
            quiet, allowed = now - self._newest, tolerances.silent
        # Times are sums of steps: a rounding error is no silence.
        return Finding(SILENT, f"no scan has come for {quiet:.2f} s") if quiet > allowed + 1e-9 else None

    def judge(self, scan: LaserScan, now: float, tolerances: Tolerances) -> tuple[bool, Finding | None]:
        """Take in a scan at ``now`` (s); return whether it is plausible, and the lidar's fault where that is certain.

        A scan that is as old as the one before, or older, is not plausible. So is one that equals the one before, for
        a lidar has noise. One from the future is not, either, and what follows is judged without it.
        """
        ahead = scan.stamp - now
        if ahead > EARLY:
            self._implausible += 1
            early = Finding(AHEAD, f"the time of the scans is {ahead:.1f} s ahead")
            return False, early if self._implausible >= tolerances.in_a_row else None
        if scan.stamp <= self._newest or scan.stamp < self.since:
            return False, None
        self._newest = scan.stamp
        found = _without_ranges(scan, tolerances.zero_share)
        self._implausible = self._implausible + 1 if found else 0
        same = self._sameness.seconds(scan_fingerprint(scan.ranges), scan.stamp)
        if found:
            return False, found if self._implausible >= tolerances.in_a_row else None
        if same >= tolerances.frozen - 1e-9:
            return False, Finding(FROZEN, f"exactly the same scan has come again for {same:.2f} s")
        return same == 0.0, None


def _without_ranges(scan: LaserScan, most_zeros: float) -> Finding | None:
    ranges = scan.ranges
    # A range that is no number is none, so it counts as a zero.
    zeros = float(np.mean(~(ranges >= scan.range_min) | (ranges == 0.0))) if len(ranges) else 1.0
    if zeros >= most_zeros:
        return Finding(ZEROS, f"{zeros:.0%} of the ranges are 0 or below the least that the lidar measures")
    if not (np.isfinite(ranges) & (ranges <= scan.range_max)).any():
        return Finding(EMPTY, "no beam comes back")
    return None
