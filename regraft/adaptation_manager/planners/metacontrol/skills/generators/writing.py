"""Writes the generated files: all of them, or none."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.generators.observed_components import observed_components
from regraft.adaptation_manager.planners.metacontrol.skills.generators.observed_qualities import observed_qualities
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.generators.rdf_lines import PUBLISHED, Namespaces
from regraft.adaptation_manager.planners.metacontrol.skills.generators.system_modes import system_modes
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet
from regraft.whole_files import write_whole

SYSTEM_MODES: Final = "system_modes.yaml"
OBSERVED_COMPONENTS: Final = "observed_components.yaml"
OBSERVED_QUALITIES: Final = "observed_qualities.yaml"
INDIVIDUALS: Final = "individuals.owl"
TEMPORARY: Final = ".regraft-skills-"


def generated(skills: SkillSet, namespaces: Namespaces = PUBLISHED, one_system: str = "") -> dict[str, str]:
    """Return the text of each file by its name."""
    return {
        SYSTEM_MODES: system_modes(skills, one_system),
        OBSERVED_COMPONENTS: observed_components(skills),
        OBSERVED_QUALITIES: observed_qualities(skills),
        INDIVIDUALS: individuals(skills, namespaces).text,
    }


def write_files(files: Mapping[str, str], folder: Path) -> None:
    """Write files into a folder, which is made if it is not there. Raises OSError, and then leaves what was there."""
    is_new = not folder.exists()
    if is_new:
        folder.parent.mkdir(parents=True, exist_ok=True)
    # In the same file system as what it replaces, so that renaming is enough.
    made = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=folder.parent if is_new else folder))
    try:
        for name, text in files.items():
            write_whole(made / name, text.encode())
        if is_new:
            made.chmod(0o777 & ~_umask())
            made.rename(folder)
        else:
            _replace(made, folder, tuple(files))
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _replace(made: Path, folder: Path, names: tuple[str, ...]) -> None:
    """Move files into a folder; if one cannot be, those before it come back."""
    kept = made / "kept"
    kept.mkdir()
    done: list[str] = []
    try:
        for name in names:
            if (folder / name).is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(folder / name))
            if (folder / name).exists():
                os.link(folder / name, kept / name)
            (made / name).replace(folder / name)
            done.append(name)
    except OSError:
        for name in done:
            if (kept / name).exists():
                (kept / name).replace(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
