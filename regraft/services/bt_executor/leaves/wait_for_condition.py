"""The leaf that waits until a script is true."""

from __future__ import annotations

from behavior_tree import RUNNING, SUCCESS, Input, Node, StatefulAction, Status
from behavior_tree.script import Script, compile_script
from behavior_tree.script.operators import truth
from regraft.services.bt_executor.leaves.asking_leaf import require_ports


class WaitForCondition(StatefulAction):
    """Runs until a script is true, such as ``battery_charge > 0.9``; it is asked at each tick."""

    code = Input(str, description="the script")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Compile a script that is given as a literal; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "code")
        if self.has_literal("code"):
            self._compiled()

    def on_start(self) -> Status:
        """Look whether it is true already."""
        self._script = self._compiled()
        return self.on_running()

    def on_running(self) -> Status:
        """Look whether it is true."""
        return SUCCESS if truth(self._script()) else RUNNING

    def _compiled(self) -> Script:
        return compile_script(self.code, self.blackboard, self.runtime.enums, extensions=self.runtime.extensions)
