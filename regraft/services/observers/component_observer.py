"""The observer of components: reports which have failed and which have recovered, as MROS2's modes observer does."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from regraft import Component, Input, Level, Output, Parameter, ParameterError, Quality, Records, every
from regraft.bus_schema.annotations import PlainValue, Text
from regraft.bus_schema.messages.health import Diagnostic, SensorHealth
from regraft.bus_schema.messages.management.objectives import COMPONENT_STATUS
from regraft.bus_schema.messages.management.system import SystemFaults, SystemMeasurements, SystemStates
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import component_in_scope, in_scope, scope_of
from regraft.bus_schema.suggestions import no_such
from regraft.services.observers.condition import ComponentStatus, Condition, Delays, Evidence
from regraft.services.observers.evidence import of_life, of_sensors, topics_of
from regraft.services.observers.fitness import ComponentCondition, Fitness, condition_problems
from regraft.services.observers.observed_components import read_observed_components
from regraft.services.observers.situation import Situation
from regraft.stack.yaml.problems import StackError

MEASUREMENTS: Final = "measurements"
UNFIT: Final = "unfit"


@dataclass(frozen=True, slots=True)
class WatchedSensor:
    """A topic of a sensor, and the component that has failed when the sensor has."""

    topic: Annotated[str, Text(200)]
    component: Annotated[str, Text(200)]


def _seconds(default: float, description: str) -> Parameter[float]:
    return Parameter(default, description, minimum=0.0, maximum=3600.0, unit="s")


class ComponentObserver(Component):
    """Publishes ``Component status`` diagnostics of the observed components: ``TRUE``, ``FALSE`` and ``RECOVERED``.

    A component has failed when it leaves its state by itself, or when its process ends, hangs or is quarantined. It
    has failed, too, when a sensor is faulty whose topic it writes. One that an adaptation has deactivated has not.
    With ``conditions`` a component that works can count as failed by what it measures, such as an empty battery.
    """

    resources = Resources(cpu=0.01, memory=25.0)
    state_version = 1
    checkpoint_every = 1.0

    observed = Parameter("", "the generated observed_components.yaml", unit="path", read_only=True, exists=True)
    sensors = Records(WatchedSensor, "components of sensors' topics, where they are not the topics' writers")
    conditions = Records(ComponentCondition, "when components that work count as failed, by what is measured")
    ignored_faults = Parameter(("jumpy",), "faults of sensors that are no failures of components")
    look_period = Parameter(
        0.1, "time between two looks at the evidence", minimum=0.01, maximum=10.0, unit="s", read_only=True
    )
    period = Parameter(2.0, "how often all statuses are repeated", minimum=0.1, maximum=3600.0, unit="s")
    failed_after = _seconds(0.2, "how long a failure has to last before it is reported")
    recovered_after = _seconds(1.0, "how long a recovery has to last before it is reported")
    first_within = _seconds(5.0, "how long a component may take to have its first run")
    sensor_grace = _seconds(3.0, "how long a sensor may take to be heard after an activation")
    presumed_after = _seconds(0.0, "inactive time after which what failed is tried again; 0: never")
    health_holds = Parameter(3.0, "how long the news of sensors hold", minimum=0.1, maximum=3600.0, unit="s")

    states = Input(SystemStates, topic="system/states", latest_only=True)
    faults = Input(SystemFaults, topic="system/faults", latest_only=True)
    sensor_health = Input(SensorHealth, latest_only=True, required=False, description="what is wrong with the sensors")
    architecture = Input(
        Architecture,
        topic="/architecture",
        latest_only=True,
        required=False,
        description="which component writes a topic",
    )
    diagnostics = Output(Diagnostic, description="the statuses of components")

    failures = Quality("observed components that have failed", better="lower", minimum=0.0, estimated=False)

    def __init__(self) -> None:
        self._conditions: dict[str, Condition] = {}
        self._remembered: dict[str, PlainValue] = {}
        self._fitness: list[tuple[str, Fitness]] = []
        self._stale: tuple[SystemStates | None, SystemFaults | None] = (None, None)

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any]]:
        """Name the input of measurements, if there are conditions over them."""
        if parameters["conditions"]:
            yield Input(
                SystemMeasurements,
                topic="system/measurements",
                latest_only=True,
                description="what the conditions are about",
                name=MEASUREMENTS,
                origin="conditions",
            )

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Find what is wrong with the file, conditions of what is not observed, and topics that are given twice."""
        observed = _read(parameters["observed"])
        strange = [
            (f"conditions.{index}.component", no_such("observed component", condition.component, observed))
            for index, condition in enumerate(parameters["conditions"])
            if condition.component not in observed
        ]
        if strange:
            raise ParameterError(strange)
        topics = [sensor.topic for sensor in parameters["sensors"]]
        twice = [f"sensors.{i}.topic" for i, topic in enumerate(topics) if topic in topics[:i]]
        if twice:
            raise ParameterError([(place, "this topic is given before: leave one out") for place in twice])

    @classmethod
    def check_architecture(cls, name: str, parameters: dict[str, Any], architecture: Architecture) -> None:
        """Find observed components and sensors' topics that are not there."""
        scope = scope_of(name, architecture.scopes)
        problems = list(condition_problems(parameters["conditions"], scope, architecture))
        for component, location in _read(parameters["observed"]).items():
            problem = _component_problem(component_in_scope(scope, component), architecture)
            if problem:
                problems.append(("observed", f"{location}: {problem}"))
        for index, sensor in enumerate(parameters["sensors"]):
            topic = in_scope(scope, sensor.topic)
            if topic not in architecture.topics:
                problems.append((f"sensors.{index}.topic", no_such("topic", topic, architecture.topics)))
            problem = _component_problem(component_in_scope(scope, sensor.component), architecture)
            if problem:
                problems.append((f"sensors.{index}.component", problem))
        if problems:
            raise ParameterError(problems)

    def snapshot(self) -> PlainValue:
        """Return what is known of each component: until the first activation, what was restored."""
        if not self._conditions:
            return self._remembered
        known: dict[str, Any] = {name: condition.remembered() for name, condition in self._conditions.items()}
        for component, fitness in self._fitness:
            if fitness.unfit and component in known:
                known[component].setdefault(UNFIT, []).append(fitness.text)
        return known

    def restore(self, state: PlainValue) -> None:
        """Continue with what an earlier run knew."""
        self._remembered, self._conditions = (state if isinstance(state, dict) else {}), {}
        self._fitness = []

    def on_configure(self) -> None:
        """Read what is observed; raises ParameterError."""
        self._names = {component_in_scope(self.kit.scope, name): name for name in _read(self.observed)}
        self._given = {
            in_scope(self.kit.scope, sensor.topic): component_in_scope(self.kit.scope, sensor.component)
            for sensor in self.sensors
        }

    def on_activate(self) -> None:
        """Begin to look, with what was known."""
        known = self._remembered | self.snapshot()
        self._conditions = {component: Condition(known.get(component)) for component in self._names}
        self._fitness = list(self._known_fitness(known))
        self._published: set[str] = set()
        self._topics: dict[str, set[str]] = {}
        self._seen_architecture: Architecture | None = None
        self._began = self.kit.now()
        self._repeated = -self.period

    def on_deactivate(self) -> None:
        """Note what was read last: it may be wrong by the next activation."""
        self._stale = (self.states.latest, self.faults.latest)

    @every(seconds=look_period)
    def look(self) -> None:
        """Take the evidence in; publish what has changed, and now and then everything."""
        now = self.kit.now()
        states = None if self.states.latest is self._stale[0] else self.states.latest
        faults = None if self.faults.latest is self._stale[1] else self.faults.latest
        repeats = now - self._repeated >= self.period
        if repeats:
            self._repeated = now
        delays = Delays(self.failed_after, self.recovered_after, self.sensor_grace, self.presumed_after)
        must_run = now - self._began >= self.first_within
        self._see_fitness(now, states, faults)
        self._see_architecture()
        for component, condition in self._conditions.items():
            life = self._with_fitness(component, of_life(component, states, faults, must_run=must_run))
            topics = self._topics.get(component, set())
            sensor = of_sensors(topics, self.sensor_health.latest, now, self.health_holds, self.ignored_faults)
            is_active = states is not None and states.state_of(component) is State.ACTIVE
            changed = condition.see(now, is_active, life, sensor, delays)
            if changed:
                self._report(component, condition)
            # Where the evidence has just turned, a reader that sees it itself would be led back.
            if changed or (condition.is_certain and (repeats or component not in self._published)):
                self._published.add(component)
                self._publish(self._names[component], condition, now)

    def evaluate(self) -> dict[str, float]:
        """Return how many components have failed, as ``failures``."""
        return {"failures": float(sum(each.status is ComponentStatus.FAILED for each in self._conditions.values()))}

    def _known_fitness(self, known: dict[str, Any]) -> Iterable[tuple[str, Fitness]]:
        for condition in self.conditions:
            component, fitness = component_in_scope(self.kit.scope, condition.component), Fitness(condition)
            fitness.unfit = fitness.text in (known.get(component) or {}).get(UNFIT, ())
            yield component, fitness

    def _see_fitness(self, now: float, states: SystemStates | None, faults: SystemFaults | None) -> None:
        if self._fitness:
            measured = self.kit.inputs[MEASUREMENTS].latest
            situation = Situation(self.kit.scope, now, states, faults, measured)
            for _, fitness in self._fitness:
                fitness.see(situation)

    def _with_fitness(self, component: str, life: Evidence) -> Evidence:
        """Return the evidence, or that of the first condition by which a component that works is unfit."""
        unfit = [each.text for owner, each in self._fitness if owner == component and each.unfit]
        return Evidence(True, unfit[0]) if unfit and not life.failed else life

    def _see_architecture(self) -> None:
        architecture = self.architecture.latest
        if not self._topics or architecture is not self._seen_architecture:
            self._seen_architecture = architecture
            self._topics = topics_of(self._names, architecture, self._given)

    def _report(self, component: str, condition: Condition) -> None:
        if condition.status is ComponentStatus.FAILED:
            self.kit.event("observer.failed", f"{component} has failed: {condition.why}", component=component)
        elif condition.status is ComponentStatus.RECOVERED:
            self.kit.event("observer.recovered", f"{component} has recovered", component=component)

    def _publish(self, name: str, condition: Condition, now: float) -> None:
        level = Level.ERROR if condition.status is ComponentStatus.FAILED else Level.OK
        values = {name: condition.status.value}
        self.diagnostics.publish(Diagnostic(now, self.kit.name, name, level, COMPONENT_STATUS, values))


def _read(file: str) -> dict[str, Any]:
    if not file:
        raise ParameterError([("observed", "names no file: must be the generated observed_components.yaml")])
    try:
        return dict(read_observed_components(Path(file)))
    except StackError as error:
        raise ParameterError([("observed", str(problem)) for problem in error.problems]) from None


def _component_problem(component: str, architecture: Architecture) -> str:
    """Return why a component cannot be observed, empty if it can."""
    spec = architecture.components.get(component)
    if spec is None:
        return no_such("component", component, architecture.components)
    return "" if spec.managed else f"{component!r} is unmanaged: it has no lifecycle to observe"
