"""Where the robot was when a scan was taken: by the odometry alone, or by matching the scan with the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from regraft.planar import Pose2D, wrap_angle
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.matcher import Match, match
from regraft.services.mapper.matching.search import search_near
from regraft.services.mapper.matching.surface import Surface

MIN_ECHOES = 10
"""Fewest echoes of a scan that is of any use."""
MIN_EXPECTED = 25
"""Matched echoes on known ground that it takes to correct a pose."""
NEAR, NEAR_TURN = 0.3, 0.36
"""m and rad around the guess that are searched when matching from it fails."""
CERTAIN = 0.8
"""Inlier ratio that a pose found by searching must have."""
SURFACE_FOR = 5
"""Scans for which the surfaces are used that were found once, ..."""
YOUNG = 20
"""... but for the first so many scans, in which the map becomes dense."""
SURFACE_BEYOND = 0.5
"""m beyond the lidar's reach in which surfaces are looked for: the robot continues while they are used."""
KEPT_BEYOND = 20.0
"""m beyond the lidar's reach in which surfaces are looked for that are kept."""
LOST_TIMEOUT = 5
"""Misfits in a row after which the robot is lost."""


@dataclass(frozen=True, slots=True)
class Limits:
    """When a match is believed: its least inlier ratio, and how far (m, rad) it may be from the guess."""

    ratio: float = 0.6
    distance: float = 0.25
    turn: float = 0.35


@dataclass(frozen=True, slots=True)
class Fix:
    """Where the robot was, and whether the scan fits the map there, so that it may be written into it.

    ``match`` is None where the map does not yet determine where the robot is, or is not used.
    """

    pose: Pose2D
    fits: bool
    match: Match | None = None


class Localizer(Protocol):
    """Reports where the robot was."""

    limits: Limits

    @property
    def lost(self) -> bool:
        """Whether the scans have not fitted the map for some time."""

    def locate(self, grid: Grid, scan: Scan, guess: Pose2D) -> Fix:
        """Return where the robot was at a scan, by the odometry at ``guess`` (map frame)."""

    def forget(self) -> None:
        """Begin again: the map is another one."""


class TrustingLocalizer:
    """Believes the odometry."""

    def __init__(self) -> None:
        self.limits = Limits()

    @property
    def lost(self) -> bool:
        """False: this localizer does not match scans, so it cannot notice a loss."""
        return False

    def locate(self, grid: Grid, scan: Scan, guess: Pose2D) -> Fix:
        """Return the guess."""
        return Fix(guess, bool(scan.echoed.sum() >= MIN_ECHOES))

    def forget(self) -> None:
        """Nothing is remembered."""


class MatchingLocalizer:
    """Matches every scan with the map; searches nearby when that fails."""

    def __init__(self, keeps_surfaces: bool = False) -> None:
        """Begin without a map.

        ``keeps_surfaces`` finds the surfaces once, of a large part of the map, for the map must not change until
        `forget`.
        """
        self.limits = Limits()
        self._keeps_surfaces = keeps_surfaces
        self.forget()

    def forget(self) -> None:
        """Begin again: the map is another one."""
        self._surface: Surface | None = None
        self._found_at, self._reach = Pose2D(), 0.0
        self._age = 0
        self._scans = 0
        self._misfits = 0

    @property
    def lost(self) -> bool:
        """Whether the scans have not fitted the map for some time."""
        return self._misfits >= LOST_TIMEOUT

    def locate(self, grid: Grid, scan: Scan, guess: Pose2D) -> Fix:
        """Return where the scan fits the map, near the guess; the guess where it fits nowhere."""
        echoes = scan.points()
        if len(echoes) < MIN_ECHOES:
            return Fix(guess, False)
        surface = self._surface_around(grid, scan, guess)
        found = match(surface, echoes, guess)
        if found.expected < MIN_EXPECTED:
            # New ground, nothing to compare with; but who was lost is not found by leaving the map.
            return Fix(guess, not self._misfits)
        if self._is_believed(found, guess):
            self._misfits = 0
            return Fix(found.pose, True, found)
        elsewhere = self._search(surface, grid, scan, guess)
        if elsewhere and elsewhere.inliers >= MIN_EXPECTED and elsewhere.ratio >= CERTAIN:
            self._misfits = 0
            return Fix(elsewhere.pose, True, elsewhere)
        self._misfits += 1
        return Fix(guess, False, found)

    def _is_believed(self, found: Match, guess: Pose2D) -> bool:
        near = guess.distance(found.pose) <= self.limits.distance
        turned = abs(wrap_angle(found.pose.yaw - guess.yaw)) <= self.limits.turn
        return near and turned and found.inliers >= MIN_EXPECTED and found.ratio >= self.limits.ratio

    def _search(self, surface: Surface, grid: Grid, scan: Scan, guess: Pose2D) -> Match | None:
        window = surface.window
        if self._keeps_surfaces:
            window = grid.window(guess.x, guess.y, scan.range_max + SURFACE_BEYOND)
        return search_near(surface, window, scan.points(), guess, NEAR, NEAR_TURN)

    def _surface_around(self, grid: Grid, scan: Scan, guess: Pose2D) -> Surface:
        self._age += 1
        self._scans += 1
        surface = self._surface
        if surface is None or self._is_outdated(scan, guess):
            self._reach = scan.range_max + (KEPT_BEYOND if self._keeps_surfaces else SURFACE_BEYOND)
            surface = self._surface = Surface.of(grid.window(guess.x, guess.y, self._reach))
            self._age, self._found_at = 0, guess
        return surface

    def _is_outdated(self, scan: Scan, guess: Pose2D) -> bool:
        if self._keeps_surfaces:
            moved = max(abs(guess.x - self._found_at.x), abs(guess.y - self._found_at.y))
            return moved + scan.range_max + SURFACE_BEYOND > self._reach
        return self._age >= SURFACE_FOR or self._scans <= YOUNG or self._misfits > 0
