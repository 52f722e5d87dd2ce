"""``regraft decision``: checks decision files, and shows what they come to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from regraft.adaptation_manager.planners.choices.solvers.named import solver_named
from regraft.adaptation_manager.planners.choices.solvers.protocol import CannotSolve, Effort
from regraft.adaptation_manager.planners.decisions.checking import check_in, not_learned, not_predicted
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.question import question_of
from regraft.adaptation_manager.planners.decisions.reading import locations_in, read_decision
from regraft.adaptation_manager.planners.decisions.scoping import estimates_in, in_scope
from regraft.adaptation_manager.planners.decisions.showing import choice_lines, choice_plain, decision_lines
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.suggestions import no_such
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.numbers import seconds
from regraft.cli.terminal.options import JsonOption, RobotOption
from regraft.cli.terminal.output import say, show_json
from regraft.stack import StackError, load
from regraft.stack.installed import stack_file
from regraft.stack.yaml.nodes import NumberTooLarge, scalar

decision = typer.Typer(
    help="Check decision files, and show what is chosen.", no_args_is_help=True, rich_markup_mode=None
)

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="A decision file, such as decision.yaml.")]
StackOption = Annotated[Path | None, typer.Option("--stack", metavar="STACK", help="The stack in which it is taken.")]
ContextOption = Annotated[
    list[str] | None, typer.Option("--context", metavar="NAME=VALUE", help="What is known of the world.")
]
SolverOption = Annotated[str, typer.Option("--solver", help="branch_and_bound, cp_sat or exhaustive.")]
DeadlineOption = Annotated[
    float | None, typer.Option("--deadline", parser=seconds(0.001), help="Seconds to search at most.")
]


@decision.command("check")
def check(file: FileArgument, stack: StackOption = None, robot: RobotOption = "", as_json: JsonOption = False) -> None:
    """Check a decision file; with a stack, also whether it can be taken there."""
    found, _ = _read(file, stack, robot)
    learning = [{"field": each.field, "why": each.why} for each in not_learned(found)]
    predicting = [{"field": each.field, "why": each.why} for each in not_predicted(found)]
    if as_json:
        show_json({"file": str(file), "learning": learning, "predicting": predicting})
        return
    choices = "1 choice" if len(found.slots) == 1 else f"{len(found.slots)} choices"
    entries = "1 entry" if len(found.context) == 1 else f"{len(found.context)} entries"
    say(f"{file}: {choices}, {entries} of context: right")
    for kind, parts in (("bandits", learning), ("forecast", predicting)):
        for part in parts:
            say(f"{kind} cannot express {part['field']}: {part['why']}")


@decision.command("show")
def show(
    file: FileArgument,
    stack: StackOption = None,
    robot: RobotOption = "",
    context: ContextOption = None,
    solver: SolverOption = "branch_and_bound",
    deadline: DeadlineOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a decision; with a stack, also what would be chosen there by what is expected, and why."""
    found, architecture = _read(file, stack, robot)
    known = _context(context or [], found)
    try:
        by = solver_named(solver)
        if not as_json:
            for line in decision_lines(found):
                say(line)
        if architecture is None:
            return
        asked = question_of(found, known, estimates_in(architecture, robot))
        chosen = asked.choose(architecture, by, Effort(deadline=deadline))
    except (BadMessage, CannotSolve) as error:
        raise BadInput(f"{file}: {error}") from None
    if as_json:
        show_json(choice_plain(found, asked, chosen))
        return
    for line in choice_lines(found, asked, chosen):
        say(line)


def _read(file: Path, stack: Path | None, robot: str) -> tuple[Decision, Architecture | None]:
    try:
        found = in_scope(read_decision(file), robot)
        if stack is None:
            return found, None
        architecture = load(stack_file(stack)).architecture
        report = locations_in(file)
        check_in(found, architecture, estimates_in(architecture, robot), report, robot)
        report.raise_if_any()
    except StackError as error:
        raise BadInput(str(error)) from None
    return found, architecture


def _context(given: list[str], decision: Decision) -> dict[str, Any]:
    names = [entry.name for entry in decision.context]
    found = {}
    for each in given:
        name, equals, value = each.partition("=")
        if not equals or not name:
            raise BadInput(f"--context {each}: must be NAME=VALUE")
        if name not in names:
            raise BadInput(f"--context {each}: {no_such('entry of context', name, names)}")
        try:
            found[name] = scalar(value)
        except NumberTooLarge as error:
            raise BadInput(f"--context {each}: {error}") from None
    return found
