"""Leaves that run a script."""

from typing import Any

from ..nodes.leaf import Condition, SyncAction
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..script import compile_script
from ..script.operators import truth
from ..status import SUCCESS, Status


class _CompiledCode(Node):
    """Compiles the port ``code``: a literal at load, a blackboard entry whenever it changes."""

    code = Input(str, description="the script")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._text: str | None = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Compile a script that is given as a literal."""
        super().adopt(children)
        if "code" not in self.setup.attributes or self.has_literal("code"):
            self._compile(self.code)

    def run(self) -> Any:
        """Run the script and return its value."""
        self._compile(self.code)
        return self._script()

    def _compile(self, text: str) -> None:
        if text != self._text:
            self._script = compile_script(text, self.blackboard, self.runtime.enums, extensions=self.runtime.extensions)
            self._text = text


class Script(_CompiledCode, SyncAction):
    """Runs a script and succeeds."""

    def tick(self) -> Status:
        """Run the script."""
        self.run()
        return SUCCESS


class ScriptCondition(_CompiledCode, Condition):
    """Succeeds if a script is true, else fails."""

    def holds(self) -> bool:
        """Run the script."""
        return truth(self.run())
