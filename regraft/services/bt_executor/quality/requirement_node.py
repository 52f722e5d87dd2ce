"""The base of quality requirements in a tree: QR decorators (ReBeT, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any, ClassVar

from behavior_tree import (
    FAILURE,
    IDLE,
    RUNNING,
    SKIPPED,
    SUCCESS,
    Decorator,
    Input,
    Node,
    NodeSetup,
    Output,
    PortError,
    Status,
)
from behavior_tree.nodes.ports import Port
from behavior_tree.nodes.text import board_key
from regraft.bus_schema.messages.quality import Quality, QualityLevel
from regraft.services.bt_executor.quality.data import age_of
from regraft.services.bt_executor.quality.naming import key_safe
from regraft.services.bt_executor.quality.over_time import MeanOverTime, Metric, Unknown
from regraft.services.bt_executor.quality.satisfaction_degree import SATISFIED_FROM
from regraft.services.bt_executor.quality.verdict import UNKNOWN, QualityTeller, Verdict, explained, sendable

COMPLETED = (SUCCESS, FAILURE)


class QualityRequirement(Decorator):
    """The base of task-level and system-level requirements; subclass `TaskLevelQR` or `SystemLevelQR`.

    A requirement never changes what its child does or returns: it ticks the child once and returns its status. While
    the child is RUNNING the requirement is measured, after the child's tick; when the child completes, `on_end` may
    give a last metric. A child that completes in its first tick is measured once, then. A failure while measuring is no
    error of the tree: the quality is then unknown, and reports why.

    The mean is over time, see `MeanOverTime`: from the loading of the tree on, over the seconds in which the child was
    running and the metric known. While the metric is unknown, the entry of its port is empty, so no decision uses an
    old one. A requirement whose child is done keeps its last.

    Unlike other decorators it does not reset a child that completed before it is reset itself: a leaf that repeats its
    result under a reactive parent does so under a requirement too.

    Attributes:
        context: Where reports go.
        bus_name: Its name on the bus, unique once the tree has been taken into a `LatestQualities`.
        verdict: The present knowledge of it.
        is_active: Whether the child is running.
        told_weight: How important it is, as last read.
        told_attribute: Its attribute, as last read.
    """

    attribute: ClassVar[str] = ""
    """The attribute, any name such as Safety; a class that leaves it open takes the XML's ``quality_attribute``."""
    higher_is_better: ClassVar[bool] = True
    level: ClassVar[QualityLevel]

    weight = Input(float, default=1.0, description="how important it is, 0 or more")
    quality_attribute = Input(str, default="", description="what it is about, such as Safety or Power")
    stale_after = Input(float, default=0.0, description="seconds from which on data are too old; 0: never")
    satisfied_status = Input(str, default="satisfied", description="out_status while it is satisfied")
    violated_status = Input(str, default="violated", description="out_status while it is not")
    metric = Output(float, description="the measure; empty while it is unknown")
    mean_metric = Output(float, description="its mean over time")
    out_status = Output(str, description=f"how it is satisfied, in a word; '{UNKNOWN}' while that is not known")

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make sure that a subclass's ports hide nothing of this class."""
        super().__init_subclass__(**kwargs)
        for name, value in vars(cls).items():
            hidden = getattr(QualityRequirement, name, None)
            is_taken = hidden is not None or name in _UNSET_ATTRIBUTES
            if isinstance(value, Port) and is_taken and not isinstance(hidden, Port):
                raise TypeError(f'{cls.__name__}.{name} hides an attribute; declare the port with name="{name}"')

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup)
        self.context = context
        self.bus_name = key_safe(self.name)
        self.verdict = Verdict(Metric(None, 0.0, "nothing has been measured yet"))
        self.is_active = False
        self.told_weight = 1.0
        self.told_attribute = self.attribute
        self._mean = MeanOverTime()
        self._start_failed = ""
        self._is_measured = False
        self._data_keys: tuple[str, ...] | None = None

    # --- for authors ---

    def required_ports(self) -> tuple[str, ...]:
        """Return the inputs that the XML has to give: by default those without a default."""
        ports = self.setup.manifest.ports.values()
        return tuple(port.name for port in ports if port.is_input and port.default is None)

    def data_ports(self) -> tuple[str, ...]:
        """Return the inputs that hold data: while one is empty or stale, the metric is unknown.

        By default the required ones. The others are settings, whose age does not matter.
        """
        return self.required_ports()

    def on_start(self) -> None:
        """Prepare for a run of the child; called before its first tick."""

    def measure(self) -> float | None:
        """Return the metric, None if there is nothing to measure.

        It is called after each tick that left the child RUNNING. Where the child completed in its first tick, it is
        called if `on_end` has no metric.
        """
        raise NotImplementedError(f"{type(self).__name__} does not implement measure()")

    def on_end(self, status: Status) -> float | None:
        """Return the last metric of a run, None to keep the one there is; not called when the child is halted.

        Args:
            status: The child's result, SUCCESS or FAILURE.
        """
        return None

    def degree_of(self, metric: float) -> float | None:
        """Return how far a metric satisfies the requirement, in [0, 1]; None if that is only a yes or no."""
        return None

    def is_satisfied(self, metric: float) -> bool | None:
        """Return whether a metric satisfies the requirement; None if nothing is required.

        By default it does from a degree of one half on.
        """
        degree = self.degree_of(metric)
        return None if degree is None else degree >= SATISFIED_FROM

    def status_text(self, metric: float | None, satisfied: bool | None) -> str:
        """Return a word for people and trees; a metric of None is unknown."""
        if metric is None:
            return UNKNOWN
        if satisfied is None:
            return "measured"
        return self.satisfied_status if satisfied else self.violated_status

    def now(self) -> float:
        """Return the time on the tree's clock, in seconds."""
        return self.runtime.clock.now()

    # --- the decorator ---

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check the ports; see `Node.adopt`."""
        super().adopt(children)
        given = self.setup.attributes
        missing = [port for port in self.required_ports() if port not in given]
        if missing:
            raise ValueError(f"{self.type_id} needs the port{'s' * (len(missing) > 1)} {', '.join(missing)}")
        if self.attribute and given.get("quality_attribute", self.attribute) != self.attribute:
            raise ValueError(f"{self.type_id} is about {self.attribute}; leave quality_attribute out")
        if not self.attribute and not given.get("quality_attribute", "").strip():
            raise ValueError(f"{self.type_id} needs quality_attribute: what it is about, such as Safety or Power")
        if self.has_literal("quality_attribute"):
            self.told_attribute = self.quality_attribute
        for port in ("weight", "stale_after"):
            if self.has_literal(port) and self.read_port(port) < 0.0:
                raise ValueError(f"{port} is {self.read_port(port):g}; it must be 0 or more")

    def execute_tick(self) -> Status:
        """Tick the node and, unlike `Decorator.execute_tick`, leave a child that completed as it is."""
        return Node.execute_tick(self)

    def tick(self) -> Status:
        """Tick the child once, then measure."""
        if self.status == IDLE:
            self.set_running()
        if self.status == RUNNING and not self.is_active:
            self._begin()
        try:
            status = self.child.execute_tick()
        except BaseException:
            self._leave()
            raise
        if status == SKIPPED:
            self._leave()
            self.set_status(self.child.status)
        elif status == RUNNING:
            if not self.is_active:
                self._begin()
            self._is_measured = True
            self._take(self._observed(self.measure))
        elif self.is_active:
            self._end(status)
        return status

    def halt(self) -> None:
        """Reset the child and become idle; the requirement is not active any more."""
        try:
            super().halt()
        finally:
            self._leave()

    def set_status(self, status: Status) -> None:
        """Store a status; making this node idle resets a child that completed, too."""
        super().set_status(status)
        if status == IDLE and self.child.status in COMPLETED:
            self.child.reset()

    # --- measuring ---

    def _begin(self) -> None:
        self.is_active = True
        self._is_measured = False
        self._start_failed = ""
        try:
            self.on_start()
        except Exception as error:
            self._start_failed = explained(error)

    def _end(self, status: Status) -> None:
        if not self._is_measured:
            self._take(self._observed(lambda: self._only_metric(status)), is_last=True)
        elif type(self).on_end is not QualityRequirement.on_end:
            self._take(self._observed(lambda: self.on_end(status), kept=self.verdict.metric), is_last=True)
        else:
            self._leave()

    def _only_metric(self, status: Status) -> float | None:
        """Return the metric of a run that was over in one tick."""
        last = self.on_end(status)
        return self.measure() if last is None else last

    def _leave(self) -> None:
        """Stop being active, with what is known."""
        if self.is_active:
            self.is_active = False
            self._mean.hold(None, self.now())
            self._write("mean_metric", self._mean.value)
            self._tell()

    def _observed(self, hook: Callable[[], float | None], kept: Metric | None = None) -> Metric:
        """Return what a hook measures, or why it measures nothing; ``kept`` replaces its None."""
        now = self.now()
        try:
            if self._start_failed:
                raise Unknown(self._start_failed)
            self._read_settings()
            age = self._age_of_data(now)
            value = hook()
            if value is None and kept is not None:
                return kept
            if value is None:
                raise Unknown("there is nothing to measure")
            if not math.isfinite(value):
                raise Unknown(f"it comes out as {value}")
            return Metric(float(value), now - age)
        except Unknown as error:
            return Metric(None, now, str(error))
        # An author's method may raise anything; the task continues.
        except Exception as error:
            return Metric(None, now, explained(error))

    def _read_settings(self) -> None:
        weight = self.weight
        if not 0.0 <= weight < math.inf:
            raise Unknown(f"its weight is {weight:g}; it must be 0 or more")
        self.told_weight = weight
        self.told_attribute = self.attribute or self.quality_attribute

    def data_keys(self) -> tuple[str, ...]:
        """Return the blackboard entries that the data come from."""
        keys = (board_key(self.setup.attributes.get(port, ""), port) for port in self.data_ports())
        return tuple(key for key in keys if key is not None)

    def _age_of_data(self, now: float) -> float:
        if self._data_keys is None:
            self._data_keys = self.data_keys()
        limit, oldest = self.stale_after, 0.0
        for key in self._data_keys:
            age = age_of(self.blackboard, key, now)
            if 0.0 < limit < age:
                raise Unknown(f"the data in '{key}' are more than {limit:g} s old")
            oldest = max(oldest, age)
        return oldest

    def _take(self, metric: Metric, *, is_last: bool = False) -> None:
        """Judge a metric, write the outputs and report the quality."""
        now = self.now()
        self.verdict = self._judged(metric)
        value = self.verdict.metric.value
        self._mean.hold(value, now)
        if is_last:
            self.is_active = False
            self._mean.hold(None, now)
        self._write("metric", value)
        self._write("mean_metric", self._mean.value)
        self._write("out_status", self.verdict.status)
        self._tell()

    def _judged(self, metric: Metric) -> Verdict:
        try:
            if metric.value is None:
                return Verdict(metric, status=self.status_text(None, None))
            degree, satisfied = self.degree_of(metric.value), self.is_satisfied(metric.value)
            if degree is None and satisfied is not None:
                degree = 1.0 if satisfied else 0.0
            if degree is not None and not 0.0 <= degree <= 1.0:
                raise Unknown(f"its degree is {degree:g}; it must be within [0, 1]")
            return Verdict(metric, satisfied, degree, self.status_text(metric.value, satisfied))
        except Unknown as error:
            return Verdict(Metric(None, metric.time, str(error)))
        except Exception as error:
            return Verdict(Metric(None, metric.time, explained(error)))

    def _write(self, port: str, value: float | str | None) -> None:
        if port not in self.setup.writers:
            return
        if value is not None:
            # An entry that has become another type by a script is the tree's affair, and no reason to fail here.
            with suppress(PortError):
                self.write_port(port, value)
            return
        key = board_key(self.setup.attributes[port], port)
        entry = self.blackboard.find(key) if key else None
        if entry is not None and entry.value is not None:
            self.blackboard.store(entry, None)

    def _tell(self) -> None:
        metric = self.verdict.metric
        self.context.report_quality(
            Quality(
                stamp=self.now(),
                requirement=self.bus_name,
                attribute=sendable(self.told_attribute),
                node=self.path,
                level=self.level,
                metric=metric.value,
                measured=metric.time if metric.is_valid else None,
                mean=self._mean.value,
                satisfied=self.verdict.satisfied,
                degree=self.verdict.degree,
                status=sendable(self.verdict.status),
                reason=sendable(metric.reason),
                weight=self.told_weight,
                higher_is_better=self.higher_is_better,
                active=self.is_active,
            )
        )


_UNSET_ATTRIBUTES = ("level", "context", "bus_name", "verdict", "is_active", "told_weight", "told_attribute")
