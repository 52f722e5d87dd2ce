"""``regraft estimate``: the qualities that a component gives, or a class or a whole stack would give."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.control import AskQualities
from regraft.bus_schema.model.qualities.qualities import Judged
from regraft.cli.adaptation.estimate_stack import estimate_stack
from regraft.cli.adaptation.mistakes import refuse_values
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import reached
from regraft.cli.terminal.options import JsonOption, SystemOption
from regraft.cli.terminal.output import complain, show_json, show_table
from regraft.cli.terminal.values import assignments
from regraft.component.component import describe, parameter_set
from regraft.component.predicting import predicted
from regraft.process.main import load_class
from regraft.process.trial.trial_import import check_classes
from regraft.stack.classes import look_in

Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PARAMETER=VALUE", help="Estimate with this value; may be repeated."),
]
Context = Annotated[
    list[str] | None,
    typer.Option("--context", metavar="NAME=VALUE", help="The context to estimate for: darkness=0.7; may be repeated."),
]


def estimate(
    ctx: typer.Context,
    component: Annotated[
        str,
        typer.Argument(metavar="[COMPONENT|MODULE:CLASS]", help="A running component, or a class that need not run."),
    ] = "",
    stack: Annotated[
        str, typer.Option("--stack", metavar="STACK", help="A stack that need not run: all of it, or COMPONENT of it.")
    ] = "",
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--change",
            metavar="COMPONENT.NAME=VALUE|{CHANGE}",
            help="With --stack, estimate after it too: navigator.max_velocity=0.1; may be repeated.",
        ),
    ] = None,
    settings: Settings = None,
    context: Context = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the qualities that a component gives now, and would give with other parameters in another context."""
    if stack:
        if settings:
            raise BadInput("--set goes with a COMPONENT alone; with --stack use --change navigator.max_velocity=0.1")
        estimate_stack(stack, component, changes or [], assignments(context or (), "--context "), as_json=as_json)
        return
    if changes:
        raise BadInput("--change goes with --stack; for a running system use 'regraft adapt FILE --dry-run'")
    if not component:
        raise BadInput("name a COMPONENT, a MODULE:CLASS or a --stack")
    asked = AskQualities(assignments(settings or (), "--set "), assignments(context or (), "--context "))
    if ":" in component:
        found = _of_class(component, asked)
        _show(component, found.values, None, found.problems, as_json)
        return
    with reached(ctx, system) as there:
        refuse_values(there.known.component(component), asked.parameters, starting=True)
        with there.needing(component):
            qualities = there.client.qualities(component, asked)
    _show(component, qualities.estimated, qualities.evaluated, qualities.unknown, as_json)


def _of_class(path: str, asked: AskQualities) -> Judged:
    look_in(Path.cwd())
    check_classes([path], complain)
    cls = load_class(path)
    given: dict[str, PlainValue] = parameter_set(cls, asked.parameters).plain()
    return predicted(cls, describe(cls, asked.parameters).qualities, given, asked.context)


def _show(
    component: str,
    estimated: Mapping[str, float],
    evaluated: Mapping[str, float] | None,
    unknown: Mapping[str, str],
    as_json: bool,
) -> None:
    for name, why in unknown.items():
        complain(f"the quality {name!r} is unknown: {why}")
    if as_json:
        shown = {"component": component, "estimated": dict(estimated)}
        show_json(shown if evaluated is None else {**shown, "evaluated": dict(evaluated)})
        return
    names = sorted({*estimated, *(evaluated or {})})
    rows = [(name, _number(estimated, name), _number(evaluated or {}, name)) for name in names]
    show_table(("quality", "estimated", "now"), rows, empty=f"{component} estimates no qualities")


def _number(values: Mapping[str, float], name: str) -> str:
    return f"{values[name]:.4g}" if name in values else ""
