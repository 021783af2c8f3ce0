"""Behaviors: their classes, handlers and callbacks."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator

from composer.base.diagnostics import Diagnostic, Label, error, nearest, suggestion, warning
from composer.base.source import Span
from composer.model import Node, PortKind
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import GENERAL_HANDLERS, Handler, handlers, reached_methods
from composer.python_code.problems import Family
from composer.python_code.scopes import Call
from composer.python_code.syntax import Method, scopes_in
from composer.python_code.trees import (
    SCOPES,
    Function,
    called_name,
    is_empty,
    positional_arguments,
    span_of,
    start_span,
    walk,
)
from composer.rules.analysis.context import Context, behaviors, distinct_behaviors
from composer.rules.analysis.formatting import a
from composer.rules.analysis.subjects import wiring
from composer.rules.python import CLASS_MISSING, as_warning, missing, unnamed

MISSING_HANDLER = error("RC433", "missing-handler")
HANDLER_WITHOUT_PORT = error("RC434", "handler-without-port")
HANDLER_SIGNATURE = Family.SIGNATURE.value
BLOCKING_CALL = warning("RC436", "blocking-call")
WRONG_CLASS = error("RC462", "wrong-class")

#: How the names of handlers begin.
_PREFIXES = ("on_", "accept_")
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


def check_handlers(context: Context) -> Iterator[Diagnostic]:
    """Compare the ports and timers of nodes with the methods of their behaviors."""
    for node, source in behaviors(context):
        if source.class_found and source.complete and node.complete:
            yield from _unbound(node, source)
        yield from _signatures(node, source)
    for node, source in distinct_behaviors(context):
        yield from _annotations(node, source)


def _unbound(node: Node, source: BehaviorSource) -> Iterator[Diagnostic]:
    """Report the ports and timers without a handler, and the handlers without a port."""
    bound = list(handlers(node))
    unbound = {method.name: method for method in _unbound_handlers(node, source)}
    missing = [item for item in bound if item.needed and source.method(item.name) is None]
    for handler in missing:
        yield _missing(node, source, handler, unbound)
    for method in unbound.values():
        if nearest(method.name, {handler.name for handler in missing}) is not None:
            continue  # shown by the diagnostic about the missing handler
        message = (
            f"handler '{method.name}' of '{source.reference.class_name}' matches no port or timer"
        )
        label = Label(source.reference.text.span, "the behavior of this node")
        hint = _hint(node, method.name, [handler.name for handler in bound])
        given = (("port", f"{node.name}.{_stem(method.name)}"),)
        yield Diagnostic(
            HANDLER_WITHOUT_PORT, message, method.span, (label,), hint, relies_on=given
        )


def _unbound_handlers(node: Node, source: BehaviorSource) -> list[Method]:
    """Return the methods called ``on_...`` or ``accept_...`` that nothing calls.

    One that the code itself uses, such as ``on_feedback=self.on_progress``, is not a handler.
    """
    called = {handler.name for handler in handlers(node)} | GENERAL_HANDLERS.keys()
    unbound = [
        method
        for method in source.methods
        if method.name.startswith(_PREFIXES) and method.name not in called
    ]
    if not unbound:
        return []
    used = {
        inner.attr
        for module in source.own_modules
        for inner in ast.walk(module.tree)
        if isinstance(inner, ast.Attribute)
    }
    return [method for method in unbound if method.name not in used]


def _missing(
    node: Node, source: BehaviorSource, handler: Handler, unbound: dict[str, Method]
) -> Diagnostic:
    given = (("port", f"{node.name}.{handler.of}"), ("behavior", node.name.value))
    close = nearest(handler.name, unbound)
    message = (
        f"{handler.kind} '{handler.of}' has no handler: "
        f"'{source.reference.class_name}' has no method '{handler.name}'"
    )
    if close is not None:  # a misspelled reference to the port
        label = Label(handler.of.span, f"the {handler.kind}")
        hint = f"rename '{close}' to '{handler.name}'"
        place = unbound[close].span
        return Diagnostic(MISSING_HANDLER, message, place, (label,), hint, relies_on=given)
    span = source.class_span
    related = (Label(span, "the behavior class"),) if span is not None else ()
    hint = f"add 'def {handler.name}({', '.join(('self', *handler.signature.names))})'"
    return Diagnostic(MISSING_HANDLER, message, handler.of.span, related, hint, relies_on=given)


def _stem(handler: str) -> str:
    return handler.removeprefix("on_").removeprefix("accept_")


def _hint(node: Node, name: str, bound: list[str]) -> str | None:
    stem = _stem(name)
    port = node.port(stem)
    if port is not None:
        return f"'{stem}' is {a(port.kind)}, which has no such handler"
    return suggestion(name, bound)


def _signatures(node: Node, source: BehaviorSource) -> Iterator[Diagnostic]:
    place, class_name = source.reference.text.span, source.reference.class_name
    expected = {name: (signature.names, place) for name, signature in GENERAL_HANDLERS.items()}
    expected |= {item.name: (item.signature.names, item.of.span) for item in handlers(node)}
    for name, (arguments, span) in expected.items():
        method = source.method(name)
        if method is None or method.node is None or method.accepts(len(arguments)):
            continue
        takes = ", ".join(item.arg for item in positional_arguments(method.node))
        gets = ", ".join(("self", *arguments))
        message = f"'{name}' of '{class_name}' is called with ({gets}), but takes ({takes})"
        label = Label(span, "called here")
        hint = f"write 'def {name}({gets})'"
        yield Diagnostic(HANDLER_SIGNATURE, message, method.span, (label,), hint)


def _annotations(node: Node, source: BehaviorSource) -> Iterator[Diagnostic]:
    """Report the handlers of subscriptions that annotate another message than they get."""
    types = {f"on_{port.name}": port.interface for port in node.ports_of(PortKind.SUBSCRIPTION)}
    for scope in scopes_in(source.own_classes):
        if scope.function is None or scope.function.name not in types:
            continue
        name, type_ = scope.function.name, types[scope.function.name]
        annotation = next((x.annotation for x in positional_arguments(scope.function)[1:]), None)
        annotated = scope.known(scope.interface, annotation)
        if annotation is not None and annotated not in (None, type_.value):
            message = f"'{name}' gets a {type_}, not a {annotated}"
            label = Label(source.reference.text.span, "the behavior of this node")
            span = span_of(annotation, scope.source)
            given = (("type", f"{node.name}.{_stem(name)}"),)
            rule = as_warning(Family.MESSAGE_TYPE.value)
            yield Diagnostic(rule, message, span, (label,), relies_on=given)


def check_blocking(context: Context) -> Iterator[Diagnostic]:
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
                    BLOCKING_CALL,
                    f"{message} '{call.name}'",
                    call.span,
                    (label,),
                    _blocking_hint(call),
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


def _blocking_hint(call: Call) -> str:
    if call.name == "time.sleep":
        return "use 'await self.clock.sleep(...)' in an async handler"
    return "await a non-blocking call, or use a timer"


def _endless(method: Method, loop: ast.While) -> Diagnostic:
    message = f"this loop in '{method.name}' blocks its executor: it neither ends nor waits"
    hint = "add 'await self.clock.sleep(...)'"
    if not method.is_async:
        hint += f", and write 'async def {method.name}'"
    span = start_span(loop, len("while"), method.span.file)
    return Diagnostic(BLOCKING_CALL, message, span, hint=hint)


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


def check_behaviors(context: Context) -> Iterator[Diagnostic]:
    """Check that every behavior names a class, and that its module can be read and defines it."""
    for node in context.system.nodes:
        if node.behavior is not None:
            yield from unnamed(node.behavior, "behavior")
    for node, source in behaviors(context):
        yield from missing(source, CLASS_MISSING)
        if source.class_span is not None and source.is_rclpy_node:
            yield Diagnostic(
                WRONG_CLASS,
                f"'{source.reference.class_name}' is an rclpy node, not a behavior",
                source.reference.text.span,
                (Label(source.class_span, "here"),),
                "write 'class' instead of 'behavior'",
                (
                    ("file", source.class_span.file.path),
                    ("behavior", node.name.value),
                    *(subject for port in node.ports for subject in wiring(node, port)),
                ),
            )
