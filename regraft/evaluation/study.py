"""The form of a study: data, and a little code. A stack's folder has its studies in ``studies/``, one module each.

    STUDY = Study("patrol", "does caution pay?", Path("regraft/stacks/patrol/stack.yaml"), {...}, report)

``regraft evaluate patrol`` finds it. A study names a stack, and what is different in it for each configuration. It
names what is written down (a `RowRecorder` among the stack's components), and what is made of it (``report``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.evaluation.rows import Rows
from regraft.stack.yaml.document import read_map
from regraft.stack.yaml.nodes import plain

Changes = Mapping[str, Any]
"""The differences to a stack file: maps are merged with the file's, everything else takes its place."""
Measure = Callable[[Rows], float]
"""A figure of one run, of its rows; NaN where the run does not determine it."""
NO_SCENARIO = ""


def nothing(seed: int) -> Changes:
    """Return no changes."""
    return {}


def joined(*changes: Changes) -> dict[str, Any]:
    """Return several changes as one: maps are merged."""
    found: dict[str, Any] = {}
    for each in changes:
        for key, value in each.items():
            found[key] = joined(found[key], value) if key in found and isinstance(value, dict) else value
    return found


def variant(file: Path, stack: str = "stack.yaml") -> Changes:
    """Return what a stack file has different from ``stack`` of its folder, with the files that it includes.

    Raises:
        StackError: a file cannot be read.
    """
    document = plain(read_map(file))
    included = [variant(file.parent / each, stack) for each in document.pop("include", ()) if each != stack]
    return joined(*included, document)


@dataclass(frozen=True, slots=True)
class Configuration:
    """One way to run the study's stack; ``changes`` states for a seed what is different in the stack file.

    ``scenario`` names the circumstances, if there are several: configurations are compared within one scenario.
    """

    name: str
    text: str
    changes: Callable[[int], Changes] = nothing
    scenario: str = NO_SCENARIO

    @property
    def key(self) -> str:
        """Its name on the command line and in the file system."""
        return f"{self.name}.{self.scenario}" if self.scenario else self.name


@dataclass(frozen=True, slots=True)
class Timing:
    """One run's cost on the wall clock: s to come up, s of running, s for each adaptation."""

    startup: float
    running: float
    adaptations: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class RunRecord:
    """One finished run, read back from its directory.

    ``closing`` holds what ``regraft up`` printed at its end, ``made_with`` the ``code`` hash and ``versions`` of then.
    """

    configuration: Configuration
    number: int
    seed: int
    seconds: float
    rows: Rows
    adaptations: tuple[AdaptationReport, ...]
    closing: Mapping[str, Any]
    timing: Timing
    made_with: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Failure:
    """A run that came to no end, and why."""

    configuration: Configuration
    number: int
    seed: int
    why: str


@dataclass(frozen=True, slots=True)
class Results:
    """All that a campaign has to show: what was run under which definitions, what failed, and by which command."""

    definitions: str
    runs: Sequence[RunRecord]
    failures: Sequence[Failure] = ()
    planned: int = 0
    command: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    """The output made of results: Markdown, and other files by name, as bytes."""

    markdown: str
    files: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Study:
    """An experiment that can be repeated.

    ``configurations`` are by the definitions that they go by: studies with one reading of their measures have one.
    ``additions`` are merged into the stack file of every run, the configuration's changes into the result.
    ``timing_only`` states what is different in a run of this number where all runs have one seed.
    ``measures`` are all figures of a run, by the definitions and by name: each has a column in the results.
    ``claims`` are the files of what the study claims, by the definitions, written before its runs.
    """

    name: str
    text: str
    stack: Path
    configurations: Mapping[str, Sequence[Configuration]]
    report: Callable[[Results], Report]
    additions: Changes = field(default_factory=dict)
    timing_only: Callable[[int], Changes] = nothing
    seconds: float = 300.0
    runs: int = 25
    measures: Mapping[str, Mapping[str, Measure]] = field(default_factory=dict)
    claims: Mapping[str, Path] = field(default_factory=dict)
