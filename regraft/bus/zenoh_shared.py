"""Large payloads go straight into shared memory: Zenoh, left to itself, copies them once more before that."""

from __future__ import annotations

from typing import Any

import zenoh
import zenoh.shm

from regraft.bus.zenoh_config import SHARED_MEMORY_POOL


class SharedMemory:
    """The pool of one process, made when the first large payload comes. Receivers need nothing of it.

    Where a payload finds no room, or the machine no shared memory, it travels as it is; so it does to another
    machine.
    """

    def __init__(self) -> None:
        self._provider: zenoh.shm.ShmProvider | None = None
        self._policy = zenoh.shm.GarbageCollect()
        self._usable = True

    def place(self, payload: bytes) -> Any:
        """Return what Zenoh is to put for a large payload: its copy in the pool, or the payload itself."""
        if not self._usable:
            return payload
        provider = self._provider or self._make_provider()
        if provider is None:
            return payload
        try:
            # Memory that readers are done with is in the cache; the rest of the pool is not.
            provider.garbage_collect()
            buffer = provider.alloc(len(payload), policy=self._policy)
        except zenoh.ZError:
            return payload
        buffer[0 : len(payload)] = payload
        return buffer

    def _make_provider(self) -> zenoh.shm.ShmProvider | None:
        try:
            self._provider = zenoh.shm.ShmProvider.default_backend(SHARED_MEMORY_POOL)
        except zenoh.ZError:
            self._usable = False
        return self._provider
