"""One component in the host's care: its spec, its present process, its past ones."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.host.plan import HostPlan
from regraft.host.runs.restart_backoff import RestartHistory
from regraft.host.runs.starting_checkpoint import StartingCheckpoint
from regraft.runtime.core.assignment import Assignment, Succession


@dataclass(slots=True)
class ManagedProcess:
    """The state of one component's process. ``start_at`` is when to start it, in monotonic seconds.

    ``ordered`` is set from the order to start it until the report that it has started; ``pid`` is 0 until then.
    ``start_again`` is set while it is being stopped and has been asked to start after that. ``removed`` is set once it
    is not to be started any more; ``owed`` is then whether it would have been restarted, for the case that the removal
    is taken back.
    ``started_as`` is the incarnation as which its process was started, ``formerly`` are those that it has had until
    now; ``succeeds`` is whom it is to succeed. ``restart_by`` is when it is restarted although another run runs next to
    it, in monotonic seconds. ``awaited`` is set while a successor of it gets ready on another host.
    ``held_until`` is the simulated time at which it comes back if it ends now: then it ``is_held`` until asked for.
    """

    spec: ComponentSpec
    history: RestartHistory
    state: ProcessState = ProcessState.STOPPED
    incarnation: int = 0
    pid: int = 0
    started: float = 0.0
    start_at: float | None = None
    ordered: bool = False
    kill_at: float | None = None
    exit_reason: str = ""
    stopping: bool = False
    start_again: bool = False
    seen: bool = False
    checkpoint: StartingCheckpoint = field(default_factory=StartingCheckpoint)
    why_killed: str = ""
    removed: bool = False
    owed: bool = False
    started_as: int = 0
    formerly: tuple[int, ...] = ()
    succeeds: Succession | None = None
    restart_by: float | None = None
    awaited: bool = False
    held_until: float | None = None
    is_held: bool = False

    @property
    def run(self) -> str:
        """Return the key of this run, unlike that of any other: no component can be named so."""
        return f"{self.spec.name}/{self.started_as}"

    def is_called(self, incarnation: int) -> bool:
        """Return whether its process may speak as ``incarnation``; until it gets a new one, it has the former."""
        return incarnation == self.incarnation or incarnation in self.formerly

    def rename(self, incarnation: int) -> None:
        """Expect its process to speak as another incarnation from some time on."""
        self.formerly = (*self.formerly, self.incarnation)
        self.incarnation = incarnation

    @property
    def has_process(self) -> bool:
        """Whether there is a process, or one on its way."""
        return self.ordered or self.pid != 0

    @property
    def is_starting(self) -> bool:
        """Whether its process is on its way, or has not given a sign of life yet."""
        return self.has_process and self.state is ProcessState.STARTING and not self.stopping

    def remove(self) -> None:
        """Start it no more, but leave its process alone."""
        self.removed, self.owed = True, self.owed or self.start_at is not None or self.is_held
        self.start_at, self.is_held = None, False

    def keep(self, now: float) -> None:
        """Take its removal back: what would have been restarted meanwhile is."""
        if self.owed and not self.has_process:
            self.start_at, self.state = now, ProcessState.WAITING
        if self.removed and self.stopping:
            self.start_again = True
        self.removed = self.owed = False

    @property
    def past_until(self) -> int:
        """The incarnation before which nothing of it counts once it is past: its own, or beyond one that was undone."""
        return max(self.incarnation, self.checkpoint.counts_from)

    def release(self, now: float) -> None:
        """Start it now if it is held back."""
        if self.is_held:
            self.is_held, self.start_at = False, now

    def status(self, max_incarnation: int) -> ProcessStatus:
        """Return the process's status; ``max_incarnation`` is the highest that is known of the component."""
        return ProcessStatus(
            self.spec.name,
            self.incarnation,
            self.state,
            self.pid,
            self.history.total,
            self.started,
            self.exit_reason,
            self.spec.managed,
            self.started_as,
            max_incarnation,
        )

    def assignment(self, plan: HostPlan, revision: int, term: int) -> Assignment:
        """Return what the next process is reported: the spec in force, and the last checkpoint."""
        is_source = self.spec.name == plan.source
        connect = (plan.source_endpoint, plan.endpoint) if plan.source and not is_source else (plan.endpoint,)
        return Assignment(
            system=plan.architecture.system,
            name=self.spec.name,
            cls=self.spec.cls,
            incarnation=self.incarnation,
            parameters=plan.found_here(self.spec.parameters),
            connections=self.spec.connections,
            services=self.spec.services,
            state=self.spec.state,
            revision=revision,
            term=term,
            simulated=plan.architecture.simulated,
            seed=plan.seed,
            sensor_streams=plan.sensor_streams(),
            checkpoint=self.checkpoint.opened(),
            listen_endpoints=(plan.source_endpoint, plan.source_door) if is_source else (),
            connect_endpoints=connect,
            step_socket=plan.step_socket,
            members=plan.members() if is_source else (),
            duration=plan.duration if is_source else None,
            faults=tuple(fault for fault in plan.faults if is_source or fault.component == self.spec.name),
            hung_after=plan.hung_after() if is_source else 0.0,
            succeeds=self.succeeds,
            secret=plan.secret,
            handler_timeout=plan.limits(self.spec).handler_timeout,
            scope=scope_of(self.spec.name, plan.architecture.scopes),
        )

    def order(self, plan: HostPlan, revision: int, term: int) -> dict[str, object]:
        """Return the assignment as plain data."""
        return codec.to_plain(self.assignment(plan, revision, term))
