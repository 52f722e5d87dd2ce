"""The work of ``up`` while the system runs: it shows what happens, and ends the system when its time is over."""

from __future__ import annotations

import time
from dataclasses import replace

from regraft import run_directory
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.cli.system.causes import CauseLog
from regraft.cli.system.closing import Closing, SummaryAsked, plain_summary, summary_services
from regraft.cli.system.display import Display, event_line, status_line
from regraft.cli.system.watch import Watch
from regraft.cli.terminal.output import seconds
from regraft.host.supervisor import ZYGOTE_GONE
from regraft.patience import Patience
from regraft.system.launch import Running

TRANSITION = "component.transition"
SETTLED_TIMEOUT = 0.5
"""Seconds after which transitions are no longer those of the start."""
LOOK_INTERVAL = 0.05
"""Seconds between two looks at the system: the host has better things to do than to be looked at."""
SHOW_INTERVAL = 0.25
LAST_STATUS_TIMEOUT = 1.0
"""Seconds after the end of simulated time in which components may still report that they came up."""
PROGRESS_INTERVAL = 1.0
SAY_WHY_TIMEOUT = 10.0
"""Seconds after which slow start-up names what it waits for; and again after as many more."""
START_TIMEOUT = 60.0
"""Seconds after which a run of limited duration counts its time although not everything is up.

It need not wait so long for what does not come up by itself.
"""


class Run:
    """One run of a system as the command that started it sees it; ``step`` is called again and again."""

    def __init__(self, display: Display, duration: float | None) -> None:
        """Show it on ``display``; end it after ``duration`` seconds of the system's time, None for never."""
        self.closing: Closing | None = None
        self.healthy = True
        self._display = display
        self._duration = duration
        self._started = time.monotonic()
        self._watch: Watch | None = None
        self._causes = CauseLog()
        self._up_at: float | None = None
        self._counting_from: float | None = None
        self._ready_shown = -1
        self._next_look = self._next_show = self._next_progress = 0.0
        self._next_why = self._started + SAY_WHY_TIMEOUT
        self._url: str | None = None
        self._last_statuses: Patience | None = None
        self._asked: SummaryAsked | None = None
        self._stopping_shown = False

    def step(self, running: Running) -> None:
        """Look at the system if it is time to, show news, and end it when its time is over."""
        now = time.monotonic()
        if now < self._next_look and not running.ending.wanted and not running.host.ended:
            return
        self._next_look = now + LOOK_INTERVAL
        watch = self._watch
        if watch is None:
            watch = self._watch = Watch(running)
            self._say_where(running)
        for event in watch.take():
            if not running.ending.wanted:
                self._causes.take(event)
            # While the system starts, everybody's transitions are what the progress sums up.
            if event.kind != TRANSITION or self._has_settled():
                self._display.line(event_line(event, watch.clock()))
        if self._up_at is None:
            self._show_start(watch, now)
        if now >= self._next_show:
            self._next_show = now + SHOW_INTERVAL
            self._look_for_gateway(watch, running)
            self._show_status(watch, now)
        self._end_if_over(watch, running, now)
        self.closing = self._close(watch, running)
        self.healthy = not self.closing.problems
        if running.ending.wanted:
            self._say_ending()

    def _has_settled(self) -> bool:
        return self._up_at is not None and time.monotonic() - self._up_at > SETTLED_TIMEOUT

    def end(self) -> None:
        """Show nothing any more."""
        if self._watch is not None:
            self._say_ending()
        self._display.close()

    def _say_where(self, running: Running) -> None:
        info = running.info
        logs = run_directory.folder(info.system) / "logs"
        self._display.line(f"system {info.system} from {info.stack}; logs in {logs}; see 'regraft ps'")
        for notice in running.notices:
            self._display.line(notice)
        if len(running.host.plan.architecture.hosts) > 1 or info.join != info.endpoint:
            self._display.line(f"other hosts join by: regraft host --join {info.join} --name NAME")

    def _say_ending(self) -> None:
        if not self._stopping_shown:
            self._stopping_shown = True
            self._display.line("ending ...")

    # --- starting ---

    def _show_start(self, watch: Watch, now: float) -> None:
        readiness = watch.readiness()
        took = now - self._started
        if readiness.complete:
            self._up_at = self._counting_from = now
            self._display.line(f"all {readiness.total} components active after {seconds(took)}")
            return
        if readiness.ready != self._ready_shown and now >= self._next_progress:
            self._ready_shown, self._next_progress = readiness.ready, now + PROGRESS_INTERVAL
            self._display.line(f"{readiness.ready} of {readiness.total} components active")
        if now >= self._next_why:
            self._next_why = now + SAY_WHY_TIMEOUT
            self._display.line(f"after {seconds(took)} still waiting for {readiness.reasons()}")
        given_up = readiness.waiting.keys() <= watch.given_up()
        if self._counting_from is None and (given_up or took >= START_TIMEOUT):
            self._counting_from = now

    def _look_for_gateway(self, watch: Watch, running: Running) -> None:
        url = watch.url()
        if url is None or url == self._url:
            return
        self._url = url
        self._display.line(f"gateway at {url}")
        running.info = replace(running.info, gateway=url)
        try:
            run_directory.write_info(running.info)
        except run_directory.NoRoom as error:
            self._display.line(str(error))

    def _show_status(self, watch: Watch, now: float) -> None:
        if self._up_at is not None:
            text = status_line(watch.clock(), watch.missions(), watch.batteries(), now - self._up_at)
            self._display.status(text)

    # --- ending ---

    def _end_if_over(self, watch: Watch, running: Running, now: float) -> None:
        if self._duration is None:
            return
        if self._asked is not None:
            if self._asked.done:
                running.ending.want()
            return
        if self._is_over(watch, running, now):
            services = summary_services(running.host.plan.architecture)
            if services:
                self._asked = SummaryAsked(running, services)
            else:
                running.ending.want()

    def _is_over(self, watch: Watch, running: Running, now: float) -> bool:
        if running.info.simulated:
            if running.host.plan.source in watch.given_up():
                return True
            clock = watch.clock()
            if clock is None or not clock.finished:
                return False
            if self._last_statuses is None:
                self._last_statuses = Patience(LAST_STATUS_TIMEOUT)
            return self._up_at is not None or self._last_statuses.is_over()
        assert self._duration is not None
        return self._counting_from is not None and now - self._counting_from >= self._duration

    def _close(self, watch: Watch, running: Running) -> Closing:
        clock = watch.clock() if running.info.simulated else None
        summary = plain_summary(self._asked.summaries if self._asked else {})
        return Closing(
            running.info.system,
            clock.time / 1e9 if clock else None,
            self._wall(clock),
            None if self._up_at is None else self._up_at - self._started,
            watch.renderer(),
            clock.reproducible if clock else None,
            clock.dropped if clock else (),
            sum(process.restarts for process in watch.processes()),
            self._causes.with_clock(clock.causes if clock else ()),
            tuple(self._problems(watch, running)),
            summary,
        )

    def _wall(self, clock: ClockTime | None) -> float:
        if clock:
            return clock.wall
        return 0.0 if self._counting_from is None else time.monotonic() - self._counting_from

    def _problems(self, watch: Watch, running: Running) -> list[str]:
        problems = [ZYGOTE_GONE] if running.host.ended else []
        problems += [f"{name} is quarantined" for name in watch.quarantined()]
        source = running.host.plan.source or ""
        status = watch.statuses.get(source)
        if status is not None and status.failure and source in watch.given_up():
            problems.append(f"{source} has failed: {status.failure}")
        if self._up_at is None and self._duration is not None:
            problems.append(f"never came up: {watch.readiness().reasons()}")
        if self._asked is not None and self._asked.problem:
            problems.append(f"no summary: {self._asked.problem}")
        return problems
