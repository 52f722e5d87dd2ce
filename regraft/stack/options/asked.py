"""Loads a stack as a command line asks for it: files that parameters name count once all options are applied."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from regraft.process.trial.trial_import import Notice
from regraft.stack.checks import file_problems_of
from regraft.stack.load import load
from regraft.stack.options.overrides import apply_overrides
from regraft.stack.options.parameter_files import apply_parameter_files
from regraft.stack.options.places import with_places
from regraft.stack.stack import Stack
from regraft.stack.yaml.problems import StackError


def load_as_asked(
    file: Path | str,
    parameter_files: Sequence[Path] | None = None,
    overrides: Sequence[str] | None = None,
    places: Sequence[str] | None = None,
    *,
    first: Callable[[Stack], Stack] = lambda stack: stack,
    notice: Notice = lambda _: None,
) -> Stack:
    """Return a stack with what options give it, as if its file had that; ``first`` is done before all else.

    A file that is missing is refused at last: an option may name another, or place the component elsewhere.

    Raises:
        StackError: with everything that is wrong, by file and line or by option.
    """
    stack = first(load(file, notice, files_later=True))
    stack = apply_parameter_files(stack, parameter_files or ())
    stack = with_places(apply_overrides(stack, overrides or ()), places or ())
    problems = [stack.problem(place, problem) for place, problem in file_problems_of(stack.architecture)]
    if problems:
        raise StackError(problems)
    return replace(stack, files_later=False)
