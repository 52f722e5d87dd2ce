"""The plan of a host: the components that it is to run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.messages.protocol.joining import JoinedSystem
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, Limits
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.stack.files import file_problems
from regraft.stack.installed import packages


@dataclass(frozen=True, slots=True, kw_only=True)
class HostPlan:
    """One machine's part of a system.

    ``source`` names the time source under simulated time. It listens at ``source_endpoint`` and is the hub nearest to
    the components. The host's hub, which listens at ``endpoint``, reaches it at ``source_door``. It exchanges steps
    with the components at ``step_socket``. ``tools_endpoint`` is for this machine's tools, empty if they come at
    ``endpoint``. ``secret`` proves that its processes belong to the system. ``folder`` is the system's folder
    (``regraft.run_directory``), ``stack_folder`` where the stack file is and programs run. ``paths`` has the folders
    on this machine by those on the first host: of stack, system and installed packages. ``references`` has
    the values that components to come may refer to, by robot: see `Stack`. ``faults`` are on the schedule of the run.
    ``folders`` are those of modules, on the first host.
    """

    architecture: Architecture
    folder: Path
    stack_folder: Path
    run: str
    endpoint: str
    tools_endpoint: str = ""
    secret: str = field(repr=False)
    source: str | None = None
    source_endpoint: str = ""
    source_door: str = ""
    step_socket: str = ""
    seed: int = 0
    duration: float | None = None
    name: str = LOCAL
    paths: dict[str, str] = field(default_factory=dict)
    references: dict[str, dict[str, PlainValue]] = field(default_factory=dict)
    faults: tuple[ScheduledFault, ...] = ()
    folders: tuple[Path, ...] = ()

    def hung_after(self) -> float:
        """Return how long a component may be silent, at most, that the schedule has hang or stop."""
        components = self.architecture.components
        silent = {fault.component for fault in self.faults if fault.kind in (FaultKind.STOP, FaultKind.HANG)}
        known = (components[name] for name in silent if name in components)
        return max((self.architecture.handler_timeout(spec) for spec in known), default=0.0)

    def found_here(self, parameters: dict[str, PlainValue]) -> dict[str, PlainValue]:
        """Return parameters of the first host with paths as they are on this machine."""
        return moved(parameters, self.paths)

    def found_there(self, parameters: dict[str, PlainValue]) -> dict[str, PlainValue]:
        """Return parameters of this machine with paths as they are on the first host."""
        return moved(parameters, {here: there for there, here in self.paths.items()})

    def missing_files(self) -> Iterator[tuple[str, str]]:
        """Yield ``COMPONENT.PARAMETER`` and what is wrong with its file, of the components on this host.

        Files in the system's folder are left out: components may write them before others read them.
        """
        for name, spec in sorted(self.mine().items()):
            here = self.found_here(spec.parameters)
            given = {each: value for each, value in here.items() if not str(value).startswith(f"{self.folder}/")}
            if spec.description is not None:
                yield from ((f"{name}.{each}", why) for each, why in file_problems(spec.description, given))

    def updated(self, update: UpdateSpecs) -> HostPlan:
        """Return the plan with an update's architecture; its revision stays the start's."""
        updated = replace(update, revision=self.architecture.revision).applied_to(self.architecture)
        return replace(self, architecture=updated)

    def as_joined(self, joined: JoinedSystem) -> HostPlan:
        """Return the plan with the first host's values; what concerns this machine stays."""
        return replace(
            self,
            architecture=joined.architecture,
            run=joined.run,
            seed=joined.seed,
            paths=_paths(joined, self.stack_folder) | {joined.folder: str(self.folder)},
            references=joined.references,
        )

    def mine(self) -> dict[str, ComponentSpec]:
        """Return the specs of the components on this host."""
        return {name: spec for name, spec in self.architecture.components.items() if spec.host == self.name}

    def limits(self, spec: ComponentSpec) -> Limits:
        """Return what a component may use: its own limits, else those of the whole system."""
        return spec.limits.before(self.architecture.limits)

    def sensor_streams(self) -> tuple[str, ...]:
        """Return the topics that drop rather than block."""
        return tuple(sorted(topic.name for topic in self.architecture.topics.values() if not topic.reliable))

    def members(self) -> tuple[str, ...]:
        """Return the components that the first tick waits for: all that speak the protocol, onlookers excepted."""
        return tuple(
            sorted(
                name
                for name, spec in self.architecture.components.items()
                if spec.managed and name != self.source and (spec.description is None or spec.description.lockstep)
            )
        )


def module_folders(joined: JoinedSystem, stack_folder: Path) -> tuple[Path, ...]:
    """Return where a host that joins looks for modules of the stack: in its own ``stack_folder`` at first.

    Further folders are as the first host has them, unless they are in the stack's or an installed package's.
    """
    paths = _paths(joined, stack_folder)
    found = (Path(str(moved({"": folder}, paths)[""])) for folder in joined.folders)
    return tuple(dict.fromkeys((stack_folder, *found)))


def _paths(joined: JoinedSystem, stack_folder: Path) -> dict[str, str]:
    """Return folders on this machine by those on the first host: of the stack, and of installed packages."""
    here = packages()
    installed = {there: here[name] for name, there in joined.packages.items() if name in here}
    return installed | {joined.stack_folder: str(stack_folder)}


def moved(parameters: Mapping[str, PlainValue], folders: Mapping[str, str]) -> dict[str, PlainValue]:
    """Return parameters with paths in ``folders`` as they are in the folders that these map to.

    Of folders in each other, the innermost counts.

    >>> moved({"file": "/lab/room.xml", "robots": [{"model": "/opt/a.xml"}]}, {"/lab": "/home/lab"})
    {'file': '/home/lab/room.xml', 'robots': [{'model': '/opt/a.xml'}]}
    >>> moved({"file": "/lab/runs/1/rows.csv"}, {"/lab": "/home/lab", "/lab/runs": "/runs"})
    {'file': '/runs/1/rows.csv'}
    """
    innermost_first = sorted(folders, key=len, reverse=True)

    def one(value: PlainValue) -> PlainValue:
        if isinstance(value, str):
            for folder in innermost_first:
                if value == folder or value.startswith(f"{folder}/"):
                    return folders[folder] + value[len(folder) :]
        if isinstance(value, list):
            return [one(part) for part in value]
        return moved(value, folders) if isinstance(value, dict) else value

    return {name: one(value) for name, value in parameters.items()}
