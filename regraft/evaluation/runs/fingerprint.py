"""The fingerprint of a run: hashes and versions of all that can influence it, the same on any machine.

`code_hash` covers ``regraft`` and ``behavior_tree`` with their data files. It covers the packages that extend them by
entry points, and those of which a stack names classes. A change that happens to alter no run counts too: nothing can
know that beforehand.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import PackageNotFoundError, entry_points, packages_distributions, requires, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from regraft.evaluation.runs.folder_lock import LOCK
from regraft.process.own_python import INSTALLED_IN

OWN: Final = ("behavior_tree", "regraft")
EXTENSIONS: Final = "regraft."
"""How the groups of entry points begin by which other packages extend Regraft."""
NEEDED: Final = re.compile(r"(?P<name>[\w.-]+)(?:.*\bextra == \"(?P<extra>[\w-]+)\")?")
"""A requirement of a distribution, and the extra that it is of, if any."""
NOT_OF_RUNS: Final = ("dev", "docs")
"""Regraft's extras for those who change it: no run depends on a linter."""
RENDERER: Final = "REGRAFT_RENDERER"
COMPILED: Final = (".pyc", ".pyo")
NOT_RUN: Final = (".md",)
"""Documents: they lie next to code, and are not installed."""
CLASS: Final = re.compile(r"([A-Za-z_]\w*)(?:\.\w+)*:[A-Za-z_]\w*")
"""``module:Class`` in a stack; the group is the package."""
SHOWN: Final = 12
"""Digits of a hash that are shown to people."""


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """All that a run is made of, by part.

    ``code``, ``stack`` and ``files`` (next to the stack file: missions, decisions) are hashes; ``dependencies`` are
    `versions`.
    """

    code: str
    dependencies: Mapping[str, str]
    stack: str
    files: str
    seed: int
    seconds: float

    def plain(self) -> dict[str, Any]:
        """Return it as plain data, by part."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def differences(self, now: Fingerprint) -> list[str]:
        """Return how a later one differs from this one, a text for each part."""
        found = []
        for part, then in self.plain().items():
            present = getattr(now, part)
            if then == present:
                continue
            if part == "dependencies":
                found.append(f"other dependencies ({_versions_differ(self.dependencies, now.dependencies)})")
            elif isinstance(then, str):
                found.append(f"other {part} (hash {then[:SHOWN]} then, {present[:SHOWN]} now)")
            else:
                found.append(f"other {part} ({then:g} then, {present:g} now)")
        return found


def fingerprint_from(plain: Any) -> Fingerprint | None:
    """Return a fingerprint from plain data, None if it is none."""
    try:
        return Fingerprint(**plain)
    except TypeError:
        return None


def _versions_differ(then: Mapping[str, str], now: Mapping[str, str]) -> str:
    names = [name for name in sorted(then.keys() | now.keys()) if then.get(name) != now.get(name)]
    return "; ".join(f"{name} {then.get(name, 'none')} then, {now.get(name, 'none')} now" for name in names)


def versions(packages: Sequence[str] = ()) -> Mapping[str, str]:
    """Return the versions of what has a part in a run, by name; what is not installed has none.

    These are what Regraft itself requires, and the distributions of packages that extend it or that a stack names
    (``packages``). Their own requirements are not among them.
    """
    found = {
        "Python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "renderer": os.environ.get(RENDERER, "") or "chosen by the run",
    }
    for name in (*_requirements(), *_distributions_of({*_extending(), *packages} - {*OWN})):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def _requirements() -> Iterator[str]:
    """Return the distributions that Regraft requires, with those of its extras."""
    own = OWN[-1]
    try:
        needed = requires(own) or []
    except PackageNotFoundError:
        needed = []
    for match in filter(None, map(NEEDED.match, needed)):
        if match["name"] != own and match["extra"] not in NOT_OF_RUNS:
            yield match["name"]


def _distributions_of(packages: Collection[str]) -> list[str]:
    """Return the distributions that packages are from."""
    known = _distributions(tuple(sys.path)) if packages else {}
    return sorted({name for package in packages for name in known.get(package, ())})


@cache
def _distributions(path: tuple[str, ...]) -> Mapping[str, Sequence[str]]:
    """Return the distributions by package. To look takes longer than all else, and a campaign asks for each run."""
    return packages_distributions()


def _processor() -> str:
    """Return the processor's model, which may round otherwise than others."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or "unknown")


def code_hash(packages: Sequence[str] = ()) -> str:
    """Return the hash of the code that can influence a run; ``packages`` are those of others that a stack names."""
    digest = hashlib.sha256()
    for package in sorted({*OWN, *_extending(), *packages}):
        for root, path in _files_of(package):
            _add(digest, f"{package}/{path.relative_to(root).as_posix()}", path.read_bytes())
    return digest.hexdigest()


def _extending() -> set[str]:
    """Return the packages that extend Regraft, itself included."""
    return {
        entry.module.partition(".")[0]
        for group in entry_points().groups
        if group.startswith(EXTENSIONS)
        for entry in entry_points(group=group)
    }


def _files_of(package: str) -> Iterator[tuple[Path, Path]]:
    """Return the files of a package, or of a single module, each with the folder that it is in."""
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):
        return
    if spec is None:
        return
    if spec.submodule_search_locations is None:
        if spec.origin is not None and Path(spec.origin).is_file():
            yield Path(spec.origin).parent, Path(spec.origin)
        return
    for folder in sorted(spec.submodule_search_locations):
        for path in files_in(Path(folder)):
            yield Path(folder), path


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder and its folders that can influence a run, by name."""
    found = []
    # A campaign asks before and after each run, for thousands of files: paths are made of the few that count.
    for inside, names in _folders_in(folder):
        found += [
            os.path.join(inside, name)
            for name in names
            if not name.startswith(".") and os.path.splitext(name)[1] not in (*COMPILED, *NOT_RUN)
        ]
    return [Path(path) for path in sorted(found, key=lambda path: path.split(os.sep)) if os.path.isfile(path)]


def _folders_in(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """Return a folder and those in it, also behind links, each with its files' names. Hidden ones are left out."""
    for inside, folders, names in os.walk(folder, followlinks=True):
        folders[:] = [name for name in folders if not name.startswith(".") and not leads_back(folder, inside, name)]
        yield inside, names


def leads_back(folder: Path, inside: str, name: str) -> bool:
    """Return whether a link leads to a folder that it is in, by the way from ``folder`` to it."""
    link = os.path.join(inside, name)
    if not os.path.islink(link):
        return False
    target, place = Path(link).resolve(), Path(inside)
    way = [place, *(each for each in place.parents if each.is_relative_to(folder))]
    return any(each.resolve().is_relative_to(target) for each in way)


def files_hash(folder: Path) -> str:
    """Return the hash of a stack's folder: of all that a run takes along, and its modules; not of campaigns in it."""
    digest = hashlib.sha256()
    campaigns = [Path(inside) for inside, names in _folders_in(folder) if LOCK in names]
    for path in files_in(folder):
        if any(path.is_relative_to(campaign) for campaign in campaigns):
            continue
        _add(digest, path.relative_to(folder).as_posix(), path.read_bytes())
    return digest.hexdigest()


def stack_hash(document: Mapping[str, Any], folder: Path) -> str:
    """Return the hash of a stack in ``folder``, as one document. A file elsewhere counts by its content."""
    plain = json.dumps(_portable(document, folder), sort_keys=True)
    return hashlib.sha256(plain.encode()).hexdigest()


def packages_named(document: Any) -> Sequence[str]:
    """Return the packages of others that a stack names classes of."""
    found = {match[1] for text in _texts(document) if (match := CLASS.fullmatch(text))}
    return tuple(sorted(found - set(OWN)))


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for part in value.values():
            yield from _texts(part)
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _texts(part)


def is_own_code(path: Path) -> bool:
    """Return whether `code_hash` covers a file because it is Regraft's own; a clone has other files, too."""
    return any(path.is_relative_to(INSTALLED_IN / package) for package in OWN)


def is_taken_along(path: Path, folder: Path) -> bool:
    """Return whether a run's copy of the stack's ``folder`` has a path: what is hidden stays where it is."""
    return path.is_relative_to(folder) and not any(part.startswith(".") for part in path.relative_to(folder).parts)


def _portable(value: Any, folder: Path) -> Any:
    """Return plain data with nothing of where this machine has its files."""
    if isinstance(value, Mapping):
        return {name: _portable(part, folder) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_portable(part, folder) for part in value]
    if not (isinstance(value, str) and os.path.isabs(value)):
        return value
    path = Path(value)
    if is_taken_along(path, folder):
        return ["stack", path.relative_to(folder).as_posix()]
    if is_own_code(path):
        return ["installed", path.relative_to(INSTALLED_IN).as_posix()]
    return ["content", hashlib.sha256(path.read_bytes()).hexdigest()] if path.is_file() else value


def _add(digest: Any, name: str, content: bytes) -> None:
    digest.update(f"{name}\0{len(content)}\0".encode() + content)
