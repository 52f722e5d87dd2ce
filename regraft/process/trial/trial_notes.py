"""Notes of a trial's process for the process that waits for it: in memory that both share.

A module can close every descriptor of its process; shared memory stays.
"""

from __future__ import annotations

import mmap

SIZE = 4096
AT, COPIED, AT_EXIT, RETURNED, FINISHED, TEXT = 0, 4, 5, 6, 7, 8


class Notes:
    """Where the trial is, and the problem that it has found."""

    def __init__(self) -> None:
        """Nothing is noted; make it before the process is forked."""
        self._memory = mmap.mmap(-1, SIZE)

    @property
    def at(self) -> int:
        """The index of the module that is being tried."""
        return int.from_bytes(self._memory[AT : AT + 4], "little")

    @at.setter
    def at(self, index: int) -> None:
        self._memory[AT_EXIT] = 0
        self._memory[AT : AT + 4] = index.to_bytes(4, "little")

    @property
    def copied(self) -> bool:
        """Whether a copy of the trial's process has come back from an import."""
        return bool(self._memory[COPIED])

    def note_copy(self) -> None:
        """Note that this process is such a copy."""
        self._memory[COPIED] = 1

    @property
    def at_exit(self) -> bool:
        """Whether the module has been imported, and what it registers with atexit runs."""
        return bool(self._memory[AT_EXIT])

    def note_exit(self) -> None:
        """Note that this begins."""
        self._memory[AT_EXIT] = 1
        self._memory[RETURNED] = 0

    @property
    def returned(self) -> bool:
        """Whether all of it has returned."""
        return bool(self._memory[RETURNED])

    def note_return(self) -> None:
        """Note that."""
        self._memory[RETURNED] = 1

    @property
    def finished(self) -> bool:
        """Whether all modules have been tried, and nothing is wrong with them."""
        return bool(self._memory[FINISHED])

    def finish(self) -> None:
        """Note that."""
        self._memory[FINISHED] = 1

    @property
    def problem(self) -> str:
        """Why the module cannot be imported, empty if that is not noted."""
        return self._memory[TEXT:].partition(b"\0")[0].decode("utf-8", "ignore")

    def note_problem(self, text: str) -> None:
        """Note it; cut if it is long."""
        told = text.replace("\0", "").encode("utf-8", "backslashreplace")[: SIZE - TEXT - 1]
        self._memory[TEXT : TEXT + len(told)] = told
