"""A handler that does not return what it must."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.analysis.python.behaviors import Handler, distinct_behaviors, handlers
from composer.behavior_checks import Kind
from composer.behavior_source import Function, Method
from composer.behavior_source.flow import empty_returns, reaches_end
from composer.behavior_source.spans import span_of
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC448",
        name="missing-return",
        severity=Severity.ERROR,
        summary="A handler or an annotated function may return None instead of its result.",
        why=(
            "A service handler returns the response; without it, the client gets a failure. A "
            "goal is accepted only if 'accept_...' returns True. A function with '-> Point' "
            "returns one on every path."
        ),
        bad="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    services: {reset: {type: std_srvs/srv/Trigger}}
# file: counter.py
class Counter:
    def on_reset(self, request, response):
        response.success = True
""",
        good="""\
# file: system.yaml
system: behavior
nodes:
  counter:
    behavior: counter:Counter
    services: {reset: {type: std_srvs/srv/Trigger}}
# file: counter.py
class Counter:
    def on_reset(self, request, response):
        response.success = True
        return response
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every way out of the handlers of services and of 'accept'."""
    for node, source in context.once(distinct_behaviors):
        for handler in handlers(node):
            method = source.method(handler.name)
            if method is not None and method.known and method.node is not None:
                what = _returned(handler)
                if what is not None:
                    yield from _handler(handler, method, method.node, what)
    yield from diagnostics_of(context, Kind.RETURN, RULE)


def _returned(handler: Handler) -> str | None:
    """Return what a handler must return, or None."""
    if handler.kind == PortKind.SERVICE.value:
        return "response"
    return "True or False" if handler.name.startswith("accept_") else None


def _handler(
    handler: Handler, method: Method, function: Function, what: str
) -> Iterator[Diagnostic]:
    label = Label(handler.of.span, f"the {handler.kind}")
    message = f"'{handler.name}' must return " + ("the response" if what == "response" else what)
    for statement in empty_returns(function):
        span = span_of(statement, method.span.file)
        yield Diagnostic(
            RULE, f"{message}, not None", span, (label,), f"write 'return {_example(what)}'"
        )
    if reaches_end(function):
        hint = f"end it with 'return {_example(what)}'"
        yield Diagnostic(
            RULE, f"{message}, but may end without a 'return'", method.span, (label,), hint
        )


def _example(what: str) -> str:
    return what.partition(" ")[0]
