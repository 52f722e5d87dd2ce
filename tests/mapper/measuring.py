"""Measures where mapper and localizer say that the robot is, in bare corridors and in FROG's rooms.

``python -m tests.mapper.measuring`` prints the table of docs/search.md; ``--seeds 3`` takes fewer drives.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from regraft.planar import Pose2D, wrap_angle
from regraft.services.mapper.mapping import GridSettings, Mapping
from regraft.services.mapper.maps.map_files import FiledMap
from regraft.services.mapper.matching.localizer import MatchingLocalizer
from tests.mapper.drives import IN_SIGHT, OUT_OF_SIGHT, Drive, down_corridor, through_frog

ALONG_ROWS, ASKEW = 0.0, 0.35
"""Headings (rad) of corridors: their walls are straight lines of cells, or stairs."""


@dataclass(frozen=True)
class Errors:
    """How far (m) and by how much (rad) the poses of a drive are off, and how much too far (m) it seems to have led."""

    position: tuple[float, ...]
    heading: tuple[float, ...]
    ahead: float


def errors(drive: Drive, places: list[Pose2D]) -> Errors:
    """Compare the poses of a drive with the truth."""
    truths = [moment.truth for moment in drive.moments]
    pairs = list(zip(places, truths, strict=True))
    position = tuple(place.distance(truth) for place, truth in pairs)
    heading = tuple(abs(wrap_angle(place.yaw - truth.yaw)) for place, truth in pairs)
    start = truths[0]
    return Errors(position, heading, start.distance(places[-1]) - start.distance(truths[-1]))


def mapped(drive: Drive) -> tuple[Errors, FiledMap]:
    """Have the mapper ride along; returns its errors and its map."""
    mapping = Mapping(GridSettings(), MatchingLocalizer())
    found = errors(drive, [moment.ride(mapping) for moment in drive.moments])
    made = mapping.filed()
    assert made is not None
    return found, made


def localized(drive: Drive, given: FiledMap) -> Errors:
    """Have the localizer ride along with a map."""
    mapping = Mapping(GridSettings(), MatchingLocalizer())
    mapping.load(given)
    mapping.updating = False
    return errors(drive, [moment.ride(mapping) for moment in drive.moments])


def trusted(drive: Drive) -> Errors:
    """Believe the odometry."""
    return errors(drive, [moment.odometry for moment in drive.moments])


def line(name: str, found: list[Errors]) -> str:
    """Return a row: mean and greatest error of position and heading, and the greatest error of the way's length."""
    position, heading = [np.array(each.position) for each in found], [np.array(each.heading) for each in found]
    values = [
        f"{np.mean([each.mean() for each in position]):.3f}, {max(each.max() for each in position):.3f}",
        f"{np.mean([each.mean() for each in heading]):.4f}, {max(each.max() for each in heading):.3f}",
        f"{max((each.ahead for each in found), key=abs):+.3f}",
    ]
    return f"| {name} | {' | '.join(values)} |"


def _corridors(name: str, seeds: range, drive: Callable[[int], Drive]) -> None:
    drives = [drive(seed) for seed in seeds]
    print(line(f"{name}, odometry alone", [trusted(each) for each in drives]), flush=True)
    print(line(f"{name}, given map", [localized(each, each.ground) for each in drives]), flush=True)
    print(line(f"{name}, mapping", [mapped(each)[0] for each in drives]), flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="drives of each kind")
    seeds = range(1, parser.parse_args().seeds + 1)
    columns = "position: mean, worst (m) | heading: mean, worst (rad) | distance at the end (m)"
    print(f"| drive | {columns} |\n|---|---|---|---|")
    _corridors("corridor", seeds, lambda seed: down_corridor(seed, OUT_OF_SIGHT, ALONG_ROWS))
    _corridors("corridor with ends", seeds, lambda seed: down_corridor(seed, IN_SIGHT, ALONG_ROWS))
    _corridors("corridor askew", seeds, lambda seed: down_corridor(seed, OUT_OF_SIGHT, ASKEW))
    rooms = [through_frog(seed) for seed in seeds]
    print(line("FROG's room, true map", [localized(room, room.ground) for room in rooms]), flush=True)
    mapping = [mapped(room) for room in rooms]
    print(line("FROG's room, mapping", [found for found, _ in mapping]), flush=True)
    own = [localized(room, made) for room, (_, made) in zip(rooms, mapping, strict=True)]
    print(line("FROG's room, own map", own), flush=True)


if __name__ == "__main__":
    main()
