"""Parses scripts by recursive descent and, for binary operators, precedence climbing."""

from typing import Final

from ..errors import ScriptError
from .lexer import Token, place, tokenize
from .operators import FUNCTIONS, TRUTH
from .syntax import Assignment, Binary, Call, Comparison, Conditional, Expression, Literal, Name, Unary

ASSIGNMENTS: Final = (":=", "=", "+=", "-=", "*=", "/=")
COMPARISONS: Final = ("==", "!=", "<", ">", "<=", ">=")
BINARY_LEVELS: Final = (("||",), ("&&",), COMPARISONS, ("|", "^"), ("&",), ("+", "-", ".."), ("*", "/"))
"""The binary operators, the loosest first; all associate to the left, but comparisons form chains."""
LEVELS: Final = {operator: level for level, operators in enumerate(BINARY_LEVELS) for operator in operators}


def parse(script: str, *, extensions: bool = False) -> list[Expression]:
    """Return the statements of a script; with our extensions, ``abs(``, ``min(`` and ``max(`` begin calls.

    Raises:
        ScriptError: The script is empty, not well-formed, or nested too deeply.
    """
    try:
        return _Parser(script, extensions).statements()
    except RecursionError:
        raise ScriptError(f"the script is nested too deeply: '{script[:40]}…'") from None


class _Parser:
    def __init__(self, script: str, extensions: bool) -> None:
        self._script = script
        self._extensions = extensions
        self._tokens = tokenize(script, extensions=extensions)
        self._position = 0

    def statements(self) -> list[Expression]:
        """Parse all statements; as in BehaviorTree.CPP, semicolons between them may be missing or repeated."""
        statements = [self._expression()]
        while True:
            while self._accept(";"):
                pass
            if self._token.kind == "end":
                return statements
            statements.append(self._expression())

    def _expression(self) -> Expression:
        left = self._conditional()
        operator = self._accept(*ASSIGNMENTS)
        if operator:
            if not isinstance(left, Name):
                raise self._error(f"the left side of '{operator}' must be a name")
            left = Assignment(operator, left.name, self._expression())
        return left

    def _conditional(self) -> Expression:
        condition = self._binary(0)
        if not self._accept("?"):
            return condition
        then = self._expression()
        self._expect(":")
        return Conditional(condition, then, self._conditional())

    def _binary(self, loosest: int) -> Expression:
        """Parse operands joined by operators of a level and of all tighter ones."""
        left = self._unary()
        while self._token.kind == "operator" and LEVELS.get(self._token.text, -1) >= loosest:
            operator = self._token.text
            level = LEVELS[operator]
            if operator in COMPARISONS:
                left = self._chain(left, level + 1)
            else:
                self._position += 1
                left = Binary(operator, left, self._binary(level + 1))
        return left

    def _chain(self, first: Expression, level: int) -> Expression:
        operators: list[str] = []
        operands = [first]
        while operator := self._accept(*COMPARISONS):
            operators.append(operator)
            operands.append(self._binary(level))
        return Comparison(tuple(operators), tuple(operands))

    def _unary(self) -> Expression:
        operators = []
        while operator := self._accept("-", "~", "!"):
            operators.append(operator)
        operand = self._atom()
        for operator in reversed(operators):
            operand = Unary(operator, operand)
        return operand

    def _atom(self) -> Expression:
        if self._extensions and self._is_sign():
            self._position += 1
        token = self._token
        if self._accept("("):
            inner = self._expression()
            self._expect(")")
            return inner
        if token.kind not in ("int", "hex", "real", "text", "name"):
            raise self._error("expected a value, a name or '('")
        self._position += 1
        if token.kind == "name" and self._is_call(token):
            return self._call(token)
        if token.kind == "int":
            return Literal(int(token.text))
        if token.kind == "hex":
            return Literal(int(token.text, 16))
        if token.kind == "real":
            return Literal(float(token.text))
        if token.kind == "text":
            return Literal(token.text)
        return Literal(TRUTH[token.text]) if token.text in TRUTH else Name(token.text)

    def _is_call(self, name: Token) -> bool:
        """Return whether a function's name has its parenthesis right behind it: with a blank it is a name as before."""
        behind = self._token
        is_open = behind.kind == "operator" and behind.text == "("
        return self._extensions and name.text in FUNCTIONS and is_open and behind.column == name.column + len(name.text)

    def _call(self, name: Token) -> Expression:
        self._expect("(")
        arguments = [self._expression()]
        while self._accept(","):
            arguments.append(self._expression())
        self._expect(")")
        least, most = FUNCTIONS[name.text].arguments
        if not least <= len(arguments) <= most:
            wanted = f"exactly {least}" if least == most else f"at least {least}"
            where = place(self._script, name.column - 1)
            raise ScriptError(f"{where}: {name.text} takes {wanted} values, it has {len(arguments)}")
        return Call(name.text, tuple(arguments))

    def _is_sign(self) -> bool:
        """Return whether a plus sign that belongs to a number comes next."""
        token = self._token
        if token.kind != "operator" or token.text != "+":
            return False
        return self._tokens[self._position + 1].kind in ("int", "real")

    @property
    def _token(self) -> Token:
        return self._tokens[self._position]

    def _accept(self, *operators: str) -> str:
        token = self._token
        if token.kind == "operator" and token.text in operators:
            self._position += 1
            return token.text
        return ""

    def _expect(self, operator: str) -> None:
        if not self._accept(operator):
            raise self._error(f"expected '{operator}'")

    def _error(self, message: str) -> ScriptError:
        found = f"found '{self._token.text}'" if self._token.kind != "end" else "found the end"
        return ScriptError(f"{place(self._script, self._token.column - 1)}: {message}, {found}")
