"""Standard input, output and error as a command finds them: also closed, or on a full disk."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from io import BufferedWriter, FileIO, TextIOWrapper
from typing import TextIO

STANDARD = (0, 1, 2)


class CannotWrite(Exception):
    """Standard output takes nothing; the text states why."""


class _Output(TextIOWrapper):
    """Standard output whose errors are distinguished from those of all other files."""

    def write(self, text: str) -> int:
        """Write; raises CannotWrite, and BrokenPipeError once nobody reads any more."""
        try:
            return super().write(text)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise CannotWrite(_why(error)) from None

    def flush(self) -> None:
        """Write what is kept; raises as ``write`` does."""
        try:
            super().flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise CannotWrite(_why(error)) from None


class _Errors(TextIOWrapper):
    """Standard error: if it takes nothing, an error cannot be shown at all."""

    def write(self, text: str) -> int:
        """Write if that is possible."""
        with suppress(OSError):
            return super().write(text)
        return len(text)

    def flush(self) -> None:
        """Write what is kept if that is possible."""
        with suppress(OSError):
            super().flush()


def _why(error: OSError) -> str:
    reason = "it is closed" if error.errno == errno.EBADF else error.strerror or str(error)
    return f"cannot write to standard output: {reason}"


def prepare() -> None:
    """Give this process all three streams, also if it was started without some."""
    for descriptor in STANDARD:
        _fill(descriptor)
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115
    sys.stdout = _in_place_of(sys.stdout, _Output, os.O_RDONLY)
    sys.stderr = _in_place_of(sys.stderr, _Errors, os.O_WRONLY)


def _fill(descriptor: int) -> None:
    """Open the null device if nothing is open there: a socket in its place would be sent what is printed."""
    try:
        os.fstat(descriptor)
    except OSError:
        os.open(os.devnull, os.O_RDWR)


def _in_place_of(stream: TextIO | None, kind: type[TextIOWrapper], when_closed: int) -> TextIO:
    """Return a stream to the same file; if there is none, to the null device, opened as ``when_closed`` states."""
    if stream is None:
        return kind(BufferedWriter(FileIO(os.open(os.devnull, when_closed), "w")), encoding="utf-8")
    if not isinstance(stream, TextIOWrapper):
        return stream
    return kind(
        stream.buffer,
        encoding=stream.encoding,
        # Others write much of what is shown, in characters that the stream may lack.
        errors="backslashreplace" if stream.errors == "strict" else stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
