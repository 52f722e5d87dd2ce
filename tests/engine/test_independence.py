"""The engine could be published alone."""

import ast
import sys
from pathlib import Path

from services.bt_executor import engine


def imported_modules(path: Path) -> set[str]:
    """Return the top-level names of a file's absolute imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(str(node.module).partition(".")[0])
    return names


def relative_levels(path: Path, folder: Path) -> bool:
    """Tell whether a file's relative imports stay inside a folder."""
    depth = len(path.relative_to(folder).parts)
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return all(node.level <= depth for node in nodes if isinstance(node, ast.ImportFrom))


def test_engine_imports_nothing_but_itself_and_the_standard_library() -> None:
    folder = Path(str(engine.__file__)).parent
    files = list(folder.rglob("*.py"))
    assert len(files) > 30
    for path in files:
        assert imported_modules(path) <= sys.stdlib_module_names, path
        assert relative_levels(path, folder), path
