"""A campaign: many runs of a study, some at a time, that can be ended and continued at any point.

A run is made in ``work/`` and moved to ``runs/CONFIGURATION/NUMBER`` when it is complete. One that fails and may have
failed because the machine is busy is made again. Failed runs are kept in ``failed/`` and retried when the campaign
continues. ``attempts.csv`` has every attempt.
"""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Final

from regraft.evaluation.runs.attempts import Attempt, AttemptLog, Cause, Outcome, decisive
from regraft.evaluation.runs.fingerprint import SHOWN, code_hash
from regraft.evaluation.runs.folder_lock import InUse, held
from regraft.evaluation.runs.provenance import provenance
from regraft.evaluation.runs.run_directory import BadRun, Plan, complete, fingerprint_of, prepare, read_run, renderer_of
from regraft.evaluation.runs.run_process import RunProcess
from regraft.evaluation.study import Configuration, Failure, Results, RunRecord, Study
from regraft.stack.assembly.assemble import assemble
from regraft.stack.classes import look_in
from regraft.whole_files import write_whole

RUNS, WORK, FAILED, ABOUT = "runs", "work", "failed", "campaign.json"
WHY: Final = "why.txt"
LOOK_INTERVAL: Final = 0.1
MADE_AGAIN_AT_MOST: Final = 2
"""Times that a run is made again because the machine may have made it fail."""


class BadCampaign(ValueError):
    """A campaign that cannot be made so; the text states why, and what would be right."""


class NoRoom(Exception):
    """The campaign's folder cannot be written; the text states why. Finished runs are there."""


class CodeChanged(Exception):
    """Code, stack or versions changed under the campaign; the text states how. Finished runs are there."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A campaign's plan: so many runs of each configuration, from a seed on, of so many simulated seconds.

    With ``one_seed`` all runs have the first seed, and differ only by what the study states that differs in time.
    ``seeds`` are given one by one instead of from a first one on, as many as there are runs.
    """

    study: Study
    definitions: str
    configurations: tuple[Configuration, ...]
    runs: int
    seed: int
    seconds: float
    one_seed: bool = False
    seeds: tuple[int, ...] = ()

    def plans(self) -> list[Plan]:
        """Return the runs: the first of each configuration, then the second of each, and so on."""
        return [self._plan(each, number) for number in range(1, self.runs + 1) for each in self.configurations]

    def _plan(self, configuration: Configuration, number: int) -> Plan:
        seed = self._seed(number)
        changes = [self.study.additions, configuration.changes(seed)]
        if self.one_seed:
            changes.append(self.study.timing_only(number))
        return Plan(
            self.study.name,
            self.definitions,
            configuration,
            number,
            seed,
            self.seconds,
            self.study.stack,
            tuple(changes),
        )

    def _seed(self, number: int) -> int:
        if self.seeds:
            return self.seeds[number - 1]
        return self.seed if self.one_seed else self.seed + number - 1

    def about(self) -> dict[str, object]:
        """Return what must be equal when a campaign is continued; configurations and runs may be added."""
        return {
            "study": self.study.name,
            "definitions": self.definitions,
            "seed": self.seed,
            "seconds": self.seconds,
            "one_seed": self.one_seed,
        }


@dataclass(slots=True)
class Progress:
    """How far a campaign is; ``left`` is the wall-clock time (s) that it will still take, None before that is known."""

    done: int
    failed: int
    total: int
    running: tuple[str, ...] = ()
    left: float | None = None


Tell = Callable[[Progress], None]
Say = Callable[[str], None]


@dataclass(slots=True)
class Campaign:
    """Runs what is wanted into a folder."""

    wanted: Wanted
    folder: Path
    parallel: int = 1
    _total: int = 0
    _todo: list[Plan] = field(default_factory=list)
    _running: list[RunProcess] = field(default_factory=list)
    _began: float = 0.0
    _simulated: float = 0.0
    _failed: int = 0
    _repeats: dict[str, int] = field(default_factory=dict)

    @contextmanager
    def opened(self, *, resume: bool, report_only: bool = False) -> Iterator[None]:
        """Hold the folder, and find out what is still to be run.

        A mere report may be of runs of other code, and of a campaign that is under way.

        Raises:
            BadCampaign: another campaign has the folder; there are runs already and they are not to be continued, or
                they are made of something else; or there is nothing to report.
            StackError: the stack cannot be read.
            NoRoom: the folder cannot be written.
        """
        with ExitStack() as hold:
            if not report_only:
                self._hold(hold)
            self._take(resume=resume, report_only=report_only)
            yield

    def _hold(self, hold: ExitStack) -> None:
        try:
            hold.enter_context(held(self.folder))
        except InUse as error:
            raise BadCampaign(str(error)) from None
        except OSError as error:
            raise _no_room(self.folder, error) from None

    def _take(self, *, resume: bool, report_only: bool) -> None:
        # A run finds the modules of the stack's own as this process does: its copy of the folder has no code.
        for folder in assemble(self.wanted.study.stack).folders:
            look_in(folder)
        about, path = self.wanted.about(), self.folder / ABOUT
        before = _read_about(path)
        if before is None and report_only:
            raise BadCampaign(f"there is no campaign in {self.folder}, and so nothing to report")
        if before is not None and not resume and not report_only:
            raise BadCampaign(f"{self.folder} has a campaign already: continue with --resume, or name another --out")
        if before is not None and before != about:
            other = "; ".join(f"{name} was {before.get(name)}" for name in about if before.get(name) != about[name])
            raise BadCampaign(f"{self.folder} has another campaign ({other}): give the same, or name another --out")
        plans = self.wanted.plans()
        finished = self._last_finished()
        if finished > self.wanted.runs:
            raise BadCampaign(f"{self.folder} has finished runs up to {finished:03}: give --runs {finished}")
        if not report_only:
            self._check_same(self._reported())
        self._total = len(plans)
        self._todo = [plan for plan in plans if not self.home(plan).is_dir()]
        try:
            if before is None:
                write_whole(path, (json.dumps(about, indent=1) + "\n").encode())
            if not report_only:
                self._note_cut_off(plans)
        except OSError as error:
            raise _no_room(self.folder, error) from None

    def _check_same(self, plans: Sequence[Plan]) -> None:
        """Refuse to mix runs: those that are there must be made of what runs are made of now."""
        hash_code, other = cache(code_hash), []
        for plan in plans:
            home = self.home(plan)
            if not home.is_dir():
                continue
            then, now = fingerprint_of(home), plan.fingerprint(hash_code)
            if then is None:
                other.append((home, ["no record of its code"]))
            elif then != now:
                other.append((home, then.differences(now)))
        if other:
            home, how = other[0]
            more = f", and so were {len(other) - 1} others" if len(other) > 1 else ""
            raise BadCampaign(
                f"{home} was made with {' and '.join(how)}{more}: name another --out, or remove what is to be made "
                "again; --report-only reports what is there"
            )

    def _note_cut_off(self, plans: Sequence[Plan]) -> None:
        """Note the attempts that a killed campaign has left, which could not note them itself."""
        for plan in plans:
            if (self.folder / WORK / _in_work(plan)).is_dir():
                AttemptLog(self.folder).add(Attempt(plan.name, plan.seed, "", 0.0, Outcome.INTERRUPTED))
        shutil.rmtree(self.folder / WORK, ignore_errors=True)

    def _last_finished(self) -> int:
        """Return the highest number of a finished run, 0 if there is none."""
        return max((int(home.name) for home in self.folder.glob(f"{RUNS}/*/*") if home.name.isdecimal()), default=0)

    def home(self, plan: Plan) -> Path:
        """Return where a finished run is."""
        return self.folder / RUNS / plan.name

    def run(self, tell: Tell, say: Say) -> None:
        """Run what is still to be run; when this ends, also by an exception, the runs under way end, and leave no
        halves.

        Raises:
            NoRoom: the folder cannot be written.
            CodeChanged: what runs are made of is not what it was when the campaign began.
        """
        self._began = time.monotonic()
        try:
            while self._todo or self._running:
                while self._todo and len(self._running) < self.parallel:
                    self._start(self._todo.pop(0))
                self._look(say)
                tell(self.progress())
                time.sleep(LOOK_INTERVAL)
        except OSError as error:
            raise _no_room(self.folder, error) from None
        finally:
            for process in self._running:
                process.end()
                with suppress(OSError):
                    self._note(process, Outcome.INTERRUPTED)
            with suppress(OSError):
                shutil.rmtree(self.folder / WORK, ignore_errors=True)

    def _start(self, plan: Plan) -> None:
        home = self.folder / WORK / _in_work(plan)
        home.parent.mkdir(parents=True, exist_ok=True)
        made_of = plan.fingerprint()
        file = prepare(plan, home)
        self._running.append(RunProcess(plan, home, file, made_of))

    def _look(self, say: Say) -> None:
        for process in list(self._running):
            if not process.is_over():
                continue
            self._running.remove(process)
            plan = process.plan
            try:
                closing = process.closing()
                self._check_unchanged(process, str(closing.get("renderer") or ""))
                complete(plan, process.home, closing, process.made_of)
                self._keep(process.home, self.home(plan))
            except BadRun as error:
                self._take_failure(process, error, say)
            else:
                self._note(process, Outcome.KEPT)
                self._simulated += plan.seconds
                shutil.rmtree(self.folder / FAILED / plan.name, ignore_errors=True)
                factor = closing.get("real_time_factor") or 0.0
                say(f"{plan.name}, seed {plan.seed}: {process.seconds():.0f} s, {factor:.1f} x real time")

    def _check_unchanged(self, process: RunProcess, renderer: str) -> None:
        how = process.made_of.differences(process.plan.fingerprint())
        before = self._renderer() if renderer else ""
        if before not in ("", renderer):
            how.append(f"another renderer ({before} in other runs, {renderer} in this one)")
        if how:
            self._note(process, Outcome.INTERRUPTED)
            raise CodeChanged(
                f"{process.plan.name} was made with {' and '.join(how)}: the campaign ends, since its runs would "
                "differ; give it an installation of its own, and name the renderer by REGRAFT_RENDERER"
            )

    def _renderer(self) -> str:
        """Return the renderer of the runs that are kept, empty if none of them has drawn pictures."""
        kept = (self.home(plan) for plan in self._reported() if self.home(plan).is_dir())
        return next(filter(None, map(renderer_of, kept)), "")

    def _take_failure(self, process: RunProcess, error: BadRun, say: Say) -> None:
        plan, cause = process.plan, decisive(error.causes)
        (process.home / WHY).write_text(f"{error}\n")
        self._keep(process.home, self.folder / FAILED / plan.name)
        repeats = self._repeats.get(plan.name, 0)
        again = cause.of_the_machine and repeats < MADE_AGAIN_AT_MOST
        self._note(process, Outcome.REPEATED if again else Outcome.FAILED, cause)
        if again:
            self._repeats[plan.name] = repeats + 1
            self._todo.insert(0, plan)
            say(f"{plan.name}, seed {plan.seed}: to be made again, the machine may be too busy: {error}")
        else:
            self._failed += 1
            say(f"{plan.name}, seed {plan.seed}: FAILED: {error}")

    def _note(self, process: RunProcess, outcome: Outcome, cause: Cause | None = None) -> None:
        code, component, text = (cause.code, cause.component, cause.text) if cause else ("", "", "")
        plan, took = process.plan, round(process.seconds(), 1)
        made_of = process.made_of.code[:SHOWN]
        AttemptLog(self.folder).add(
            Attempt(plan.name, plan.seed, process.began, took, outcome, code, component, text, made_of)
        )

    def _keep(self, home: Path, place: Path) -> None:
        place.parent.mkdir(parents=True, exist_ok=True)
        if place.exists():
            shutil.rmtree(place)
        home.replace(place)

    def progress(self) -> Progress:
        """Return how far it is."""
        total = self._total
        done = total - len(self._todo) - len(self._running) - self._failed
        under_way = [process.simulated() for process in self._running]
        simulated = self._simulated + sum(under_way)
        remaining = (len(self._todo) + len(self._running)) * self.wanted.seconds - sum(under_way)
        taken = time.monotonic() - self._began
        left = taken / simulated * remaining if simulated > 0.0 else None
        names = tuple(f"{p.plan.name} at {at:.0f} s" for p, at in zip(self._running, under_way, strict=True))
        return Progress(done, self._failed, total, names, left)

    def _reported(self) -> list[Plan]:
        """Return the runs that are wanted, and those of other configurations that have ended here."""
        names = {each.name for each in self.wanted.configurations}
        every = self.wanted.study.configurations[self.wanted.definitions]
        others = replace(self.wanted, configurations=tuple(each for each in every if each.name not in names))
        return [*self.wanted.plans(), *(plan for plan in others.plans() if self._has_ended(plan))]

    def _has_ended(self, plan: Plan) -> bool:
        return self.home(plan).is_dir() or self._why(plan).is_file()

    def _why(self, plan: Plan) -> Path:
        """Return the file that states why a run has failed, if it has."""
        return self.folder / FAILED / plan.name / WHY

    def results(self, command: str = "") -> Results:
        """Return what there is: all finished runs that are wanted, and why the others failed; raises BadRun."""
        runs: list[RunRecord] = []
        failures: list[Failure] = []
        plans = self._reported()
        for plan in plans:
            why = self._why(plan)
            if self.home(plan).is_dir():
                runs.append(read_run(self.home(plan), plan.configuration))
            elif why.is_file():
                failures.append(Failure(plan.configuration, plan.number, plan.seed, why.read_text().strip()))
        return Results(self.wanted.definitions, runs, failures, len(plans), command)

    def provenance(self) -> str:
        """Return the section of a report on how its runs were made: of which code, and which of them again."""
        plans = [plan for plan in self._reported() if self.home(plan).is_dir()]
        made_of = {plan.name: fingerprint_of(self.home(plan)) for plan in plans}
        present = plans[0].fingerprint() if plans else None
        renderers = Counter(renderer_of(self.home(plan)) for plan in plans)
        return provenance(made_of, present, renderers, AttemptLog(self.folder).read())


def _in_work(plan: Plan) -> str:
    return plan.name.replace("/", "-")


def _read_about(path: Path) -> dict[str, object] | None:
    try:
        found = json.loads(path.read_text())
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise BadCampaign(f"{path} cannot be read: {error}") from None
    return found if isinstance(found, dict) else {}


def write_files(folder: Path, files: Sequence[tuple[str, bytes]]) -> None:
    """Write files, the last one last: who finds that one finds all; raises NoRoom."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files:
            write_whole(folder / name, content)
    except OSError as error:
        raise _no_room(folder, error) from None


def _no_room(folder: Path, error: OSError) -> NoRoom:
    if isinstance(error, shutil.Error):  # of all files that could not be copied
        source, _, why = error.args[0][0]
        return NoRoom(f"cannot copy {source}: {why}; what was finished is kept")
    return NoRoom(f"cannot write {error.filename or folder}: {error.strerror}; what was finished is kept")
