"""Random trees of all node types, sensible or odd, for replaying and for torturing the engine.

The randomness comes from a `random.Random`: one with a seed, or hypothesis's, which then shrinks what it finds.
"""

from random import Random
from typing import TypeVar
from xml.sax.saxutils import quoteattr

T = TypeVar("T")

START = "a := 0; b := 0; c := 0; l := ''; r := 0.5"
SCRIPTS = (
    "a += 1", "b := b + 1", "c := a * 2 - b", "l := l .. 'x'", "a := 0", "r += 0.25", "r := r / 3", "r := a",
    "l := r .. 'm'", "b := (a > 2) ? 1 : b", "@a := 1", "d := 2.5", "e := 'text'", "1",
)  # fmt: skip
QUESTIONS = ("a < 3", "0 <= a <= 3", "!(b == 1) && c < 5", "true", "false", "1", "0", "r >= 0.75", "l == 'x'", "a & 1")
ODD_SCRIPTS = (
    "",
    "1 +",
    "missing",
    "x := y := 1",
    "'open",
    "a := 'word'",
    "r := 1e999",
    "-1",
    "a := 0.5",
    "~r",
    "l - 1",
)
ASKING = ("_failureIf", "_successIf", "_skipIf", "_while")
RUNNING = ("_onHalted", "_onFailure", "_onSuccess", "_post")
KEYS = ("{a}", "{b}", "{c}", "{l}", "{r}", "{nothing}", "{@a}", "{=}", "{sub}")
ODD_VALUES = (
    "",
    "x",
    "{}",
    "-7",
    "2.5",
    "{ a }",
    "{=}",
    "json:[",
    "99999999999999999999",
    "RUNNING",
    "IDLE",
    "\u00e9\ud7ff",
)

CONTROLS: dict[str, tuple[int, int]] = {
    "Sequence": (1, 4), "Fallback": (1, 4), "AsyncSequence": (1, 4), "AsyncFallback": (1, 4),
    "SequenceWithMemory": (1, 4), "ReactiveSequence": (1, 4), "ReactiveFallback": (1, 4), "Parallel": (1, 4),
    "ParallelAll": (1, 4), "IfThenElse": (2, 3), "WhileDoElse": (2, 3), "TryCatch": (2, 4), "Switch2": (3, 3),
    "Switch3": (4, 4), "Switch4": (5, 5), "Switch5": (6, 6), "Switch6": (7, 7),
}  # fmt: skip
NAV2_CONTROLS: dict[str, tuple[int, int]] = {
    "PipelineSequence": (1, 4), "RecoveryNode": (2, 2), "RoundRobin": (1, 4), "NonblockingSequence": (1, 3),
    "PersistentSequence": (1, 4), "PauseResumeController": (1, 4),
}  # fmt: skip
DECORATORS = (
    "Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure", "Repeat", "RetryUntilSuccessful", "RunOnce",
    "Precondition",
)  # fmt: skip
OTHER_DECORATORS = (
    "Delay", "Timeout", "LoopInt", "LoopBool", "LoopDouble", "LoopString", "SkipUnlessUpdated", "WaitValueUpdate",
    "RateController", "DistanceController", "SpeedController", "GoalUpdatedController", "GoalUpdater",
    "PathLongerOnApproach", "SingleTrigger",
)  # fmt: skip
LEAVES = ("Scripted", "ScriptedCond", "ScriptedSync", "Script", "ScriptCondition", "AlwaysSuccess", "AlwaysFailure")
OTHER_LEAVES = ("SetBlackboard", "UnsetBlackboard", "Sleep", "WasEntryUpdated")


class TreeMaker:
    """Makes documents; with ``everything`` of all types and with odd ports, else as the golden traces have them."""

    def __init__(self, random: Random, *, everything: bool = False) -> None:
        self._random = random
        self._everything = everything
        self._leaves = 0

    def document(self, depth: int = 3) -> str:
        """Return a document with a tree M, whose sub-tree T may be used anywhere in it."""
        start = f"<RunOnce><Script code={quoteattr(START)}/></RunOnce>"
        body = f"<Sequence>{start}{self.node(depth, may_use_subtree=True)}</Sequence>"
        sub = self.node(min(depth, 2), may_use_subtree=False)
        return (
            f'<root BTCPP_format="4" main_tree_to_execute="M"><BehaviorTree ID="M">{body}</BehaviorTree>'
            f'<BehaviorTree ID="T">{sub}</BehaviorTree></root>'
        )

    def node(self, depth: int, may_use_subtree: bool) -> str:
        """Return an element with everything below it."""
        choice = self._random.randrange(10)
        if depth <= 0 or choice < 2:
            return self._leaf()
        if choice == 2 and may_use_subtree:
            connected = self._some({"sub": self._one(KEYS), "l": self._one(("{l}", "3", "word"))}, 2)
            remap = self._one(({"_autoremap": "true"}, {"_autoremap": "false"}, {}))
            return self._element("SubTree", {"ID": "T", **connected, **remap}, "")
        if choice < 6:
            name = self._one((*DECORATORS, *(OTHER_DECORATORS if self._everything else ())))
            return self._element(name, self._decorator_ports(name), self.node(depth - 1, may_use_subtree))
        counts = {**CONTROLS, **(NAV2_CONTROLS if self._everything else {})}
        name = self._one(tuple(counts))
        number = self._random.randint(*counts[name])
        if name == "ReactiveSequence":
            children = "".join(self._no_async(depth, may_use_subtree) for _ in range(number))
        else:
            children = "".join(self.node(depth - 1, may_use_subtree) for _ in range(number))
        return self._element(name, self._control_ports(name, number), children)

    def _no_async(self, depth: int, may_use_subtree: bool) -> str:
        child = self.node(depth - 1, may_use_subtree)
        return f"<Inverter>{child}</Inverter>" if child.startswith("<AsyncSequence") else child

    def _leaf(self) -> str:
        name = self._one((*LEAVES[:3], *LEAVES, *(OTHER_LEAVES if self._everything else ())))
        if name.startswith("Scripted"):
            self._leaves += 1
            letters = "SFK" if name == "ScriptedSync" and not self._is_odd() else "RSFK"
            script = "".join(self._one(tuple(letters)) for _ in range(self._random.randint(1, 5)))
            ports = self._some({"in": self._one(KEYS), "out": self._one(KEYS)}, 4)
            return self._element(name, {"name": f"n{self._leaves}", "script": script, **ports}, "")
        ports = {
            "Script": {"code": self._one(SCRIPTS)},
            "ScriptCondition": {"code": self._one(QUESTIONS)},
            "SetBlackboard": {"value": self._one((*KEYS, "5", "word")), "output_key": self._one(("a", "new", "l"))},
            "UnsetBlackboard": {"key": self._one(("a", "new", "nothing"))},
            "Sleep": {"msec": self._one(("0", "100", "{a}"))},
            "WasEntryUpdated": {"entry": self._one(KEYS)},
        }.get(name, {})
        return self._element(name, ports, "")

    def _control_ports(self, name: str, children: int) -> dict[str, str]:
        counts = tuple(str(count) for count in range(-1, children + 1))
        if name.startswith("Switch"):
            cases = {f"case_{number}": self._one(("0", "1", "2", "x")) for number in range(1, children)}
            return {"variable": self._one(KEYS), **cases}
        ports = {
            "Parallel": {"success_count": self._one(counts), "failure_count": self._one(counts)},
            "ParallelAll": {"max_failures": self._one(counts)},
            "TryCatch": {"catch_on_halt": self._one(("true", "false"))},
            "RecoveryNode": {"number_of_retries": self._one(("0", "1", "3"))},
            "RoundRobin": {"wrap_around": self._one(("true", "false"))},
            "PersistentSequence": {"current_child_idx": self._one(("{place}", "{a}"))},
        }
        return self._some(ports.get(name, {}), 2) if name != "PersistentSequence" else ports[name]

    def _decorator_ports(self, name: str) -> dict[str, str]:
        number = self._one(("-1", "0", "1", "2", "3", "{a}"))
        queue = self._one(("1;0;1", "", "{l}", "{queue}"))
        ports = {
            "Repeat": {"num_cycles": number},
            "RetryUntilSuccessful": {"num_attempts": number},
            "RunOnce": {"then_skip": self._one(("true", "false"))},
            "Precondition": {
                "if": self._one(QUESTIONS),
                "else": self._one(("SUCCESS", "FAILURE", "RUNNING", "SKIPPED")),
            },
            "Delay": {"delay_msec": self._one(("0", "50"))},
            "Timeout": {"msec": self._one(("0", "50"))},
            "SkipUnlessUpdated": {"entry": self._one(KEYS)},
            "WaitValueUpdate": {"entry": self._one(KEYS)},
            "RateController": {"hz": self._one(("1", "10.0"))},
            "GoalUpdater": {"input_goal": "{goal}", "output_goal": "{new_goal}"},
            "PathLongerOnApproach": {"path": self._one(KEYS)},
            "SingleTrigger": {"is_global": self._one(("false", "false", "true"))},
        }
        if name.startswith("Loop"):
            return {"queue": queue, "value": self._one(("{item}", "{l}", "{a}"))}
        return ports.get(name, {})

    def _element(self, name: str, ports: dict[str, str], inner: str) -> str:
        attributes = {**ports, **self._some({key: self._one(QUESTIONS) for key in ASKING}, 12)}
        attributes |= self._some({key: self._one(SCRIPTS) for key in RUNNING}, 12)
        if self._is_odd() and attributes:
            key = self._one(tuple(attributes))
            attributes[key] = self._one((*ODD_SCRIPTS, *ODD_VALUES))
        text = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
        return f"<{name}{text}>{inner}</{name}>"

    def _some(self, attributes: dict[str, str], one_in: int) -> dict[str, str]:
        return {key: value for key, value in attributes.items() if self._random.randrange(one_in) == 0}

    def _one(self, choices: tuple[T, ...]) -> T:
        return choices[self._random.randrange(len(choices))]

    def _is_odd(self) -> bool:
        return self._everything and self._random.randrange(60) == 0
