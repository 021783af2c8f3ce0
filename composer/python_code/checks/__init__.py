"""What a type checker cannot find in users' Python: values, callbacks, and uses of the API."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checks.behaviors import behavior_problems
from composer.python_code.checks.messages import message_problems
from composer.python_code.checks.node_classes import node_class_problems
from composer.python_code.checks.scopes import Code, NodeScope
from composer.python_code.lookup import BehaviorSource
from composer.python_code.problems import Family, Problem
from composer.python_code.trees import argument

__all__ = ["code_problems"]

#: Texts that show that a file may run an event loop of asyncio, such as in a thread.
_RUNS_ASYNCIO = (
    "asyncio.run",  # and run_coroutine_threadsafe
    "run_until_complete",
    "run_forever",
    "asyncio.Runner",
    "event_loop",
)


def code_problems(node: Node, source: BehaviorSource, interfaces: Interfaces) -> Iterator[Problem]:
    """Yield the problems of a behavior or of an rclpy class, in the project's files."""
    code = Code(node, source, interfaces)
    for scope in code.scopes:
        yield from message_problems(scope)
        yield from _awaited(scope, is_behavior=node.behavior is not None)
    if node.behavior is not None:
        yield from behavior_problems(code)
    else:
        yield from node_class_problems(code)


def _awaited(scope: NodeScope, *, is_behavior: bool) -> Iterator[Problem]:
    """Yield the functions of asyncio that callbacks await."""
    if any(text in scope.source.text for text in _RUNS_ASYNCIO):
        return
    instead = "call self.get_clock().sleep_for, or await a Future that a timer completes"
    if is_behavior:
        instead = "use self.clock.sleep"
    for node in scope.nodes:
        if not (isinstance(node, ast.Await) and isinstance(node.value, ast.Call)):
            continue
        function = node.value.func
        full = scope.full_name(function)
        is_pause = scope.constant(argument(node.value, 0, "delay")) == 0  # needs no event loop
        if full.startswith("asyncio.") and not is_pause:
            message = f"'{full}' needs the event loop of asyncio, which does not run here"
            hint = instead if full == "asyncio.sleep" else None
            yield scope.problem(Family.ASYNCIO, message, function, hint)
