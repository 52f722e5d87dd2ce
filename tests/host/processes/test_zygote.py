"""The process that starts all others."""

from __future__ import annotations

import os
import queue
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from regraft.host.zygote.zygote import start_zygote
from tests.support.waiting import PATIENCE

CHILDREN = 30


def _order_and_end(log: str, answer: int) -> None:
    """Start children and ask each to end as soon as it is reported; notes how many ended so."""
    zygote, told = start_zygote(), queue.SimpleQueue[dict[str, Any]]()
    threading.Thread(target=zygote.reports, args=(told.put,), daemon=True).start()
    codes = []
    for number in range(CHILDREN):
        zygote.spawn({"system": "s", "name": "p", "class": "", "incarnation": number}, "/", log, ["sleep", "1000"])
        pid = told.get(timeout=PATIENCE)["started"]
        zygote.signal(pid, signal.SIGTERM)
        try:
            codes.append(told.get(timeout=5.0)["code"])
        except queue.Empty:
            zygote.signal(pid, signal.SIGKILL)
            codes.append(told.get(timeout=PATIENCE)["code"])
    zygote.close()
    os.write(answer, bytes([codes.count(-signal.SIGTERM)]))


@pytest.mark.slow
def test_a_child_that_is_asked_to_end_as_it_is_started_does(tmp_path: Path) -> None:
    asked, answer = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            _order_and_end(str(tmp_path / "log"), answer)
        finally:
            os._exit(0)
    os.close(answer)
    with os.fdopen(asked, "rb") as told:
        found = told.read()
    os.waitpid(pid, 0)
    assert found == bytes([CHILDREN])
