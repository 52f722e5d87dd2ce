"""A metacontroller's cycle over few and many designs, against a raw round trip; checking few and many realizations.

The cycle is to analyse and to plan for five objectives. A component that half of the designs need has failed, another
has recovered, and one objective is measured to break its requirement. Times of ours are those of the processor: what
else the machine does meets a long computation more often than a short round trip.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from benchmarks.harness import Effort, Result, compared, in_turns
from benchmarks.sides.links import Site
from benchmarks.sides.raw import ASKED, READY, VOLLEY, VOLLEY_TIMEOUT, echo, pinger
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Grounding, Model, Objective, Requirement
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation
from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import knowledge_of
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_text

SKILLS = 5
FEW, MANY = 15, 1500
LIMITS = {FEW: 6.0, MANY: 60.0}
"""Raw round trips of 64 B that a cycle may take, by the number of designs."""
MANY_LIMIT = 100.0
"""Cycles over few designs that one over many may take."""
CYCLES = {FEW: 100, MANY: 10}
SIZE, VOLLEYS = 64, 400
CHECKED_FEW, CHECKED_MANY = 5, 200
CHECKED_LIMIT = 60.0
CHECKS = 3

QUALITIES = """\
Quality safety { better: higher, range: 0..1, weight: 0.2 }
Quality performance { better: higher, range: 0..1, weight: 1 }
Quality energy { better: lower, range: 0..1, weight: 0.2 }
"""
PARTS = "Component laser observable active", "Component camera observable active"
REALIZATION = """\
Realization {name} {{
  Component motor {{ Configuration active.M{number} {{ speed: {number} }} }}, {part}
  Quality [safety: {safety}, performance: {performance}, energy: {energy}];
  context: Default
}};
"""


def skills_of(realizations: int, skills: int = SKILLS) -> str:
    """Return the text of skills with so many realizations in all; their estimates differ."""
    parts = [QUALITIES]
    for skill in range(skills):
        own = (
            REALIZATION.format(
                name=f"way_{number}",
                number=number,
                part=PARTS[number % len(PARTS)],
                safety=number * 7 % 100 / 100,
                performance=number * 13 % 100 / 100,
                energy=number * 29 % 100 / 100,
            )
            for number in range(skill, realizations, skills)
        )
        parts.append(f"Skill skill_{skill} {{ quality attributes [safety, performance, energy]\n{''.join(own)}}}\n")
    return "".join(parts)


def reasoning(effort: Effort) -> list[Result]:
    """Measure a cycle over few and over many designs."""
    cycles = {number: cycle(number) for number in LIMITS}
    results = []
    with Site() as site:
        site.spawn(echo, site.link)
        site.spawn(pinger, site.link)
        site.wait_for_token(f"{READY}/echo")
        site.wait_for_token(f"{READY}/pinger")
        count = effort.count(VOLLEYS)
        _volley(site, max(1, count // 5))
        for number, limit in LIMITS.items():
            repeated = effort.count(CYCLES[number])
            sides = in_turns(effort.rounds, _timed(cycles[number], repeated), lambda: _volley(site, count))
            against, note = "raw zenoh callback echo, 64 B", f"processor time; {effort.rounds} rounds of {repeated}"
            name = f"a cycle over {number} designs"
            results.append(compared(name, sides, "ms", against, limit, scale=1e3, note=note))
    few, many = (_timed(cycles[number], effort.count(CYCLES[number])) for number in (FEW, MANY))
    name, against = f"a cycle over {MANY} designs", f"one over {FEW}"
    sides = in_turns(effort.rounds, many, few)
    return [*results, compared(name, sides, "ms", against, MANY_LIMIT, scale=1e3, note="processor time")]


def checking(effort: Effort) -> list[Result]:
    """Measure how long a file with many realizations is checked."""
    few, many = (skills_of(number, 1) for number in (CHECKED_FEW, CHECKED_MANY))
    repeated = effort.count(CHECKS)
    checked_text(few)  # the grammar is compiled once
    sides = in_turns(
        effort.rounds, _timed(lambda: checked_text(many), repeated), _timed(lambda: checked_text(few), 5 * repeated)
    )
    name, against = f"checking {CHECKED_MANY} realizations", f"checking {CHECKED_FEW}"
    return [
        compared(
            name,
            sides,
            "ms",
            against,
            CHECKED_LIMIT,
            scale=1e3,
            note=f"processor time; {effort.rounds} rounds of {repeated}",
        )
    ]


def cycle(designs: int) -> Callable[[], object]:
    """Return what analyses and plans in a situation with so many designs."""
    analyser = Analyser(knowledge_of(checked_text(skills_of(designs)).skills))
    model = analyser.model
    situation = situation_of(model, analyser)

    def run() -> object:
        return plan(model, situation, analyser.analyse(situation), Resting(), 0.0)

    return run


def situation_of(model: Model, analyser: Analyser) -> Situation:
    """Return a situation in which every objective is grounded, and some are in error."""
    safety, energy = model.find("quality", "safety"), model.find("quality", "energy")
    bounds = (Requirement(safety, 0.2), Requirement(energy, 0.9))
    objectives = tuple(
        Objective(f"objective_{number}", function, bounds, priority=number)
        for number, function in enumerate(model.functions)
    )
    begin = Situation(objectives)
    planned = plan(model, begin, analyser.analyse(begin), Resting(), 0.0)
    groundings = tuple(
        Grounding(f"{each.objective}/grounding", each.objective, each.design)
        for each in planned.decisions
        if each.design is not None
    )
    laser, camera = model.find("component", "laser"), model.find("component", "camera")
    components = {laser: ComponentStatus.FAILED, camera: ComponentStatus.RECOVERED}
    return Situation(objectives, groundings, components, {groundings[0].name: {safety: 0.1, energy: 0.5}})


def _timed(run: Callable[[], object], count: int) -> Callable[[], list[float]]:
    def samples() -> list[float]:
        found = []
        for _ in range(count):
            begun = time.process_time()
            run()
            found.append(time.process_time() - begun)
        return found

    return samples


def _volley(site: Site, count: int) -> list[float]:
    for answer in site.bus.query(VOLLEY, ASKED.pack(count, SIZE), VOLLEY_TIMEOUT):
        return [float(number) for number in memoryview(answer.payload).cast("d")]
    raise TimeoutError("the raw side has not answered")
