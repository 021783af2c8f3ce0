"""What a node can do with its implementation: behavior, class, executable or none."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from composer.base.diagnostics import Diagnostic, Label, error, warning
from composer.base.source import Span
from composer.model import ImplementationKind, Isolation, Node, Port, PortKind, System
from composer.python_code.nodes import handlers
from composer.rules.analysis.context import Context, hosted_classes
from composer.rules.analysis.earlier_errors import earlier_errors

IDLE_PORT = warning("RC438", "idle-port")
SEVERAL_IMPLEMENTATIONS = error("RC470", "several-implementations")
SETTING_WITHOUT_EFFECT = error("RC474", "setting-without-effect")


def check_several_implementations(context: Context) -> Iterator[Diagnostic]:
    """Check that every node has at most one implementation."""
    for node in context.system.nodes:
        for key in node.conflicting[1:]:
            first = node.conflicting[0]
            yield Diagnostic(
                SEVERAL_IMPLEMENTATIONS,
                f"node '{node.name}' has '{key}' in addition to '{first}'",
                key.span,
                related=(Label(first.span, f"'{first}'"),),
                hint="keep one of them",
            )


def callback_settings(node: Node) -> Iterator[tuple[str, Span]]:
    """Yield what a node or its type declares that only callbacks of a behavior use."""
    for timer in node.timers:
        yield f"timer '{timer.name}'", timer.span
    for name, _ in node.state:
        yield f"state '{name}'", name.span
    for event, reaction in node.reactions:
        yield f"'on_{event}'", reaction.span
    for port in node.ports:
        for event, reaction in port.reactions:
            yield f"the reaction of {port.kind} '{port.name}' to its {event}", reaction.span
        if port.result is not None or port.feedback is not None or port.accept is not None:
            yield f"the reaction of {port.kind} '{port.name}'", port.span
        yield from _call_limits(port)


def _call_limits(port: Port) -> Iterator[tuple[str, Span]]:
    """Yield the limits that a client port sets, as text and place."""
    limits = (("timeout_ms", port.timeout_ms), ("result_timeout_ms", port.result_timeout_ms))
    for name, located in limits:
        if located is not None and located.span != port.span:  # that of the default
            yield f"'{name}' of {port.kind} '{port.name}'", located.span


def check_class_setting(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes whose class has callbacks of its own."""
    for item in hosted_classes(context):
        for what, span in callback_settings(item.node):
            message = f"{what} has no effect: node '{item.node.name}' has a class"
            yield Diagnostic(
                SETTING_WITHOUT_EFFECT, message, span, hint="remove it, or write a behavior"
            )


_OTHERS = {
    ImplementationKind.EXECUTABLE: "an executable",
    ImplementationKind.COMPONENT: "a component",
    ImplementationKind.EXTERNAL: "an external node",
}
#: Keys of a node's entry that need its process, or its code.
_NOT_OF_OTHERS = frozenset({"executor", "introspection"})
_NOT_OF_EXTERNAL = _NOT_OF_OTHERS | {"log_level"}


def check_in_process_setting(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that do not run in the process."""
    for node in context.system.nodes:
        kind = node.implementation
        if kind.in_process:
            continue
        settings = _settings_of_entry(node, context.system)
        if node.external is None or node.type_name is None:
            settings = chain(
                settings, _declared_settings(node, context.once(_isolated_by_connection))
            )
        for what, span in settings:
            yield Diagnostic(
                SETTING_WITHOUT_EFFECT,
                f"{what} has no effect: node '{node.name}' is {_OTHERS[kind]}",
                span,
                hint="remove it",
            )


def _settings_of_entry(node: Node, system: System) -> Iterator[tuple[str, Span]]:
    """Yield the settings of the node's own entry."""
    names = _NOT_OF_EXTERNAL if node.external is not None else _NOT_OF_OTHERS
    for key in node.given:
        if key.value in names:
            yield f"'{key}'", key.span
    watch, default = node.supervision.watch, system.supervision.watch
    if watch.silence_ms is not None and watch.silence_ms is not default.silence_ms:
        yield "'topic_silence_ms'", watch.silence_ms.span
    for topic, _ in watch.topics if watch.topics is not default.topics else ():
        yield "'topic_silence_ms'", topic.span
    if watch.callback_ms is not None and watch.callback_ms is not default.callback_ms:
        yield "'callback_ms'", watch.callback_ms.span
    if watch.max_errors is not None and watch.max_errors is not default.max_errors:
        yield "'max_errors'", watch.max_errors.span


def _isolated_by_connection(context: Context) -> frozenset[tuple[str, str]]:
    """Return the ports whose connection sets their isolation, as node and port."""
    return frozenset(
        (end.node, end.port)
        for connection in context.system.connections
        if connection.isolation is not None
        for end in connection.ends
    )


def _declared_settings(
    node: Node, isolated: frozenset[tuple[str, str]]
) -> Iterator[tuple[str, Span]]:
    """Yield what the node or its type declares for the callbacks."""
    yield from callback_settings(node)
    for port in node.ports:
        yield from _settings_of_port(port)
        is_default = node.hosted_class is not None or (node.name.value, port.name.value) in isolated
        if port.isolation is Isolation.COPY and not is_default:
            yield f"'isolation' of {port.kind} '{port.name}'", port.span


def _settings_of_port(port: Port) -> Iterator[tuple[str, Span]]:
    if port.budget_ms is not None:
        yield "'budget_ms'", port.budget_ms.span
    for name, is_set in (("reentrant", port.reentrant), ("always_on", port.always_on)):
        if is_set:
            yield f"'{name}' of {port.kind} '{port.name}'", port.span


#: What a node without a behavior can do instead, by the kind of its port or timer.
_MISSING_REACTIONS = {
    "timer": "add 'publish', 'call', 'set' or 'log'",
    PortKind.SERVICE.value: "add 'respond'",
    PortKind.ACTION_SERVER.value: "add 'result'",
}


def check_idle_port(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that have neither a behavior nor another implementation."""
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        is_declarative = node.implementation is ImplementationKind.DECLARATIVE
        if is_declarative and node.complete and node.name.value not in affected:
            yield from _idle_ports(node)


def _idle_ports(node: Node) -> Iterator[Diagnostic]:
    for handler in handlers(node):
        if handler.needed and handler.kind in _MISSING_REACTIONS:
            message = f"{handler.kind} '{handler.of}' does nothing"
            hint = _MISSING_REACTIONS[handler.kind]
            given = (("port", f"{node.name}.{handler.of}"),)
            yield Diagnostic(IDLE_PORT, message, handler.of.span, hint=hint, relies_on=given)
