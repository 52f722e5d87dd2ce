"""Stack files: what a robot system consists of, on one screen, checked before anything runs."""

from regraft.stack.assembly.assemble import plain_document
from regraft.stack.class_checks import check_with_classes
from regraft.stack.load import load
from regraft.stack.options.added_faults import with_faults
from regraft.stack.options.asked import load_as_asked
from regraft.stack.options.overrides import apply_overrides, with_seed, with_speed, with_system
from regraft.stack.options.parameter_files import apply_parameter_files
from regraft.stack.options.places import with_places
from regraft.stack.stack import Stack, time_source
from regraft.stack.yaml.problems import Problem, StackError

__all__ = [
    "Problem",
    "Stack",
    "StackError",
    "apply_overrides",
    "apply_parameter_files",
    "check_with_classes",
    "load",
    "load_as_asked",
    "plain_document",
    "time_source",
    "with_faults",
    "with_places",
    "with_seed",
    "with_speed",
    "with_system",
]
