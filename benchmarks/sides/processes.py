"""Fresh Python processes that end with the benchmark."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any

END_TIMEOUT = 5.0


class Processes:
    """Processes started one by one, ended together."""

    def __init__(self) -> None:
        self._started: list[SpawnProcess] = []

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    def spawn(self, function: Callable[..., object], *arguments: Any) -> SpawnProcess:
        """Run a function in a fresh process."""
        process = multiprocessing.get_context("spawn").Process(target=function, args=arguments)
        process.start()
        self._started.append(process)
        return process

    def end(self) -> None:
        """End them, by force after a while."""
        for process in self._started:
            process.terminate()
        for process in self._started:
            process.join(END_TIMEOUT)
            if process.is_alive():
                process.kill()
                process.join()
        self._started.clear()
