"""The pictures of worlds in the docs are what the project draws, with the robots of the stacks."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
import pytest

from regraft.sim_service.picture import main
from regraft.stack import load
from regraft.stack.installed import stack_file
from tests.support.paths import ROOT

pytestmark = pytest.mark.slow

DRAWN = re.compile(r"`python -m regraft\.sim_service\.picture (\S+) (docs/[^\s`]+)([^`]*)`")
COMMANDS = [each for page in sorted((ROOT / "docs").glob("*.md")) for each in DRAWN.findall(page.read_text())]
SEVERAL = [each for each in COMMANDS if "rooms" in each[0]]
LARGEST = 300_000
"""Bytes."""


def drawn(*words: str, to: Path) -> np.ndarray:
    """Return the picture that a command draws."""
    world, *options = words
    assert main([world, str(to), *options]) == 0
    return read(to)


def read(file: Path) -> np.ndarray:
    """Return the picture of a file."""
    picture = cv2.imread(str(file))
    assert picture is not None
    return np.asarray(picture, np.int16)


def test_there_is_a_picture_of_each_example() -> None:
    assert {stack for stack, _, _ in COMMANDS} == {"frog", "demo_two_robots", "frog/rooms.yaml", "patrol"}


@pytest.mark.parametrize(("stack", "file", "options"), [each for each in COMMANDS if each not in SEVERAL])
def test_a_picture_of_the_docs_can_be_drawn_again_and_shows_the_robots(
    stack: str, file: str, options: str, tmp_path: Path
) -> None:
    picture = drawn(stack, *options.split(), to=tmp_path / "again.png")
    shown = read(ROOT / file)
    assert picture.shape == shown.shape
    assert (ROOT / file).stat().st_size < LARGEST
    assert min(picture.std(), shown.std()) > 20
    world = load(stack_file(Path(stack))).architecture.components["world"].parameters["file"]
    view = re.sub(r"--(seed|crowd) \S+", "", options)
    empty = drawn(world, *view.split(), to=tmp_path / "empty.png")
    assert (abs(picture - empty).max(axis=2) > 30).sum() > 100


def test_several_seeds_give_one_picture_of_rooms_that_differ(tmp_path: Path) -> None:
    ((stack, file, options),) = SEVERAL
    picture = drawn(stack, *options.split(), to=tmp_path / "again.png")
    assert picture.shape == read(ROOT / file).shape
    height, width = picture.shape[0] // 2, picture.shape[1] // 2
    rooms = [picture[y : y + height, x : x + width] for y in (0, height) for x in (0, width)]
    assert (ROOT / file).stat().st_size < LARGEST
    for one, other in combinations(rooms, 2):
        assert (abs(one - other).max(axis=2) > 30).mean() > 0.02


def test_a_crowd_is_drawn_where_it_walks(tmp_path: Path) -> None:
    options = ("--seed", "1", "--width", "320", "--height", "160", "--fovy", "31")
    without = drawn("patrol", *options, to=tmp_path / "without.png")
    crowded = drawn("patrol", *options, "--crowd", "crowd", to=tmp_path / "crowded.png")
    rows, columns = np.nonzero(abs(crowded - without).max(axis=2) > 30)
    assert len(rows) > 20
    assert max(rows) < 40, "the crowd is in the corridor that the picture has at its top"
    assert 60 < min(columns) < max(columns) < 240


@pytest.mark.parametrize(("option", "value", "named"), [("--crowd", "crow", "crowd"), ("--fovy", "180", "180")])
def test_a_group_or_a_field_of_view_that_cannot_be_is_refused(
    option: str, value: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["patrol", str(tmp_path / "picture.png"), option, value]) == 1
    assert named in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
