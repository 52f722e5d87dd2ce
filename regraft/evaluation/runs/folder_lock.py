"""A campaign's hold on its folder: a lock of the kernel, which ends with the process, however that ends."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Final

LOCK: Final = "campaign.lock"
REMEDY: Final = "wait until it ends, or name another --out"


class InUse(ValueError):
    """Another campaign has the folder; the text states which."""


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold a folder, made if need be; its lock file names the process, for those who come later.

    Raises:
        InUse: another campaign has it.
        OSError: it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InUse(f"{folder} is in use by another campaign{_owner(file.name)}: {REMEDY}") from None
        file.truncate(0)
        file.write(json.dumps({"pid": os.getpid(), "since": datetime.now().isoformat(" ", "seconds")}) + "\n")
        file.flush()
        yield


def _owner(path: str) -> str:
    try:
        owner = json.loads(Path(path).read_text())
        return f" (process {owner['pid']}, since {owner['since']})"
    except (OSError, ValueError, KeyError, TypeError):
        return ""
