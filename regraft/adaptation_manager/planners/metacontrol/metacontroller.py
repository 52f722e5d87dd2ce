"""The metacontroller: keeps clients' objectives provided, by the realizations of skills (MROS, section I).

Its loop is MAPE-K. It monitors components and qualities, and analyses by the rules of the knowledge base. It plans a
design for each objective, and has the adaptation manager enter their modes in one adaptation.
"""

from __future__ import annotations

from typing import Any, Final

from regraft import (
    Cancelled,
    Component,
    Future,
    Input,
    Parameter,
    ParameterError,
    Quality,
    RefusalCode,
    RequestRefused,
    action,
    every,
    service,
)
from regraft.adaptation_manager.planners.metacontrol.control import objective_statuses
from regraft.adaptation_manager.planners.metacontrol.control.cycle import Cycle, ReasonerFailed, SystemHealth, Waits
from regraft.adaptation_manager.planners.metacontrol.control.decision_log import DecisionLog
from regraft.adaptation_manager.planners.metacontrol.control.keeping import keep_knowledge
from regraft.adaptation_manager.planners.metacontrol.control.loading import load_all, problems_in
from regraft.adaptation_manager.planners.metacontrol.control.measurements import Times
from regraft.adaptation_manager.planners.metacontrol.control.monitor import Implausible
from regraft.adaptation_manager.planners.metacontrol.control.proposing import choice_of, inputs_schema, objective_of
from regraft.adaptation_manager.planners.metacontrol.control.state import ControlState, Settings
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management import objectives as wire
from regraft.bus_schema.messages.management.system import SystemFaults, SystemStates
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.robots.scopes import scope_of

MAX_GOALS: Final = 64
INPUTS: Final = "inputs."
"""The place of an objective's fields in a proposal's request."""
NO_MANAGER: Final = (
    "needs an adaptation manager, which enters the modes that it decides on: add a component of the class "
    "regraft.adaptation_manager.manager:AdaptationManager"
)
LONGEST: Final = 86_400.0


def _seconds(default: float, description: str, minimum: float = 0.0) -> Parameter[float]:
    return Parameter(default, description, minimum=minimum, maximum=LONGEST, unit="s")


class Metacontroller(Component):
    """Chooses realizations of skills for objectives, and leaves those that fail."""

    resources = Resources(cpu=0.05, memory=80.0)
    state_version = 1
    handler_timeout = 10.0  # the knowledge base is loaded in a hook

    states = Input(SystemStates, topic="system/states", latest_only=True)
    faults = Input(SystemFaults, topic="system/faults", latest_only=True)
    adaptations = Input(
        AdaptationReport, topic="/adaptations", required=False, description="modes are read again after each"
    )
    diagnostics = Input(Diagnostic, required=False, description="what observers report, as MROS2's do")

    skills = Parameter("", "the file of skills", unit="path", exists=True, read_only=True)
    knowledge = Parameter("", "an OWL file with further rules, or a folder of them", unit="path", read_only=True)
    saved_in = Parameter("", "folder for the knowledge base after a failure; empty: the run's folder", unit="path")
    period = Parameter(1.5, "time between two cycles", minimum=0.05, maximum=3600.0, unit="s")
    settle = _seconds(1.0, "time after an adaptation from which measurements count")
    hold = _seconds(1.0, "how long a requirement is missed before that counts")
    stale_after = _seconds(5.0, "how old a measurement may be")
    margin = Parameter(0.05, "how much more useful a design must be to improve on another", minimum=0.0)
    first_rest = _seconds(30.0, "the first rest of a design that has failed; each further one is twice as long", 0.001)
    longest_rest = _seconds(600.0, "the longest rest", 0.001)
    without_design = Parameter("rest", "what becomes of a skill that no design can provide", choices=("rest", "keep"))
    orphan_after = _seconds(10.0, "how long an objective waits for a client whose goal was lost")
    answer_within = Parameter(5.0, "time that the adaptation manager may take to answer", minimum=0.1, unit="s")
    adapt_within = Parameter(30.0, "time that an adaptation may take", minimum=0.1, unit="s")

    reasoning_time = Quality("of the latest decision", unit="s", better="lower", minimum=0.0, estimated=False)

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Refuse what is neither skills nor a knowledge base."""
        if not parameters["skills"] and not parameters["knowledge"]:
            raise ParameterError([("skills", "is empty: name a file of skills, or the files of a knowledge base")])

    @classmethod
    def check_architecture(cls, name: str, parameters: dict[str, Any], architecture: Architecture) -> None:
        """Find what is wrong with the skills in the stack, by the lines of their file."""
        if not any(ADAPT in offered_services(spec).values() for spec in architecture.components.values()):
            raise ValueError(NO_MANAGER)
        scope = scope_of(name, architecture.scopes)
        wrong = problems_in(parameters["skills"], parameters["knowledge"], architecture, scope)
        if wrong:
            raise ParameterError(wrong)

    def on_configure(self) -> None:
        """Load skills and knowledge; raises ValueError with all that is wrong."""
        knowledge, skills = load_all(self.skills, self.knowledge)
        self._state = ControlState(knowledge, skills, self.kit.scope)

    def snapshot(self) -> PlainValue:
        """Return objectives, what provides them, and what has failed."""
        return self._state.remembered()

    def restore(self, state: PlainValue) -> None:
        """Continue with what an earlier run knew."""
        for problem in self._state.restore(state, self.kit.now(), self._settings()):
            self.kit.event("metacontrol.objective_lost", problem)

    def evaluate(self) -> dict[str, float]:
        """Return how long the latest decision took."""
        return {"reasoning_time": self._cycle.reasoning_time}

    def on_activate(self) -> None:
        """Begin to decide."""
        self._waiting: list[Future[None]] = []
        self._begun = self._done = 0
        self._due, self._wake = True, Future[None]()
        self._cycle = Cycle(self.kit, self._state, self._notify)
        self._stale = (self.states.latest, self.faults.latest)
        self._log = DecisionLog(self.kit)
        self._state.store.wait_for_clients(self.kit.now())
        self.kit.spawn(self._control(), "controlling")

    def on_deactivate(self) -> None:
        """Keep the objectives of clients whose goals end with this activity: they may come back."""
        self._state.store.disown()

    # --- monitoring ---

    @every(seconds=period)
    def look(self) -> None:
        """Begin a cycle."""
        self._begin_cycle()

    @faults.handler
    def take_faults(self, faults: SystemFaults) -> None:
        """Decide at once when a component has failed or recovered."""
        self._see()

    @states.handler
    def take_states(self, states: SystemStates) -> None:
        """Decide at once when a component is gone or back."""
        self._see()

    @diagnostics.handler
    def take_diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take what an observer reports."""
        monitor = self._state.monitor
        before = (monitor.failed, monitor.context)
        known = [*self._state.store.names, *(each.objective for each in self._state.groundings)]
        try:
            monitor.take(diagnostic, self.kit.now(), known)
        except Implausible as error:
            self._log.doubt(f"{diagnostic.source}: {diagnostic.text}: {error}")
        if (monitor.failed, monitor.context) != before or diagnostic.text == wire.BINDING_ERROR:
            self._take_in()

    @adaptations.handler
    def take_adaptation(self, report: AdaptationReport) -> None:
        """Look at the modes again when others have changed the architecture, or what was given up has."""
        is_news = report.request.actor != self.kit.name or self._state.given_up
        if is_news and report.revision_after != report.revision_before:
            self._begin_cycle()

    def _see(self) -> None:
        """Take states and faults, but for what came before an inactive time."""
        states, faults = self.states.latest, self.faults.latest
        monitor = self._state.monitor
        before = monitor.down
        stale_states, stale_faults = self._stale
        monitor.see(None if states is stale_states else states, None if faults is stale_faults else faults)
        if monitor.down != before:
            self._begin_cycle()

    # --- the loop ---

    def _begin_cycle(self) -> None:
        self._due = True
        self._wake.resolve(None)

    def _take_in(self) -> None:
        """Keep what has come from outside before anybody counts on it: a cycle under way may last long."""
        self.kit.checkpoint()
        self._begin_cycle()

    async def _control(self) -> None:
        while True:
            if not self._due:
                self._wake = Future()
                await self._wake
            self._due = False
            self._begun += 1
            self.kit.checkpoint()  # an adaptation takes a while, and what has come before it must outlive a crash
            await self._cycle_once()
            self.kit.checkpoint()
            self._done = self._begun
            self._notify()

    async def _cycle_once(self) -> None:
        settings = self._settings()
        self._state.set_rests(settings)
        for name in self._state.end_abandoned(self.kit.now(), settings):
            self.kit.event("metacontrol.ended", f"the client of the objective {name!r} is gone", objective=name)
        try:
            seen = SystemHealth(self.states.latest, self.faults.latest)
            await self._cycle.run(settings, self._waits(), seen, keep=self.without_design == "keep")
            if self._cycle.trouble:
                self._log.complain("metacontrol.not_adapted", self._cycle.trouble)
            else:
                self._log.be_well()
        except RequestRefused as error:
            self._cycle.trouble = str(error)
            self._log.complain("metacontrol.undecided", str(error))
        except ReasonerFailed as error:
            self._cycle.trouble = f"the reasoner failed: {error}"
            kept = keep_knowledge(self._state, self.saved_in, self.kit.system)
            self._log.complain("metacontrol.reasoner_failed", f"{error}; {kept}")
        self._log.show(self._status())

    def _settings(self) -> Settings:
        times = Times(self.settle, self.hold, self.stale_after)
        longest = max(self.first_rest, self.longest_rest)
        return Settings(times, self.margin, self.first_rest, longest, self.orphan_after)

    def _waits(self) -> Waits:
        return Waits(self.answer_within, self.adapt_within)

    def _notify(self) -> None:
        """Wake those that wait for news of objectives."""
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            each.resolve(None)

    def _news(self) -> Future[None]:
        future: Future[None] = Future()
        self._waiting.append(future)
        return future

    async def _settled(self) -> None:
        """Wait until a cycle that begins from now on is done: a checkpoint has what was promised."""
        number = self._begun + 1
        self._begin_cycle()
        while self._done < number:
            await self._news()

    # --- for clients ---

    def _status(self) -> wire.ObjectivesStatus:
        return objective_statuses.all_statuses(self._state, self.kit.now(), self._cycle.trouble)

    def _of(self, names: list[str]) -> wire.ObjectivesStatus:
        every = self._status()
        found = [each for name in names for each in objective_statuses.family(self._state, name, self._cycle.trouble)]
        return wire.ObjectivesStatus(every.stamp, every.context, tuple(found), every.contexts, every.resting)

    @action("planners/{name}/objective", feedback=wire.ObjectiveStatus, goals=MAX_GOALS)
    async def pursue(self, goal: wire.Objective) -> wire.ObjectiveStatus:
        """Keep an objective until its client cancels it, or its skill has ended."""
        owner = self.kit.goal_id
        (entry,) = self._state.store.add([goal], owner, where="")
        name = entry.given.name
        self._take_in()
        shown: wire.ObjectiveStatus | None = None
        try:
            while True:
                status = next(objective_statuses.family(self._state, name, self._cycle.trouble))
                if status != shown:
                    self.kit.feedback(status)
                    shown = status
                await self._news()
                if name not in self._state.store:
                    state, task = wire.ObjectiveState.UNGROUNDED, entry.given.task
                    return wire.ObjectiveStatus(
                        name, entry.given.skill, state, task, progress=entry.progress, ended=True
                    )
        except Cancelled:
            entry.release(owner)
            self._take_in()
            raise

    @service("planners/{name}/objectives/add")
    async def add(self, request: wire.ObjectivesRequest) -> wire.ObjectivesStatus:
        """Add objectives, all of them or none."""
        if not request.objectives:
            raise RequestRefused("is empty: give at least one objective", RefusalCode.MALFORMED, field="objectives")
        names = [entry.given.name for entry in self._state.store.add(request.objectives)]
        if request.wait:
            await self._settled()
        else:
            self._take_in()
        return self._of([name for name in names if name in self._state.store])

    @service("planners/{name}/objectives/list")
    def report_all(self, request: wire.ObjectivesQuery) -> wire.ObjectivesStatus:
        """Report all objectives, or one."""
        return self._of([request.objective]) if request.objective else self._status()

    @service("planners/{name}/objectives/explain")
    def explain(self, request: wire.ExplanationQuery) -> wire.Explanation:
        """Explain the latest decision on an objective."""
        return objective_statuses.explanation(self._state, request.objective, self.kit.now(), self._cycle.trouble)

    @service("planners/{name}/objectives/cancel")
    async def cancel(self, request: wire.ObjectivesCancellation) -> wire.ObjectivesStatus:
        """End an objective, or all of a task; answers with those that are left."""
        if bool(request.objective) == bool(request.task):
            raise RequestRefused("give an objective or a task, one of them", RefusalCode.MALFORMED, field="objective")
        store = self._state.store
        names = store.of_task(request.task) if request.task else [store[request.objective].given.name]
        for name in names:
            self._state.end(name)
        self._notify()
        if request.wait:
            await self._settled()
        else:
            self._take_in()
        return self._status()

    @service("planners/{name}/objectives/report")
    def take_progress(self, request: wire.ProgressReport) -> wire.ObjectiveStatus:
        """Take a skill's result; one that ends the skill ends the objective."""
        entry = self._state.store[request.objective]
        entry.progress = self._state.translator.progress(entry.given.skill, request.text, request.number)
        status = next(objective_statuses.family(self._state, request.objective, self._cycle.trouble))
        if status.ended:
            self._state.end(request.objective)
            self._begin_cycle()
        self.kit.checkpoint()
        self._notify()
        return status

    @service("planners/{name}/objectives/context")
    def set_context(self, request: wire.ContextRequest) -> wire.ContextStatus:
        """Set the context."""
        before = self._state.monitor.context
        try:
            self._state.monitor.set_context(request.context)
        except Implausible as error:
            raise RequestRefused(str(error), RefusalCode.NOT_FOUND, field="context") from None
        self._take_in()
        return wire.ContextStatus(request.context, before)

    # --- as a planner ---

    @service("planners/{name}/describe")
    def describe(self, query: PlannerQuery) -> PlannerDescription:
        """Return what can be asked for."""
        return PlannerDescription(self.kit.name, self.kit.name, type(self).__doc__ or "", inputs_schema())

    @service("planners/{name}/propose")
    async def propose(self, request: ProposalRequest) -> Proposal:
        """Decide on one more objective, and keep it from now on if that is wanted."""
        given = objective_of(request)
        if not request.apply:
            (entry,) = self._state.store.prepared([given], INPUTS)
            try:
                return await self._cycle.proposal(entry.objective, self._settings(), self._waits())
            except ReasonerFailed as error:
                raise RequestRefused(f"the reasoner failed: {error}", RefusalCode.UNAVAILABLE) from None
        self._state.store.add([given], where=INPUTS)
        await self._settled()
        decision = self._state.decided.plan.of(given.name) if self._state.decided else None
        if decision is None:
            raise RequestRefused(self._cycle.trouble or "no decision was made", RefusalCode.UNAVAILABLE)
        done = self._cycle.latest
        outcome = done.outcome if done is not None and decision.is_change else "unchanged"
        changes = done.changes if done is not None else ()
        return Proposal(request.task, changes, choice_of(decision, outcome), "", done.report if done else None)
