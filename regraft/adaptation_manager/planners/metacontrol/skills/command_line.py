"""``regraft skills``: checks files of skills, shows them, and generates what others read.

textX and rdflib are imported by the commands that need them: no other command waits for them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from regraft.adaptation_manager.planners.metacontrol.skills.generators.rdf_lines import PUBLISHED, Namespaces
from regraft.adaptation_manager.planners.metacontrol.skills.kb_commands import kb
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.bus_schema.suggestions import no_such
from regraft.cli.outcomes import BAD_INPUT, BadInput
from regraft.cli.terminal.options import JsonOption, RobotOption
from regraft.cli.terminal.output import complain, say, show_json, show_table

if TYPE_CHECKING:
    from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Diagnostic
    from regraft.adaptation_manager.planners.metacontrol.skills.reading import CheckedSkills

skills = typer.Typer(
    help="Check files of robot skills, and generate from them.", no_args_is_help=True, rich_markup_mode=None
)

EDITOR_MODULES: Final = ("pygls", "lsprotocol", "cattrs", "attrs", "attr")
"""Modules that only the server for editors needs, of the extra ``editor``."""

skills.add_typer(kb, name="kb")

IRI: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:[^\s<>\"{}|\\^`]+[#/]")
SYSTEM: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="A file of skills, such as navigation.skills.")]
StackOption = Annotated[
    Path | None, typer.Option("--stack", metavar="STACK", help="The stack whose components realize the skills.")
]


@skills.command("check")
def check(file: FileArgument, stack: StackOption = None, robot: RobotOption = "", as_json: JsonOption = False) -> None:
    """Check a file with all that it imports; with a stack, also its components and their parameters."""
    checked = _checked(file, stack, robot)
    if as_json:
        show_json(_plain(file, checked))
        if _errors(checked):
            raise typer.Exit(BAD_INPUT)
        return
    _refuse_if_wrong(checked)
    for each in checked.diagnostics:
        say(str(each))
    say(f"{file}: {_counted(checked)}: right")


@skills.command("generate")
def generate(
    file: FileArgument,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder of the four files.")],
    stack: StackOption = None,
    robot: RobotOption = "",
    one_system: Annotated[
        str, typer.Option("--one-system", metavar="NAME", help="One system with all modes, instead of one a skill.")
    ] = "",
    tomasys: Annotated[
        str, typer.Option("--tomasys", metavar="IRI", help="The namespace of TOMASys' terms.")
    ] = PUBLISHED.tomasys,
    mros: Annotated[
        str, typer.Option("--mros", metavar="IRI", help="The namespace of MROS' terms and of qualities.")
    ] = PUBLISHED.mros,
    domain: Annotated[
        str, typer.Option("--domain", metavar="IRI", help="The namespace of the individuals.")
    ] = PUBLISHED.domain,
) -> None:
    """Write modes for system_modes, components and qualities to observe, and individuals for an ontology."""
    namespaces = _namespaces(tomasys, mros, domain)
    checked = _right(file, stack, robot)
    _check_system(one_system, checked)
    from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated, write_files

    files = generated(checked.skills, namespaces, one_system)
    try:
        write_files(files, out)
    except (OSError, ValueError) as error:
        raise BadInput(f"--out {out}: {getattr(error, 'strerror', None) or error}: nothing was changed") from None
    say(f"{out}: {', '.join(files)}")


@skills.command("outline")
def outline(file: FileArgument, as_json: JsonOption = False) -> None:
    """Show the tree of skills, realizations, components and configurations."""
    from regraft.adaptation_manager.planners.metacontrol.skills.outline import (
        outline_lines,
        outline_of,
        outline_plain,
    )

    checked = _checked(file)
    entries = outline_of(checked.skills)
    if as_json:
        show_json({**_plain(file, checked), "outline": outline_plain(entries)})
        if _errors(checked):
            raise typer.Exit(BAD_INPUT)
        return
    for line in outline_lines(entries):
        say(line)
    _refuse_if_wrong(checked)


@skills.command("count")
def count(file: FileArgument, as_json: JsonOption = False) -> None:
    """Count the assertions and lines of each realization in the generated ontology."""
    checked = _right(file)
    from regraft.adaptation_manager.planners.metacontrol.skills.counting import counts
    from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals

    found = counts(individuals(checked.skills))
    rows = [
        {
            "skill": each.realization.skill,
            "realization": each.realization.name,
            "object": each.objects,
            "data": each.data,
            "class": each.classes,
            "assertions": each.assertions,
            "lines": each.lines,
        }
        for each in found
    ]
    if as_json:
        own = [{**row, "own": each.own} for row, each in zip(rows, found, strict=True)]
        show_json({"file": str(file), "realizations": own})
        return
    headings = ("skill", "realization", "object", "data", "class", "assertions", "lines")
    show_table(headings, [list(row.values()) for row in rows], empty="no realization can be chosen")


@skills.command("server")
def server() -> None:
    """Serve an editor over standard input and output: diagnostics, completion, descriptions and the outline."""
    try:
        from regraft.adaptation_manager.planners.metacontrol.skills.server.server import serve
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in EDITOR_MODULES:
            raise
        raise BadInput("editors need pygls, which is not installed: pip install 'regraft[editor]'") from None
    serve()


def _checked(file: Path, stack: Path | None = None, robot: str = "") -> CheckedSkills:
    from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills

    if stack is None:
        if robot:
            raise BadInput(f"--robot {robot}: needs --stack: robots are those of a stack")
        return checked_skills(file)
    from regraft.stack import load
    from regraft.stack.installed import stack_file

    architecture = load(stack_file(stack), complain).architecture
    scopes = architecture.scopes
    known = {scope_of(name, scopes) for name in architecture.components} - {""}
    if robot and robot not in known:
        raise BadInput(f"--robot {robot}: {no_such('robot', robot, known)}")
    return checked_skills(file, architecture, robot)


def _right(file: Path, stack: Path | None = None, robot: str = "") -> CheckedSkills:
    """Return a file without errors; its warnings are shown. Raises BadInput."""
    checked = _checked(file, stack, robot)
    _refuse_if_wrong(checked)
    for each in checked.diagnostics:
        complain(str(each))
    return checked


def _errors(checked: CheckedSkills) -> list[Diagnostic]:
    from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Severity

    return [each for each in checked.diagnostics if each.severity is Severity.ERROR]


def _refuse_if_wrong(checked: CheckedSkills) -> None:
    """Raise BadInput with all that is wrong, if an error is among it."""
    if _errors(checked):
        from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import shown

        raise BadInput("\n".join(shown(checked.diagnostics)))


def _counted(checked: CheckedSkills) -> str:
    found = checked.skills
    numbers = {"skill": len(found.skills), "realization": len(found.realizations), "file": len(found.files)}
    return ", ".join(f"{number} {name}{'' if number == 1 else 's'}" for name, number in numbers.items())


def _plain(file: Path, checked: CheckedSkills) -> dict[str, Any]:
    from regraft.adaptation_manager.planners.metacontrol.skills.outline import plain_place

    return {
        "file": str(file),
        "skills": len(checked.skills.skills),
        "realizations": len(checked.skills.realizations),
        "diagnostics": [
            {
                **plain_place(each.place),
                "severity": each.severity.value,
                "code": each.code.value,
                "message": each.message,
            }
            for each in checked.diagnostics
        ],
    }


def _namespaces(tomasys: str, mros: str, domain: str) -> Namespaces:
    for option, given in (("--tomasys", tomasys), ("--mros", mros), ("--domain", domain)):
        if not IRI.fullmatch(given):
            raise BadInput(f"{option} {given}: must be an absolute IRI that ends in '#' or '/', as {PUBLISHED.mros}")
    if len({tomasys, mros, domain}) < 3:
        raise BadInput("--tomasys, --mros and --domain must differ: a realization may be named like a term")
    return Namespaces(tomasys, mros, domain)


def _check_system(name: str, checked: CheckedSkills) -> None:
    from regraft.adaptation_manager.planners.metacontrol.skills.meaning import components_of

    if name and not SYSTEM.fullmatch(name):
        raise BadInput(f"--one-system {name}: must be letters, digits and '_', also in parts with '/' between them")
    if name in components_of(checked.skills.realizations):
        raise BadInput(f"--one-system {name}: is the name of a component: take another")
    for each in checked.skills.realizations if name else ():
        if each.requirements:
            why = f"{each.name!r} requires another skill, and one system has one realization in force at a time"
            complain(f"{each.place}: warning: {why}: it cannot be provided with --one-system")
