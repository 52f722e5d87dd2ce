"""The leaf that waits until a script is true."""

from __future__ import annotations

from behavior_tree import RUNNING, SUCCESS, Input, Node, ScriptError, StatefulAction, Status
from behavior_tree.script import compile_script, entries_read
from behavior_tree.script.operators import truth
from regraft.services.bt_executor.leaves.asking_leaf import require_ports


class WaitForCondition(StatefulAction):
    """Runs until a script is true, such as ``battery_charge > 0.9``; it is asked at each tick.

    It also runs while the script cannot be evaluated because an entry that it reads is missing or holds nothing.
    """

    code = Input(str, description="the script")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Compile a script that is given as a literal; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "code")
        if self.has_literal("code"):
            self._compile()

    def on_start(self) -> Status:
        """Look whether it is true already."""
        self._compile()
        return self.on_running()

    def on_running(self) -> Status:
        """Look whether it is true."""
        try:
            return SUCCESS if truth(self._script()) else RUNNING
        except ScriptError:
            entries = map(self.blackboard.find, self._names)
            if any(entry is None or entry.value is None for entry in entries):
                return RUNNING
            raise

    def _compile(self) -> None:
        enums, extensions = self.runtime.enums, self.runtime.extensions
        self._names = entries_read(self.code, enums, extensions=extensions)
        self._script = compile_script(self.code, self.blackboard, enums, extensions=extensions)
