"""Writes files that are there as a whole, or as they were before: no reader finds a half, no full disk leaves one."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> None:
    """Write a file; raises OSError, and then leaves what was there.

    The content is on the disk before it takes the place of the old one: also a loss of power leaves one of both.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with partial.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise
