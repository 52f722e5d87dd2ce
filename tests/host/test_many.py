"""A stack of many components: it ends as soon as it is asked to, and what a machine cannot hold is not begun."""

from __future__ import annotations

import signal

from regraft import run_directory
from tests.host.conftest import Start
from tests.support.waiting import PATIENCE

MANY = 400


def test_what_has_not_started_yet_is_not_started_once_the_end_is_asked_for(start: Start) -> None:
    system = start("".join(f"  sleeper{n}: {{class: 'tests.host.parts:Sleeper'}}\n" for n in range(MANY)))
    system.process.send_signal(signal.SIGINT)
    assert system.process.wait(PATIENCE) == 0
    started = {log.stem for log in (run_directory.folder("tests") / "logs").glob("sleeper*.log")}
    assert len(started) < MANY // 2
