"""``regraft quality``: what running components measure of their own qualities."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.qualities import Better
from regraft.cli.bus.gaps import with_gaps_told
from regraft.cli.bus.rates import rates_of
from regraft.cli.bus.sampling import CountOption, ForOption, OnceOption, samples
from regraft.cli.outcomes import BadInput, Failed
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.client import Subscription, TopicSample
from regraft.client.qualities import QualityNow, measures, qualities_now

quality = typer.Typer(help="Look at measured qualities.", no_args_is_help=True, rich_markup_mode=None)

STATUS_TIMEOUT = 2.0

ComponentArgument = Annotated[str, typer.Argument(metavar="COMPONENT")]


@quality.command("list")
def list_qualities(
    ctx: typer.Context,
    component: Annotated[str, typer.Argument(metavar="[COMPONENT]")] = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the qualities that components measure: their latest values, or why they are unknown."""
    with reached(ctx, system) as there:
        specs = there.known.of_robot(robot).components
        if component:
            specs = {component: _measuring(there, component)}
        found = qualities_now(there.client, specs, STATUS_TIMEOUT)
    if as_json:
        show_json({"qualities": [line.plain() for line in found]})
        return
    rows = ((f"{line.component}.{line.quality}", _value(line), _range(line), _better(line), line.why) for line in found)
    show_table(
        ("quality", "value", "range", "better", "unknown because"), rows, empty="no component measures qualities"
    )


def _value(line: QualityNow) -> str:
    return "" if line.value is None else _with_unit(f"{line.value:.4g}", line.unit)


def _with_unit(number: str, unit: str) -> str:
    return number if unit in ("", "1") else f"{number} {unit}"


def _range(line: QualityNow) -> str:
    if line.minimum is None and line.maximum is None:
        return ""
    return (
        f"{'' if line.minimum is None else f'{line.minimum:g}'}..{'' if line.maximum is None else f'{line.maximum:g}'}"
    )


def _better(line: QualityNow) -> str:
    return "" if line.better is Better.NEITHER else line.better.value


@quality.command("echo")
def echo(
    ctx: typer.Context,
    component: ComponentArgument,
    count: CountOption = None,
    duration: ForOption = None,
    once: OnceOption = False,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print a component's qualities whenever it has measured them; as JSON, one document per line."""
    with reached(ctx, system) as there:
        spec = _measuring(there, component)
        _warn_if_silent(there, component)
        seen = 0
        coming = samples(_of(there, component), 1 if once else count, duration, there.check)
        for sample in with_gaps_told(coming):
            seen += 1
            _show(spec, sample.message, as_json)
    if (once or count) and not seen:
        raise Failed(_nothing_came(component, duration))


@quality.command("hz")
def hz(
    ctx: typer.Context,
    component: ComponentArgument,
    count: CountOption = None,
    duration: ForOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how often a component publishes its qualities: by the wall clock, and by its own clock."""
    with reached(ctx, system) as there:
        _measuring(there, component)
        _warn_if_silent(there, component)
        rates = rates_of(samples(_of(there, component), count, duration, there.check), shown=not as_json)
    if not rates.count:
        raise Failed(_nothing_came(component, duration))
    if as_json:
        show_json({"component": component, **rates.plain()})
    else:
        say(rates.line())


def _measuring(there: Reached, name: str) -> ComponentSpec:
    """Return the component of that name; raises BadInput if there is none, or it measures nothing."""
    spec = there.known.component(name)
    if not measures(spec):
        others = ", ".join(other for other, each in there.known.components.items() if measures(each))
        raise BadInput(f"{name} measures no qualities; those that do: {others or 'none'}")
    return spec


def _warn_if_silent(there: Reached, name: str) -> None:
    seen = there.client.components(STATUS_TIMEOUT).get(name)
    state = seen.state if seen is not None and seen.alive else None
    if state is not State.ACTIVE:
        complain(f"{name} is {'not there' if state is None else state.value}: it measures nothing now; waiting")


def _of(there: Reached, component: str) -> Callable[[Callable[[TopicSample], object]], Subscription]:
    return lambda take: there.client.measurements(component, take)


def _nothing_came(component: str, duration: float | None) -> str:
    return f"{component} has published no qualities" + (f" within {duration:g} s" if duration is not None else "")


def _show(spec: ComponentSpec, message: MeasuredQualities, as_json: bool) -> None:
    if as_json:
        show_json(message, compact=True)
        return
    say(f"{message.stamp:.3f} s, {message.component}")
    for described in measures(spec):
        value = message.values.get(described.name)
        if value is None:
            say(f"  {described.name}: unknown: {message.unknown.get(described.name, 'not given')}")
        else:
            say(f"  {described.name}: {_with_unit(f'{value:.4g}', described.unit)}")
