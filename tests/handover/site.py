"""Where components are handed over: on threads on either bus, or as processes on the real one; and who does it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from regraft.bus.interface import Bus
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlError, Peer, Rewire, RewireStep
from regraft.bus_schema.messages.protocol.handover import Handover, HandoverStep
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client
from regraft.component.component import Component, class_path
from regraft.patience import stretched
from regraft.runtime.core.assignment import Assignment, Succession
from regraft.runtime.runtime import Runtime
from tests.handover import parts
from tests.handover.parts import Ask, Asked, Item, Report
from tests.support.buses import Buses
from tests.support.machine.ports import free_endpoint
from tests.support.machine.processes import kill, send, stop
from tests.support.machine.threads import ComponentThread
from tests.support.nursery import Nursery
from tests.support.waiting import PATIENCE, wait_until

Run = tuple[str, int]
R = TypeVar("R")


class Refused(Exception):
    """A control query was answered with an error."""

    def __init__(self, error: ControlError) -> None:
        self.error = error
        super().__init__("; ".join(error.problems))


@dataclass(slots=True)
class Swap:
    """How a hand-over went, in seconds."""

    took: float
    silent: float


@dataclass(slots=True)
class Wiring:
    """The other ends of a component's ports: topic to writers, topic to readers."""

    inputs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: dict[str, tuple[str, ...]] = field(default_factory=dict)


class Site:
    """A hub, components around it, and a driver who does what an adaptation manager would."""

    def __init__(self) -> None:
        self.keys = Keys("site")
        self.incarnations: dict[str, int] = {}
        self.numbers: dict[str, int] = {}
        self.assigned: dict[str, dict[str, Any]] = {}
        self.term: int | None = None
        self.bus = self.session()
        self.client = Client(self.session(), "site", "tester")

    def session(self) -> Bus:
        """Open a session."""
        raise NotImplementedError

    def launch(self, cls: type[Component], assignment: Assignment) -> None:
        """Run a component."""
        raise NotImplementedError

    def kill(self, name: str, incarnation: int) -> None:
        """End a run at once, for certain."""
        raise NotImplementedError

    def renamed(self, name: str, incarnation: int, anew: int) -> None:
        """Know a run by another incarnation too."""
        raise NotImplementedError

    def gone(self, name: str, incarnation: int) -> bool:
        """Tell whether a run has ended."""
        raise NotImplementedError

    def close(self) -> None:
        """End everything."""
        raise NotImplementedError

    # --- what a manager does ---

    def start(self, cls: type[Component], name: str, **assigned: Any) -> None:
        """Start the first run of a component and wait for it."""
        self.incarnations[name], self.assigned[name], self.numbers[name] = 1, assigned, 1
        self.launch(cls, Assignment("site", name, class_path(cls), term=self.term, **assigned))
        token = self.keys.alive(name, 1)
        wait_until(lambda: self.bus.present(token, 1.0), f"{name} lives")
        state = assigned.get("state", State.ACTIVE)
        wait_until(lambda: self.view(name).state is state, f"{name} is {state.value}")

    def restart(self, cls: type[Component], name: str) -> None:
        """Start a run of a component that has ended, as its host would after a crash."""
        self.incarnations[name] = self._next(name)
        run = self.incarnations[name]
        self.launch(cls, Assignment("site", name, class_path(cls), run, term=self.term, **self.assigned[name]))
        wait_until(lambda: self.bus.present(self.keys.alive(name, run), 1.0), f"{name} lives again")

    def spawn(self, cls: type[Component], name: str, *, with_state: bool = True, **assigned: Any) -> int:
        """Start a successor beside a living run, and wait until it is ready; returns its incarnation."""
        incumbent = self.incarnations[name]
        successor = self._next(name)
        given = {**self.assigned[name], **assigned}
        succession = Succession(incumbent, with_state)
        assignment = Assignment("site", name, class_path(cls), successor, term=self.term, succeeds=succession, **given)
        self.launch(cls, assignment)
        token = self.keys.standby(name, successor)
        wait_until(lambda: self.bus.present(token, 1.0), f"{name} {successor} stands by")
        return successor

    def control(
        self, name: str, incarnation: int, verb: str, message: Any = None, within: float = 5.0
    ) -> ComponentView:
        """Ask a run; raises Refused, or TimeoutError where nobody answers."""
        payload = codec.encode(message) if message is not None else b""
        answers = self.bus.query(self.keys.control(name, incarnation, verb), payload, stretched(within))
        if not answers:
            raise TimeoutError(f"{name} {incarnation} does not answer")
        if answers[0].error:
            raise Refused(codec.decode(answers[0].payload, ControlError))
        return codec.decode(answers[0].payload, ComponentView)

    def view(self, name: str) -> ComponentView:
        """Return the live run as it is."""
        return self.control(name, self.incarnations[name], "parameters")

    def step(self, name: str, run: int, step: HandoverStep, within: float = 5.0, **more: Any) -> dict[str, Any]:
        """Ask one step of a hand-over; returns the detail of the answer."""
        return self.control(name, run, "handover", Handover(step, term=self.term, **more), within).detail

    def role(self, name: str, incarnation: int) -> str:
        """Return a run's role."""
        return str(self.step(name, incarnation, HandoverStep.READ)["role"])

    def bind(self, name: str, successor: int, wiring: Wiring) -> None:
        """Have markers put until nothing can be missed."""
        for topic, writers in wiring.inputs.items():
            peers = tuple(Peer(writer, self.incarnations[writer]) for writer in writers)
            self._until_seen(topic, [(w, self.incarnations[w]) for w in writers], (name, successor), peers)
        for topic, readers in wiring.outputs.items():
            for reader in readers:
                there = (reader, self.incarnations[reader])
                self._until_seen(topic, [(name, successor)], there, (Peer(f"{name}+", successor),))

    def _until_seen(self, topic: str, writers: Iterable[Run], reader: Run, peers: tuple[Peer, ...]) -> None:
        def seen() -> bool:
            for writer in writers:
                self.control(*writer, "connections", Rewire(RewireStep.MARK, topic=topic, term=self.term))
            wait = Rewire(RewireStep.AWAIT, topic=topic, peers=peers)
            return not self.control(*reader, "connections", wait).detail["missing"]

        wait_until(seen, f"{reader} sees {peers} on {topic}")

    def _next(self, name: str) -> int:
        """Return a number that no run of the component has had."""
        self.numbers[name] += 1
        return self.numbers[name]

    def resume(self, name: str, incumbent: int, successor: int) -> None:
        """Have a frozen incumbent speak again after its successor, which has ended, was told to take over."""
        anew = self._next(name)
        self.step(name, incumbent, HandoverStep.RESUME, peer=successor, incarnation=anew)
        self.incarnations[name] = anew
        self.renamed(name, incumbent, anew)

    def take_back(self, name: str, incumbent: int) -> None:
        """Have a frozen incumbent take over from its successor, which is live, and end that."""
        successor, anew = self.incarnations[name], self._next(name)
        self.step(name, incumbent, HandoverStep.TAKE_OVER, peer=successor, incarnation=anew)
        self.incarnations[name] = anew
        self.renamed(name, incumbent, anew)
        self.step(name, successor, HandoverStep.RETIRE)
        wait_until(lambda: self.gone(name, successor), f"{name} {successor} ends")

    def swap(self, cls: type[Component], name: str, wiring: Wiring, **assigned: Any) -> Swap:
        """Hand a component over to a new run."""
        begun = time.monotonic()
        incumbent, successor = self.incarnations[name], self.spawn(cls, name, **assigned)
        self.bind(name, successor, wiring)
        told = self.step(name, successor, HandoverStep.TAKE_OVER)
        self.incarnations[name] = successor
        self.step(name, incumbent, HandoverStep.RETIRE)
        took = time.monotonic() - begun
        wait_until(lambda: self.gone(name, incumbent), f"{name} {incumbent} ends")
        return Swap(took, float(told["silent"]))

    # --- what is looked at ---

    def ask(self, service: str, request: object, reply: type[R]) -> R:
        """Call a service."""
        return self.client.call(service, request, reply, PATIENCE)

    def report(self, *, anew: bool = False) -> Report:
        """Return what the sink has noticed; ``anew`` has it forget the longest gap."""
        return self.ask("report", Ask(int(anew)), Report)

    def asked(self) -> Asked:
        """Return how the caller's calls went."""
        return self.ask("asked", Ask(), Asked)

    def hears_on(self, count: int) -> Report:
        """Wait until the sink has heard so many more; returns its report."""
        goal = self.report().heard + count
        wait_until(lambda: self.report().heard >= goal, f"the sink hears {count} more")
        return self.report()

    def all_was_heard(self) -> Report:
        """Wait until the sink has heard what the source says now; returns its report."""
        last = self.ask("say", Ask(), Item).number
        wait_until(lambda: self.report().last >= last, "the sink hears the source's last item")
        return self.report()

    def faults(self) -> tuple[int, int, int, int]:
        """Return how many items were lost, doubled, disordered and wrong until now."""
        report = self.all_was_heard()
        return report.lost, report.doubled, report.disordered, report.wrong


class Threads(Site):
    """Each run on a thread of its own. To be killed, it is cut off from the bus."""

    def __init__(self, kind: str) -> None:
        self._buses = Buses(kind)
        self.runtimes: dict[Run, Runtime] = {}
        self._threads: dict[Run, ComponentThread] = {}
        self._cut_off: set[ComponentThread] = set()
        super().__init__()

    def session(self) -> Bus:
        """Open a session."""
        return self._buses.session()

    def launch(self, cls: type[Component], assignment: Assignment) -> None:
        """Run it on a thread."""
        run = assignment.name, assignment.incarnation

        def built(runtime: Runtime) -> None:
            self.runtimes[run] = runtime

        self._threads[run] = ComponentThread(cls, assignment, self.session(), built=built)

    def kill(self, name: str, incarnation: int) -> None:
        """Cut it off from the bus."""
        self._cut_off.add(self._threads[name, incarnation])
        self.runtimes[name, incarnation].bus.close()

    def renamed(self, name: str, incarnation: int, anew: int) -> None:
        """Know a run by another incarnation too."""
        self.runtimes[name, anew] = self.runtimes[name, incarnation]
        self._threads[name, anew] = self._threads[name, incarnation]

    def gone(self, name: str, incarnation: int) -> bool:
        """Tell whether its thread has ended."""
        return not self._threads[name, incarnation].thread.is_alive()

    def component(self, name: str) -> Any:
        """Return the live run's component."""
        return self.runtimes[name, self.incarnations[name]].component

    def close(self) -> None:
        """End everything."""
        for runtime in self.runtimes.values():
            runtime.post(runtime.handover.end)
        for thread in self._threads.values():
            thread.join()
        self.client.close()
        self._buses.close()
        for thread in self._threads.values():
            if thread.failure and thread not in self._cut_off:
                raise thread.failure


class Processes(Site):
    """Each run is a process."""

    def __init__(self) -> None:
        self._endpoint = free_endpoint()
        self._nursery = Nursery(parts.__name__)
        self._router = open_bus(Endpoints((self._endpoint,), (), router=True))
        self._sessions: list[Bus] = []
        self.pids: dict[Run, int] = {}
        super().__init__()

    def session(self) -> Bus:
        """Open a session."""
        bus = open_bus(Endpoints(connect=(self._endpoint,)))
        self._sessions.append(bus)
        return bus

    def launch(self, cls: type[Component], assignment: Assignment) -> None:
        """Fork it."""
        plain = codec.to_plain(assignment) | {"connect_endpoints": [self._endpoint]}
        self.pids[assignment.name, assignment.incarnation] = self._nursery.start(codec.from_plain(plain, Assignment))

    def kill(self, name: str, incarnation: int) -> None:
        """Kill it, and wait until it is gone."""
        with contextlib.suppress(ProcessLookupError):
            kill(self.pids[name, incarnation])
        wait_until(lambda: self.gone(name, incarnation), f"{name} {incarnation} is gone")

    def hang(self, name: str, incarnation: int) -> None:
        """Have it stand still, as it is."""
        stop(self.pids[name, incarnation])

    def renamed(self, name: str, incarnation: int, anew: int) -> None:
        """Know a run by another incarnation too."""
        self.pids[name, anew] = self.pids[name, incarnation]

    def gone(self, name: str, incarnation: int) -> bool:
        """Tell whether its process has ended."""
        try:
            send(self.pids[name, incarnation], 0)
        except ProcessLookupError:
            return True
        return False

    def close(self) -> None:
        """End everything."""
        self._nursery.close()
        self.client.close()
        for session in self._sessions:
            session.close()
        self._router.close()
