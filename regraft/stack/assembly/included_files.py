"""Reads a file and all that it includes, in the order in which they apply."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.document import DEEPEST, MAX_NODES, read_map
from regraft.stack.yaml.nodes import Location, Node, size_of
from regraft.stack.yaml.path_hints import instead_of_path
from regraft.stack.yaml.problems import Report, StackError, fail

INCLUDE = "include"


@dataclass(slots=True)
class IncludedFiles:
    """The files of a stack: each is read once. ``folders`` are theirs, in the order in which they were read."""

    report: Report
    folders: dict[Path, None] = field(default_factory=dict)
    _documents: dict[Path, Node] = field(default_factory=dict)
    _size: int = 0

    def patches(self, file: Path, known: Collection[str] = ()) -> list[Node]:
        """Return the maps of a file and its includes without ``include``: each applies over those before it.

        A file that is included several times applies once, where it is first. Fields that are not ``known``, if any
        are, are noted. Raises StackError if the file itself cannot be read, or all are too large together.
        """
        found: dict[Path, Node] = {}
        self._read(file, (), found, known)
        return list(found.values())

    def target(self, node: Node, path: str, inside: str = "", instead: str = "") -> Path | None:
        """Return the file that a field names; None, and noted, if there is none.

        It is looked for from the folder of the file that names it. ``inside`` is the file that is meant by a folder.
        ``instead`` ends the note where no path is near.
        """
        if not isinstance(node.value, str) or not node.value:
            self.report.add_at(node.location, path, f"must be the path of a file, is {node.kind}")
            return None
        try:
            file = _beside(node.location, node.value)
            if inside and file.is_dir():
                file = file / inside
            if file.is_file():
                return file
            missing = f"there is no such file{instead_of_path(file) or instead}"
            problem = "is not an ordinary file" if file.exists() else missing
        except (OSError, ValueError) as error:
            problem = f"cannot be read: {getattr(error, 'strerror', None) or error}"
        self.report.add_at(node.location, path, f"{node.value!r}: {problem}")
        return None

    def _read(self, file: Path, chain: tuple[Path, ...], found: dict[Path, Node], known: Collection[str]) -> None:
        identity = Path(os.path.realpath(file))  # Path.resolve() raises an error at a circle of links
        document = self._document(file, identity)
        assert isinstance(document.value, dict)
        fields = dict(document.value)
        include = fields.pop(INCLUDE, None)
        for key in fields if known else ():
            if key not in known:
                hint = instead_of(key, known)
                self.report.add_at(fields[key].location, key, f"there is no such field; {hint}")
        if include is not None:
            self._include(include, (*chain, file), found, known)
        found[identity] = Node(
            {key: part for key, part in fields.items() if not known or key in known}, document.location
        )

    def _document(self, file: Path, identity: Path) -> Node:
        if identity not in self._documents:
            document = read_map(file)
            self._size += size_of(document)
            if self._size > MAX_NODES:
                fail(str(file), None, f"the stack holds more than {MAX_NODES} values with this file")
            self._documents[identity] = document
            self.folders[identity.parent] = None
        return self._documents[identity]

    def _include(self, include: Node, chain: tuple[Path, ...], found: dict[Path, Node], known: Collection[str]) -> None:
        if not isinstance(include.value, tuple):
            self.report.add_at(include.location, INCLUDE, f"must be a list of files, is {include.kind}")
            return
        for index, entry in enumerate(include.value):
            path = f"{INCLUDE}.{index}"
            file = self.target(entry, path)
            if file is None or file.resolve() in found:
                continue
            if any(file.resolve() == other.resolve() for other in chain):
                names = " > ".join(map(str, (*chain, file)))
                self.report.add_at(entry.location, path, f"{entry.value!r} includes itself: {names}")
            elif len(chain) > DEEPEST:
                self.report.add_at(entry.location, path, f"is included too deeply: at most {DEEPEST} levels")
            else:
                self._read_included(file, chain, found, known)

    def _read_included(
        self, file: Path, chain: tuple[Path, ...], found: dict[Path, Node], known: Collection[str]
    ) -> None:
        try:
            self._read(file, chain, found, known)
        except StackError as error:
            self.report.problems += error.problems


def _beside(location: Location, named: str) -> Path:
    """Return a path as it is shown: from the current folder, if that is how the file that names it is shown."""
    path = Path(os.path.normpath(location.folder / named))
    if not Path(location.file).is_absolute() and path.is_relative_to(Path.cwd()):
        return path.relative_to(Path.cwd())
    return path
