"""The script language of BehaviorTree.CPP: parsed at load, compiled to closures over a blackboard."""

from .compile import Script, compile_condition, compile_script
from .names import entries_assigned, entries_read

__all__ = ["Script", "compile_condition", "compile_script", "entries_assigned", "entries_read"]
