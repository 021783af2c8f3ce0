"""What a type checker cannot find in users' Python: values, callbacks, and uses of the API."""

from __future__ import annotations

from collections.abc import Iterator

from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checks.behaviors import behavior_problems
from composer.python_code.checks.messages import message_problems
from composer.python_code.checks.methods import (
    unawaited_values,
    unused_values,
)
from composer.python_code.checks.node_classes import node_class_problems
from composer.python_code.checks.scopes import Code
from composer.python_code.lookup import BehaviorSource
from composer.python_code.problems import Problem

__all__ = ["code_problems"]


def code_problems(node: Node, source: BehaviorSource, interfaces: Interfaces) -> Iterator[Problem]:
    """Yield the problems of a behavior or of an rclpy class, in the project's files."""
    code = Code(node, source, interfaces)
    for scope in code.scopes:
        yield from message_problems(scope)
        yield from unused_values(scope)
        yield from unawaited_values(scope)
    if node.behavior is not None:
        yield from behavior_problems(code)
    else:
        yield from node_class_problems(code)
