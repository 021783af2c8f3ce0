"""Handlers that block their executor: blocking calls and loops that never wait."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python_nodes import behaviors, distinct_behaviors
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Node
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import (
    GENERAL_HANDLERS,
    handlers,
    reached_methods,
)
from composer.python_code.scopes import Call
from composer.python_code.syntax import Method
from composer.python_code.trees import SCOPES, Function, called_name, is_empty, start_span, walk
from composer.rules.python.definitions import on_tick
from composer.source import Span

_COUNTING = ("self.count = 0", "while True:", "    self.count += 1")

BLOCKING_CALL = warning(
    code="RC436",
    name="blocking-call",
    summary="A handler makes a blocking call, which blocks its executor.",
    why=(
        "While a handler blocks, no other callback of its executor runs: timers fire late, "
        "messages queue up, and a call to a node on the same executor never returns. Use "
        "'await' in an async handler, or a timer."
    ),
    bad=on_tick("time.sleep(0.05)", head="import time"),
    good=on_tick("await self.clock.sleep(0.05)", is_async=True),
)
ENDLESS_LOOP = warning(
    code="RC450",
    name="endless-loop",
    summary="A loop in a behavior neither ends nor awaits anything.",
    why=(
        "While it runs, no other callback of its executor is called, so nothing can end it: "
        "neither a message nor a request to cancel. Await self.clock.sleep in the loop."
    ),
    bad=on_tick(*_COUNTING, is_async=True),
    good=on_tick(*_COUNTING, "    await self.clock.sleep(0.05)", is_async=True),
)

_BLOCKING = re.compile(
    r"time\.sleep|input|os\.system|os\.wait|os\.waitpid"
    r"|subprocess\.(run|call|check_call|check_output|getoutput|getstatusoutput)"
    r"|requests\.(get|post|put|patch|delete|head|options|request)"
    r"|urllib\.request\.(urlopen|urlretrieve)"
    r"|socket\.create_connection"
    r"|rclpy\.(spin|spin_once|spin_until_future_complete)"
    r"|(.+\.)?spin_until_future_complete"
    r"|(.+\.)?(sock|socket|connection|conn)\.(recv|recvfrom|recv_into|accept|connect)"
)
#: rclpy's synchronous call; calls through the composer's clients are awaited.
_SYNCHRONOUS_CALL = re.compile(r"(.+\.)?\w*(client|cli)\.call")
_LEAVES = (ast.Return, ast.Raise, ast.Break)
_WAITS = (ast.Await, ast.AsyncFor, ast.AsyncWith, ast.Yield, ast.YieldFrom)
#: Calls that end a loop, that wait, or that would wait if they were awaited.
_ENDS_OR_WAITS = frozenset(
    {"exit", "quit", "_exit", "abort"}
    | {"sleep", "call", "send_goal", "result", "wait", "get", "join"}
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check what the handlers of every behavior do, directly or through their own methods."""
    for node, source in behaviors(context):
        yield from _blocking_calls(node, source)
    for node, source in distinct_behaviors(context):
        names = (*GENERAL_HANDLERS, *(handler.name for handler in handlers(node)))
        methods = [method for name in names if (method := source.method(name)) is not None]
        for method in reached_methods(source, *methods):
            for loop in endless_loops(method.node) if method.node is not None else ():
                yield _endless(method, loop)


def _blocking_calls(node: Node, source: BehaviorSource) -> Iterator[Diagnostic]:
    """Report each call once, for the first handler that reaches it."""
    places = dict.fromkeys(GENERAL_HANDLERS, source.reference.text.span)
    places |= {handler.name: handler.of.span for handler in handlers(node)}
    seen: set[Span] = set()
    for name, place in places.items():
        method = source.method(name)
        reached = reached_methods(source, method) if method is not None else ()
        for call in (call for item in reached for call in item.calls):
            if _blocks(call) and call.span not in seen and _is_imported(source, call):
                seen.add(call.span)
                message = f"handler '{name}' of '{source.reference.class_name}' blocks in"
                label = Label(place, "called here")
                yield Diagnostic(
                    BLOCKING_CALL, f"{message} '{call.name}'", call.span, (label,), _hint(call)
                )


def _is_imported(source: BehaviorSource, call: Call) -> bool:
    """Return whether a name is imported; one that is not defined is reported by another rule."""
    head = call.name.partition(".")[0]
    if head not in sys.stdlib_module_names:
        return True
    imports = re.compile(rf"\b(import|from)\b.*\b{head}\b")
    return any(imports.search(module.source.text) for module in source.own_modules)


def _blocks(call: Call) -> bool:
    if call.awaited or call.deferred:
        return False
    return bool(_BLOCKING.fullmatch(call.name) or _SYNCHRONOUS_CALL.fullmatch(call.name))


def _hint(call: Call) -> str:
    if call.name == "time.sleep":
        return "use 'await self.clock.sleep(...)' in an async handler"
    return "await a non-blocking call, or use a timer"


def _endless(method: Method, loop: ast.While) -> Diagnostic:
    message = f"this loop in '{method.name}' blocks its executor: it neither ends nor waits"
    hint = "add 'await self.clock.sleep(...)'"
    if not method.is_async:
        hint += f", and write 'async def {method.name}'"
    span = start_span(loop, len("while"), method.span.file)
    return Diagnostic(ENDLESS_LOOP, message, span, hint=hint)


def endless_loops(function: Function) -> Iterator[ast.While]:
    """Yield the loops that never let anything else run: they neither end nor wait.

    A loop that waits for a request to cancel is one of them if it does not wait for anything else:
    the request cannot be handled meanwhile.
    """
    for node in walk(function.body, closed=SCOPES):
        if isinstance(node, ast.While) and _never_ends(node):
            yield node


def _never_ends(loop: ast.While) -> bool:
    inside = [loop.test, *walk(loop.body, closed=SCOPES)]
    if any(isinstance(node, _WAITS) for node in (*inside, *ast.walk(loop.test))):
        return False
    if any(isinstance(node, _LEAVES) or called_name(node) in _ENDS_OR_WAITS for node in inside):
        return False
    # Only other code can end a loop that does nothing.
    is_forever = isinstance(loop.test, ast.Constant) and bool(loop.test.value)
    return is_forever or _waits_for_cancel(loop.test) or is_empty(loop.body)


def _waits_for_cancel(test: ast.expr) -> bool:
    return any(
        isinstance(node, ast.Attribute) and node.attr == "is_cancel_requested"
        for node in ast.walk(test)
    )
