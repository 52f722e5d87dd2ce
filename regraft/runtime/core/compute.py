"""Heavy work of a component, done on one thread next to its loop."""

from __future__ import annotations

from collections.abc import Callable
from concurrent import futures
from typing import Any, TypeVar

from regraft.component.future import Future

R = TypeVar("R")


class Compute:
    """The heavy work of one component. One thread does it, so that results come in the order of the requests.

    Attributes:
        under_way: the number of results that are still to come.
    """

    def __init__(self, post: Callable[[Callable[[], object]], None]) -> None:
        self.under_way = 0
        self._post = post
        self._executor: futures.ThreadPoolExecutor | None = None

    def submit(self, function: Callable[..., R], *arguments: Any) -> Future[R]:
        """Start the work, and return the future of its result."""
        result: Future[R] = Future()
        self.under_way += 1
        if self._executor is None:
            self._executor = futures.ThreadPoolExecutor(1, thread_name_prefix="compute")
        work = self._executor.submit(function, *arguments)
        work.add_done_callback(lambda done: self._post(lambda: self._take(result, done)))
        return result

    def _take(self, result: Future[R], done: futures.Future[R]) -> None:
        self.under_way -= 1
        error = done.exception()
        if error is not None:
            result.fail(error)
        else:
            result.resolve(done.result())

    def close(self) -> None:
        """Cancel what has not begun."""
        if self._executor is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
