"""The secret of a system: every session on its bus proves with it that it belongs there.

Each run has a fresh one, readable by its user alone. Hosts on other machines need one that both sides have beforehand:
a file, like a private key.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import stat
from pathlib import Path

FILE = "bus.secret"
"""The name of the file in a folder of certificates."""
SHAPE = re.compile(r"[A-Za-z0-9_-]{16,256}")


class BadSecret(Exception):
    """A file holds no usable secret; the text states what would be right."""


def fresh() -> str:
    """Return a new secret of 256 bits."""
    return secrets.token_urlsafe(32)


def read(file: Path) -> str:
    """Return the secret in a file; raises BadSecret."""
    try:
        with file.open("rb") as opened:
            mode = os.fstat(opened.fileno()).st_mode
            text = opened.read(1024).decode("ascii", "replace").strip()
    except OSError as error:
        raise BadSecret(f"cannot read the secret {file}: {error.strerror}") from None
    if stat.S_IMODE(mode) & 0o077:
        raise BadSecret(f"other users may read the secret {file}: 'chmod 600 {file}', or make a new one")
    if not SHAPE.fullmatch(text):
        raise BadSecret(f"{file} holds no secret: must be 16 to 256 letters, digits, '_' or '-', on one line")
    return text


def make(file: Path) -> bool:
    """Write a fresh secret to a file that is not there yet; returns whether it did. Raises BadSecret."""
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return False
    except OSError as error:
        raise BadSecret(f"cannot write the secret {file}: {error.strerror}") from None
    try:
        with os.fdopen(descriptor, "w") as out:
            out.write(fresh() + "\n")
    except OSError as error:
        with contextlib.suppress(OSError):
            file.unlink()
        raise BadSecret(f"cannot write the secret {file}: {error.strerror}") from None
    return True
