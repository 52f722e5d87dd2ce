"""The list of built-in node types: a further one is a class and a line here."""

from typing import Final

from .controls.branches import IfThenElse, WhileDoElse
from .controls.parallels import Parallel, ParallelAll
from .controls.reactive import ReactiveFallback, ReactiveSequence
from .controls.sequences import AsyncFallback, AsyncSequence, Fallback, Sequence, SequenceWithMemory
from .controls.switches import Switch2, Switch3, Switch4, Switch5, Switch6
from .controls.try_catch import TryCatch
from .decorators.loops import Repeat, RetryUntilSuccessful
from .decorators.precondition import Precondition
from .decorators.queues import LoopBool, LoopDouble, LoopInt, LoopString
from .decorators.results import ForceFailure, ForceSuccess, Inverter, KeepRunningUntilFailure, RunOnce
from .decorators.subtree import SubTree
from .decorators.timing import Delay, Timeout
from .decorators.updates import SkipUnlessUpdated, WaitValueUpdate
from .leaves.basic import AlwaysFailure, AlwaysSuccess, Sleep
from .leaves.board import SetBlackboard, UnsetBlackboard
from .leaves.scripts import Script, ScriptCondition
from .leaves.updates import WasEntryUpdated
from .nodes.node import Node

BUILTIN_NODES: Final[tuple[type[Node], ...]] = (
    AlwaysFailure,
    AlwaysSuccess,
    AsyncFallback,
    AsyncSequence,
    Delay,
    Fallback,
    ForceFailure,
    ForceSuccess,
    IfThenElse,
    Inverter,
    KeepRunningUntilFailure,
    LoopBool,
    LoopDouble,
    LoopInt,
    LoopString,
    Parallel,
    ParallelAll,
    Precondition,
    ReactiveFallback,
    ReactiveSequence,
    Repeat,
    RetryUntilSuccessful,
    RunOnce,
    Script,
    ScriptCondition,
    Sequence,
    SequenceWithMemory,
    SetBlackboard,
    SkipUnlessUpdated,
    Sleep,
    SubTree,
    Switch2,
    Switch3,
    Switch4,
    Switch5,
    Switch6,
    Timeout,
    TryCatch,
    UnsetBlackboard,
    WaitValueUpdate,
    WasEntryUpdated,
    WhileDoElse,
)
