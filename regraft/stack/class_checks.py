"""Has the classes of components check their parameters, and the stack around them, before anything starts."""

from __future__ import annotations

from regraft.bus_schema.texts import text_of, told
from regraft.component.component import parameter_set
from regraft.component.parameters import ParameterError
from regraft.process.main import load_class
from regraft.stack.sections.hosts import FIRST
from regraft.stack.stack import Stack
from regraft.stack.yaml.problems import Problem, StackError


def check_with_classes(stack: Stack) -> None:
    """Have each class check its components of this machine; raises StackError with everything that is wrong."""
    problems: list[Problem] = []
    for name, spec in stack.architecture.components.items():
        if spec.cls and spec.host == FIRST:
            cls = load_class(spec.cls)
            at = f"components.{name}.parameters"
            try:
                values = parameter_set(cls, spec.parameters).values
                cls.check_parameters(values, stack.seed)
                cls.check_architecture(name, values, stack.architecture)
            except ParameterError as error:
                problems += [stack.problem(f"{at}.{place}", why) for place, why in error.parts]
            except KeyboardInterrupt:
                raise
            # An author's class may raise anything, leaving included.
            except BaseException as error:
                why = text_of(error) if isinstance(error, ValueError) else told(error)
                problems.append(stack.problem(f"components.{name}", why))
    if problems:
        raise StackError(problems)
