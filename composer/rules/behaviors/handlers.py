"""Handlers: those that are missing, bound to nothing, or do not fit what calls them."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import a
from composer.analysis.python_nodes import behaviors, distinct_behaviors
from composer.diagnostics import Diagnostic, Label, error, nearest, suggestion
from composer.model import Node, PortKind
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import (
    GENERAL_HANDLERS,
    Handler,
    handlers,
    unbound_handlers,
)
from composer.python_code.syntax import Method, scopes_in
from composer.python_code.trees import positional_arguments, span_of
from composer.rules.python.definitions import on_tick
from composer.rules.python.uses_of_nodes import HANDLER_ANNOTATION

MISSING_HANDLER = error(
    code="RC433",
    name="missing-handler",
    summary="A behavior has no method for a port or timer of its node.",
    why=(
        "Handlers bind by name: subscription 'scan' calls 'on_scan'. Without the method, "
        "messages are dropped, timers have no effect, and requests get no response."
    ),
    bad=on_tick("pass").replace("on_tick", "on_tock"),
    good=on_tick("pass"),
)
HANDLER_WITHOUT_PORT = error(
    code="RC434",
    name="handler-without-port",
    summary="A behavior has a handler for a port or timer that the node does not have.",
    why=(
        "Handlers bind by name: 'on_scan' is called for the port or timer 'scan'. Without "
        "one, the method is never called. A method that the code itself uses, as in "
        "on_feedback=self.on_progress, is not a handler."
    ),
    bad=on_tick("pass") + "\n    def on_message(self, message):\n        pass\n",
    good=on_tick("pass"),
)
HANDLER_SIGNATURE = error(
    code="RC435",
    name="handler-signature",
    summary="A handler or callback does not accept the arguments it is called with.",
    why="Every call raises TypeError; for a transition handler, this happens during bring-up.",
    bad=on_tick("pass").replace("(self)", "(self, timer)"),
    good=on_tick("pass"),
)


def check(context: Context) -> Iterator[Diagnostic]:
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
    unbound = {method.name: method for method in unbound_handlers(node, source)}
    missing = [item for item in bound if item.needed and source.method(item.name) is None]
    for handler in missing:
        yield _missing(source, handler, unbound)
    for method in unbound.values():
        if nearest(method.name, {handler.name for handler in missing}) is not None:
            continue  # shown by the diagnostic about the missing handler
        message = f"handler '{method.name}' of '{source.reference.class_name}' matches no port or"
        label = Label(source.reference.text.span, "the behavior of this node")
        hint = _hint(node, method.name, [handler.name for handler in bound])
        yield Diagnostic(HANDLER_WITHOUT_PORT, f"{message} timer", method.span, (label,), hint)


def _missing(source: BehaviorSource, handler: Handler, unbound: dict[str, Method]) -> Diagnostic:
    close = nearest(handler.name, unbound)
    message = (
        f"{handler.kind} '{handler.of}' has no handler: "
        f"'{source.reference.class_name}' has no method '{handler.name}'"
    )
    if close is not None:  # a misspelled reference to the port
        label = Label(handler.of.span, f"the {handler.kind}")
        hint = f"rename '{close}' to '{handler.name}'"
        return Diagnostic(MISSING_HANDLER, message, unbound[close].span, (label,), hint)
    span = source.class_span
    related = (Label(span, "the behavior class"),) if span is not None else ()
    hint = f"add 'def {handler.name}({', '.join(('self', *handler.arguments))})'"
    return Diagnostic(MISSING_HANDLER, message, handler.of.span, related, hint)


def _hint(node: Node, name: str, bound: list[str]) -> str | None:
    stem = name.removeprefix("on_").removeprefix("accept_")
    port = node.port(stem)
    if port is not None:
        return f"'{stem}' is {a(port.kind)}, which has no such handler"
    return suggestion(name, bound)


def _signatures(node: Node, source: BehaviorSource) -> Iterator[Diagnostic]:
    place, class_name = source.reference.text.span, source.reference.class_name
    expected = {name: (arguments, place) for name, arguments in GENERAL_HANDLERS.items()}
    expected |= {item.name: (item.arguments, item.of.span) for item in handlers(node)}
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
            yield Diagnostic(HANDLER_ANNOTATION, message, span, (label,))
