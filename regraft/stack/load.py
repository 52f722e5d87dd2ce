"""Reads a stack file into a checked stack."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from pathlib import Path

from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.robots.robot_view import simulated_robots
from regraft.component.handlers import LONGEST
from regraft.process.trial.trial_import import Notice
from regraft.stack.assembly.assemble import ASSEMBLED, assemble
from regraft.stack.checks import file_problems_of, stack_problems
from regraft.stack.classes import import_problem, look_in
from regraft.stack.imports import try_modules
from regraft.stack.robot_data import with_robot_data
from regraft.stack.sections.components import read_component, read_connections, read_services
from regraft.stack.sections.constraints import read_constraints
from regraft.stack.sections.faults import read_faults
from regraft.stack.sections.hosts import read_hosts
from regraft.stack.sections.limits import read_limits
from regraft.stack.sections.mode_changes import Surroundings
from regraft.stack.sections.mode_rules import with_rules
from regraft.stack.sections.modes import with_modes
from regraft.stack.sections.topics import read_topics
from regraft.stack.stack import Stack, time_sources
from regraft.stack.yaml.nodes import locations_of
from regraft.stack.yaml.section import Section

FIELDS = (
    "system",
    "clock",
    "seed",
    "speed",
    "duration",
    "imports",
    "hosts",
    "limits",
    "topics",
    "components",
    "constraints",
    "modes",
    "rules",
    "faults",
)
MAX_SEED = 2**63 - 1


class _Clock(Enum):
    REAL = "real"
    SIMULATED = "simulated"


class _Speed(Enum):
    REAL = "real"
    MAX = "max"


def load(file: Path | str, notice: Notice = lambda _: None, *, files_later: bool = False) -> Stack:
    """Read and check a stack file; the stack's folder becomes importable in this process.

    Authors' modules are tried before this process imports them; ``notice`` gets a line about one that takes long.
    With ``files_later`` a missing file alone is no reason to refuse: see `Stack`.

    Raises:
        StackError: with everything that is wrong, each with file, line and field.
        KeyboardInterrupt: a signal that asks for an end came while modules were tried.
    """
    path = Path(file)
    assembly = assemble(path)
    report = assembly.report
    root = Section(assembly.document, "", report)
    root.only(*FIELDS, *ASSEMBLED)
    for folder in assembly.folders:
        look_in(folder)
    refused = try_modules(root, assembly.folders, notice)
    imports = _imports(root, refused)
    document = with_robot_data(assembly.document, assembly.robots, report, refused)
    report.locations = locations_of(document)
    root = Section(document, "", report)
    architecture = _with_speed(root, _architecture(root, Surroundings(refused, assembly.references)))
    for place, problem in stack_problems(architecture):
        report.add(place, problem)
    stack = Stack(
        file=path,
        architecture=architecture,
        seed=root.integer("seed", 0, 0, MAX_SEED),
        duration=root.number("duration", minimum=0.001, maximum=LONGEST),
        imports=imports,
        document=document,
        references=assembly.references,
        faults=read_faults(root, architecture),
        folders=assembly.folders,
        files_later=files_later,
    )
    if report.problems or not files_later:
        for place, problem in file_problems_of(architecture):
            report.add(place, problem)
    report.raise_if_any()
    return stack


def _imports(root: Section, refused: frozenset[str]) -> tuple[str, ...]:
    modules = root.distinct("imports")
    for index, module in enumerate(modules):
        problem = import_problem(module) if module not in refused else None
        if problem:
            root.wrong(f"imports.{index}", problem)
    return modules


def _architecture(root: Section, around: Surroundings) -> Architecture:
    table = root.section("components")
    given = root.node("components")
    if given is not None and given.value is not None and not isinstance(given.value, dict):
        # Nearly all else speaks of components, and would be wrong.
        root.report.raise_if_any()
    specs = {name: read_component(table, name, around.refused) for name in table.names()}
    # Topics come after the components: importing a class may make new message types known.
    topics = read_topics(root.section("topics"))
    hosts, rules = read_hosts(root)
    architecture = Architecture(
        system=_system(root),
        revision=0,
        simulated=root.choice("clock", _Clock, _Clock.REAL) is _Clock.SIMULATED,
        components=specs,
        topics=topics,
        hosts=hosts,
        host_rules=rules,
        limits=read_limits(root),
        robots=tuple(sorted({*around.references, *simulated_robots(specs)} - {""})),
    )
    architecture = replace(architecture, components=_connected(table, architecture))
    if not specs and not root.report.problems:
        root.wrong("components", "there are none: a stack needs at least one")
    architecture = replace(architecture, constraints=read_constraints(root, specs))
    return with_rules(root, with_modes(root, architecture, around))


def _connected(table: Section, architecture: Architecture) -> dict[str, ComponentSpec]:
    return {
        name: replace(
            spec,
            connections=read_connections(table, spec, architecture),
            services=read_services(table, spec, architecture),
        )
        for name, spec in architecture.components.items()
    }


def _system(root: Section) -> str:
    if "system" not in root:
        root.wrong("system", "is missing: must name the system, such as 'frog'")
    return root.text("system", "unnamed")


def _with_speed(root: Section, architecture: Architecture) -> Architecture:
    if "speed" not in root:
        return architecture
    speed = root.choice("speed", _Speed, _Speed.REAL)
    if not architecture.simulated:
        root.wrong("speed", "only simulated time has a speed: leave it out, or make 'clock' simulated")
    for name in time_sources(architecture):
        spec = architecture.components[name]
        if "speed" in spec.parameters:
            root.wrong("speed", f"is given as a parameter of {name!r} too: leave one out")
        architecture = architecture.with_component(replace(spec, parameters={**spec.parameters, "speed": speed.value}))
    return architecture
