"""``regraft param``: parameters of components."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.model.adaptation import SetParameters
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.mistakes import refuse_values
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.negative_values import TakesValues
from regraft.cli.terminal.options import (
    ComponentArgument,
    DryRunOption,
    JsonOption,
    ReasonOption,
    RobotOption,
    SystemOption,
)
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import assignments, value_of
from regraft.client import ClientError

param = typer.Typer(help="Get, set and list parameters.", no_args_is_help=True, rich_markup_mode=None)


@param.command("list")
def list_parameters(
    ctx: typer.Context,
    component: Annotated[str | None, typer.Argument(metavar="[COMPONENT]", help="Only this component's.")] = None,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List parameters with their values now, ranges and meaning."""
    with reached(ctx, system) as there:
        known = there.known.of_robot(robot)
        specs = [known.component(component)] if component else list(known.components.values())
        rows = [row for spec in specs for row in _parameters(there, spec)]
    if as_json:
        show_json({"parameters": rows})
        return
    cells = ((r["component"], r["parameter"], r["value"], _range(r), r["unit"], _text(r)) for r in rows)
    show_table(("component", "parameter", "value", "range", "unit", ""), cells, empty="no parameters")
    for error in dict.fromkeys(row["error"] for row in rows if row["error"]):
        complain(error)


def _parameters(there: Reached, spec: ComponentSpec) -> list[dict[str, Any]]:
    described = spec.description.parameters if spec.description else ()
    if not described:
        return []
    now: dict[str, PlainValue] = {}
    error = ""
    try:
        now = _values(there, spec.name)
    except (ClientError, Unreachable) as failed:
        error = str(failed)
    return [
        {
            "component": spec.name,
            "parameter": parameter.name,
            "value": now.get(parameter.name),
            "default": parameter.default,
            "schema": parameter.schema,
            "unit": parameter.unit,
            "read_only": parameter.read_only,
            "description": parameter.description,
            "error": error,
        }
        for parameter in described
    ]


def _values(there: Reached, component: str) -> dict[str, PlainValue]:
    with there.needing(component):
        view = there.client.control(component, "parameters")
    assert isinstance(view, ComponentView)
    return view.parameters


def _range(row: dict[str, Any]) -> str:
    schema = row["schema"]
    if "enum" in schema:
        return " | ".join(map(str, schema["enum"]))
    low, high = schema.get("minimum"), schema.get("maximum")
    return "" if low is None and high is None else f"{'' if low is None else low} .. {'' if high is None else high}"


def _text(row: dict[str, Any]) -> str:
    return f"{row['description']}{' (read-only)' if row['read_only'] else ''}".strip()


@param.command("get")
def get(
    ctx: typer.Context,
    component: ComponentArgument,
    parameter: Annotated[str, typer.Argument(metavar="PARAMETER")],
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print a parameter's value now."""
    with reached(ctx, system) as there:
        values = _values(there, component)
    if parameter not in values:
        raise BadInput(f"{component} has no parameter {parameter!r}; {instead_of(parameter, values)}")
    if as_json:
        show_json({"component": component, "parameter": parameter, "value": values[parameter]})
    else:
        say(str(values[parameter]))


@param.command("set", cls=TakesValues)
def set_parameters(
    ctx: typer.Context,
    component: ComponentArgument,
    settings: Annotated[list[str], typer.Argument(metavar="PARAMETER VALUE | PARAMETER=VALUE...")],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Set one parameter, or several at once, all or none."""
    values = values_of(settings, f"{component}.")
    with reached(ctx, system) as there:
        refuse_values(there.known.component(component), values)
        if component in there.known.hosted:
            change = SetParameters(component, values)
            managing.change(there, change, reason=reason, dry_run=dry_run, as_json=as_json)
            return
        managing.refuse_dry_run(component, dry_run)
        with there.needing(component):
            view = there.client.control(component, "parameters", ParameterValues(values))
    assert isinstance(view, ComponentView)
    if as_json:
        show_json({"component": component, "parameters": view.parameters})
    else:
        for name in values:
            say(f"{component}.{name} is {view.parameters[name]}")


def values_of(settings: list[str], before: str = "") -> dict[str, PlainValue]:
    """Return the values in ``PARAMETER VALUE`` or in ``PARAMETER=VALUE ...``.

    Raises BadInput, with ``before`` in front of the name at fault.
    """
    if len(settings) == 2 and "=" not in settings[0]:
        return {settings[0]: value_of(settings[1], f"{before}{settings[0]}")}
    return assignments(settings, before)
