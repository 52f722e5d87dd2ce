"""Compiles scripts to closures over a blackboard, so that running one costs a few calls and no tree walk."""

from collections.abc import Callable, Mapping
from functools import singledispatchmethod
from typing import Any, Final

from ..data.blackboard import Blackboard
from ..errors import ScriptError
from ..status import STATUS_NAMES
from .assignment import assign, assign_combined, entry_for
from .operators import BINARY, FUNCTIONS, UNARY, chosen, relation, truth
from .parser import parse
from .syntax import Assignment, Binary, Call, Comparison, Conditional, Expression, Literal, Name, Unary

_STATUSES: Final = {name: float(number) for number, name in enumerate(STATUS_NAMES)}

Script = Callable[[], Any]
"""A compiled script: runs on the board that it was compiled for and returns its last statement's value."""


def compile_script(text: str, board: Blackboard, enums: Mapping[str, int], *, extensions: bool = False) -> Script:
    """Compile a script for one board.

    Args:
        text: Statements separated by semicolons.
        board: The blackboard of the names in it.
        enums: Names of whole numbers; they go before the board's.
        extensions: Whether ``abs``, ``min`` and ``max`` can be called, and statuses have names. A name that means
            something else too keeps that meaning. Also whether ``+5``, text in double quotes and names with letters
            beyond ASCII are read. BehaviorTree.CPP has none of these.

    Raises:
        ScriptError: The script is not well-formed.
    """
    compiler = _Compiler(board, enums, _STATUSES if extensions else {})
    try:
        statements = tuple(compiler.closure(statement) for statement in parse(text, extensions=extensions))
    except RecursionError:
        raise ScriptError(f"the script is nested too deeply: '{text[:40]}…'") from None
    if len(statements) == 1:
        return statements[0]

    def run() -> Any:
        value = None
        for statement in statements:
            value = statement()
        return value

    return run


def compile_condition(
    text: str, board: Blackboard, enums: Mapping[str, int], *, extensions: bool = False
) -> Callable[[], bool]:
    """Compile a script whose value is asked for as true or false; see `compile_script`."""
    script = compile_script(text, board, enums, extensions=extensions)

    def holds() -> bool:
        value = script()
        # Comparisons give reals, and nearly all conditions are comparisons.
        return value != 0.0 if type(value) is float and value >= 0.0 else truth(value)

    return holds


class _Compiler:
    def __init__(self, board: Blackboard, enums: Mapping[str, int], statuses: Mapping[str, float]) -> None:
        self._board = board
        self._enums = enums
        self._statuses = statuses

    @singledispatchmethod
    def closure(self, expression: Expression) -> Script:
        raise TypeError(f"not an expression: {expression!r}")

    @closure.register
    def _(self, literal: Literal) -> Script:
        value = literal.value
        return lambda: value

    @closure.register
    def _(self, name: Name) -> Script:
        key, find = name.name, self._board.find
        if key in self._enums:
            number = float(self._enums[key])
            return lambda: number

        status = self._statuses.get(key)

        def read() -> Any:
            entry = find(key)
            if entry is None:
                if status is not None:
                    return status
                raise ScriptError(f"there is no enumerated name and no blackboard entry '{key}'")
            return entry.value

        return read

    @closure.register
    def _(self, unary: Unary) -> Script:
        operand, function = self.closure(unary.operand), UNARY[unary.operator]
        return lambda: function(operand())

    @closure.register
    def _(self, binary: Binary) -> Script:
        left, right = self.closure(binary.left), self.closure(binary.right)
        function = BINARY[binary.operator]
        return lambda: function(left(), right())

    @closure.register
    def _(self, comparison: Comparison) -> Script:
        first, *others = (self.closure(operand) for operand in comparison.operands)
        relations = [relation(symbol, self._enums) for symbol in comparison.operators]
        if len(relations) == 1:
            holds, second = relations[0], others[0]
            return lambda: 1.0 if holds(first(), second()) else 0.0
        links = tuple(zip(relations, others, strict=True))

        def chain() -> float:
            left = first()
            for holds, operand in links:
                right = operand()
                if not holds(left, right):
                    return 0.0
                left = right
            return 1.0

        return chain

    @closure.register
    def _(self, conditional: Conditional) -> Script:
        condition = self.closure(conditional.condition)
        then, otherwise = self.closure(conditional.then), self.closure(conditional.otherwise)
        return lambda: then() if chosen(condition()) else otherwise()

    @closure.register
    def _(self, call: Call) -> Script:
        function, name = FUNCTIONS[call.function], call.function
        arguments = tuple([self.closure(argument) for argument in call.arguments])
        return lambda: function(name, [argument() for argument in arguments])

    @closure.register
    def _(self, assignment: Assignment) -> Script:
        board, name, value = self._board, assignment.name, self.closure(assignment.value)
        operator, enums = assignment.operator, self._enums
        if operator in (":=", "="):
            # The entry exists before the right side is evaluated: `x := x` finds an empty entry.
            return lambda: assign(board, name, entry_for(board, name, operator == ":="), value(), enums)
        return lambda: assign_combined(board, name, entry_for(board, name, False), operator[0], value(), enums)
