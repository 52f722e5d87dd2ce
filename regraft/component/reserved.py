"""The names that a component class may only use as its base does, and where it uses one otherwise.

An attribute called ``kit`` takes the kit's place, and a parameter called ``snapshot`` that of the hook: much later
something fails elsewhere. So a class is refused where it is defined.
"""

from __future__ import annotations

import ast
import dis
import inspect
import textwrap
from collections.abc import Iterator
from types import CodeType, FunctionType
from typing import Any

from regraft.bus_schema.errors import BadType
from regraft.component.handlers import is_offered_or_timed
from regraft.component.parameters import Parameter
from regraft.component.ports import Input, Output
from regraft.component.quality import Quality

STORE, LONG_ARGUMENT = dis.opmap["STORE_ATTR"], dis.opmap["EXTENDED_ARG"]
LOADS = ("LOAD_FAST", "LOAD_DEREF")
"""How a method has its own first argument; the second, where a function within it uses that, too."""


def check_attributes(cls: type, base: type) -> None:
    """Check what a subclass of ``base`` and the mixins among its bases define and assign; raises BadType."""
    reserved = {name for name in (*vars(base), *base.__annotations__) if not name.startswith("_")}
    mixins = (other for other in cls.__mro__[1:] if other is not object and not issubclass(other, base))
    for owner in (cls, *mixins):
        for name, value in vars(owner).items():
            if name in reserved:
                _check_definition(owner, base, name, value)
            if isinstance(value, FunctionType):
                _check_assignments(owner, base, reserved, value.__code__)


def _check_definition(owner: type, base: type, name: str, value: Any) -> None:
    usual = inspect.getattr_static(base, name, None)
    if isinstance(value, Parameter):
        used = "a parameter"
    elif isinstance(value, Input | Output):
        used = "a port"
    elif isinstance(value, Quality):
        used = "a quality"
    elif isinstance(value, FunctionType) and is_offered_or_timed(value):
        used = "a service, action or timer"
    elif name not in vars(base):
        used = "an attribute"
    elif callable(value) != callable(usual) or isinstance(value, property):
        used = "a method" if callable(value) or isinstance(value, property) else "a value"
    elif _is_async(value) and not _is_async(usual):
        why = "it is called and never awaited; have self.kit.spawn() carry out what waits"
        raise BadType(f"{_place(owner, name)}: {name!r} cannot be async: {why}")
    else:
        return
    _refuse(_place(owner, name), base, name, used)


def _is_async(value: Any) -> bool:
    function = getattr(value, "__func__", value)
    return inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function)


def _check_assignments(owner: type, base: type, reserved: set[str], code: CodeType) -> None:
    if not _may_assign(code, reserved):
        return
    for line, name in _assigned(code):
        if name in reserved:
            _refuse(f"{code.co_filename}:{line}", base, name, f"an attribute in {owner.__qualname__}.{code.co_name}")


def _may_assign(code: CodeType, reserved: set[str]) -> bool:
    """Check at little cost whether code may assign one of the names: most of a class does not."""
    if reserved.isdisjoint(code.co_names):
        return False
    operations, arguments = code.co_code[::2], code.co_code[1::2]
    if LONG_ARGUMENT in operations:
        return True
    stored = (arguments[index] for index, operation in enumerate(operations) if operation == STORE)
    return any(code.co_names[index] in reserved for index in stored)


def _assigned(code: CodeType) -> Iterator[tuple[int, str]]:
    """Yield line and name of what a method assigns to its first argument."""
    own = code.co_varnames[0] if code.co_argcount else ""
    before: Any = None
    for step in dis.get_instructions(code):
        if step.opname == "STORE_ATTR":
            loaded = before.argval if before is not None and before.opname.startswith(LOADS) else None
            if own and own in (loaded, loaded[-1] if isinstance(loaded, tuple) else None):
                line = step.positions.lineno if step.positions else None
                yield line or code.co_firstlineno, str(step.argval)
        before = step


def _refuse(place: str, base: type, name: str, used: str) -> None:
    right = "the kit is found under it" if name == "kit" else f"regraft.{base.__name__} has it for something else"
    raise BadType(f"{place}: {name!r} cannot name {used}: {right}; choose another name")


def _place(owner: type, name: str) -> str:
    """Return file and line of a class body's definition, or the class's own place where its source is missing."""
    try:
        lines, first = inspect.getsourcelines(owner)
        (found,) = ast.parse(textwrap.dedent("".join(lines))).body
    except (OSError, TypeError, SyntaxError, ValueError):
        return f"{owner.__module__}.{owner.__qualname__}"
    defined = (node.lineno for node in getattr(found, "body", ()) if name in _names(node))
    return f"{inspect.getsourcefile(owner)}:{first + next(defined, 1) - 1}"


def _names(node: ast.stmt) -> set[str]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {node.name}
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return {part.id for target in targets if target for part in ast.walk(target) if isinstance(part, ast.Name)}
