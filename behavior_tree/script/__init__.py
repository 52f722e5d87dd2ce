"""The script language of BehaviorTree.CPP: parsed at load, compiled to closures over a blackboard."""

from .compile import Script, compile_condition, compile_script

__all__ = ["Script", "compile_condition", "compile_script"]
