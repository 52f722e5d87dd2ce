"""The library of behaviour trees stands alone: others can use it without the rest of Regraft."""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import behavior_tree
from behavior_tree import SUCCESS
from behavior_tree.examples import thermostat
from tests.support.wheels import wheel_of_the_run

ROOT = Path(behavior_tree.__file__).parent.parent
README = (ROOT / "behavior_tree" / "README.md").read_text(encoding="utf-8")
BOUND = 120.0
ALONE = """\
import runpy, sys
sys.path.insert(0, {wheel!r})
runpy.run_module("behavior_tree.examples.thermostat", run_name="__main__")
loaded = {{name.partition(".")[0] for name in sys.modules}}
assert not loaded & {ours!r}, loaded
assert loaded <= sys.stdlib_module_names | {{"behavior_tree", "__main__"}}, loaded - sys.stdlib_module_names
"""


def imported_modules(path: Path) -> set[str]:
    """Return the top-level names of a file's absolute imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(str(node.module).partition(".")[0])
    return names


def stays_inside(path: Path, folder: Path) -> bool:
    """Tell whether a file's relative imports stay inside a folder."""
    depth = len(path.relative_to(folder).parts)
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return all(node.level <= depth for node in nodes if isinstance(node, ast.ImportFrom))


def test_it_imports_nothing_but_itself_and_the_standard_library() -> None:
    files = list((ROOT / "behavior_tree").rglob("*.py"))
    assert len(files) > 30
    for path in files:
        assert imported_modules(path) <= {*sys.stdlib_module_names, "behavior_tree"}, path
        assert stays_inside(path, ROOT / "behavior_tree"), path


def test_out_of_a_wheel_a_tree_runs_without_anything_else(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with zipfile.ZipFile(wheel_of_the_run(tmp_path_factory)) as archive:
        archive.extractall(tmp_path / "installed")
    script = ALONE.format(wheel=str(tmp_path / "installed"), ours={"regraft"})
    alone = subprocess.run(
        [sys.executable, "-I", "-S", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=BOUND
    )
    assert alone.returncode == 0, alone.stderr
    assert alone.stdout.rstrip() in README


@pytest.mark.parametrize(("wanted", "end"), [(20.0, "  15 s: warm"), (99.0, "  60 s: given up")])
def test_the_example_ends_as_it_says(wanted: float, end: str) -> None:
    out = io.StringIO()
    assert (thermostat.run(wanted, out) == SUCCESS) is end.endswith("warm")
    assert out.getvalue().splitlines()[-1] == end
