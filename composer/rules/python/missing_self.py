"""A method without self."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import GENERAL_HANDLERS, distinct_behaviors, handlers
from composer.behavior_source import Function
from composer.behavior_source.receivers import lacks_self
from composer.behavior_source.traversal import walk
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC449",
        name="missing-self",
        severity=Severity.ERROR,
        summary="A method of a behavior lacks its first argument 'self'.",
        why=(
            "Python passes the object as the first argument of every method. Without 'self', "
            "the call raises TypeError, or the arguments are shifted by one."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick():
        pass
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    timers: {tick: {period_ms: 100}}
# file: counter.py
class Counter:
    def on_tick(self):
        pass
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the methods of all classes in the files of behaviors."""
    for node, source in context.once(distinct_behaviors):
        expected = {name: len(arguments) for name, arguments in GENERAL_HANDLERS.items()}
        expected |= {handler.name: len(handler.arguments) for handler in handlers(node)}
        own = {id(known) for _, known in source.own_classes}
        for module in source.own_modules:
            for known in module.classes.values():
                arguments = expected if id(known) in own else {}
                called = _called_in_body(known.node)
                for method in known.methods:
                    if method.node is None or method.name in called:
                        continue
                    if not lacks_self(method.node, arguments.get(method.name)):
                        continue
                    yield Diagnostic(
                        RULE,
                        f"method '{method.name}' of '{known.name}' lacks 'self'",
                        method.span,
                        hint=_hint(method.node),
                    )


def _called_in_body(node: ast.ClassDef) -> frozenset[str]:
    """Return the functions that the body of a class calls itself: they are not methods."""
    return frozenset(
        item.func.id
        for item in walk(node.body, closed=(ast.FunctionDef, ast.AsyncFunctionDef))
        if isinstance(item, ast.Call) and isinstance(item.func, ast.Name)
    )


def _hint(function: Function) -> str:
    positional = (item.arg for item in (*function.args.posonlyargs, *function.args.args))
    return f"write 'def {function.name}({', '.join(('self', *positional))})'"
