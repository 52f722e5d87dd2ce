"""Options and arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from regraft.cli.terminal.numbers import seconds, whole

SystemOption = Annotated[
    str | None,
    typer.Option("--system", metavar="NAME", help="The system; needed only if several run."),
]


RobotOption = Annotated[
    str, typer.Option("--robot", metavar="NAME", help="The robot that is meant, among several in the system.")
]


def _note_json(ctx: typer.Context, wanted: bool) -> bool:
    wanted = wanted or bool(ctx.parent and ctx.parent.params.get("as_json"))  # of a group that takes it
    if wanted or not isinstance(ctx.command, TyperGroup):  # the words behind a group's name may have it
        ctx.meta[JSON] = wanted
    return wanted


JSON = "regraft.json"
"""Where the context of a command notes that errors are to be printed as JSON, too."""
JsonOption = Annotated[bool, typer.Option("--json", callback=_note_json, help="Print JSON.")]
TlsOption = Annotated[
    Path | None,
    typer.Option(
        "--tls", metavar="FOLDER", file_okay=False, exists=True, help="Certificates for tls/... endpoints, both ways."
    ),
]
InsecureOption = Annotated[
    bool, typer.Option("--insecure", help="Take links beyond this machine that are neither encrypted nor checked.")
]
SecretOption = Annotated[
    Path | None,
    typer.Option(
        "--secret",
        metavar="FILE",
        dir_okay=False,
        help="The secret that all hosts of the system share; by default bus.secret of the --tls folder.",
    ),
]
StackArgument = Annotated[
    Path,
    typer.Argument(
        metavar="STACK", help="A stack file, a folder with a stack.yaml, or an installed stack such as frog."
    ),
]
OverridesOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="COMPONENT.PARAMETER=VALUE", help="Set a parameter; may be repeated."),
]
ParametersOption = Annotated[
    list[Path] | None,
    typer.Option("--params", metavar="FILE", help="Set the parameters in a file, before --set; may be repeated."),
]
PlacesOption = Annotated[
    list[str] | None,
    typer.Option("--place", metavar="COMPONENT=HOST", help="Have a component run on a host; may be repeated."),
]
DryRunOption = Annotated[bool, typer.Option("--dry-run", help="Show the plan, and touch nothing.")]
ReasonOption = Annotated[str, typer.Option("--reason", metavar="TEXT", help="The reason, for the journal.")]
RevisionOption = Annotated[
    int | None,
    typer.Option("--if-revision", metavar="N", parser=whole(0), help="Refuse if the revision is another."),
]
ConfirmOption = Annotated[
    float | None,
    typer.Option(
        "--confirm",
        metavar="SECONDS",
        parser=seconds(0.0, 86_400.0),
        help="Watch it for this time before it is final; undo it if it fails.",
    ),
]
WatchOption = Annotated[
    list[str] | None,
    typer.Option(
        "--watch",
        metavar="CONDITION",
        help="What must hold meanwhile: a requirement, an expression, or {quality: a.b, at_least: 1}; may be repeated.",
    ),
]
TimeoutOption = Annotated[
    float, typer.Option("--timeout", metavar="SECONDS", parser=seconds(0.1), help="The time to wait.")
]
ComponentArgument = Annotated[str, typer.Argument(metavar="COMPONENT", help="A component's name.")]


def chosen_system(ctx: typer.Context, system: str | None) -> str | None:
    """Return the system named after the command or, if none is, before it: first after its group, if it has one."""
    before = ctx.parent
    while system is None and before is not None:
        system, before = before.params.get("system"), before.parent
    return system
