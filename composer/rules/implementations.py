"""Node types, and what a node can do with its implementation."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path, PurePath

from composer.base.diagnostics import Diagnostic, Label, error, suggestion, warning
from composer.base.source import Located, Span, shown_path
from composer.language.rules import UNUSED_DECLARATION
from composer.language.tree import is_opaque
from composer.model import ImplementationKind, Isolation, Node, Port, PortKind, System
from composer.project import SETTINGS_FILE, Project
from composer.project.node_types import replaced_built_in_type
from composer.python_code.nodes import handlers
from composer.rules.analysis.context import Context, hosted_classes, is_unresolved, location
from composer.rules.analysis.subjects import earlier_errors

UNKNOWN_NODE_TYPE = error("RC201", "unknown-node-type")
REPLACED_NODE_TYPE = warning("RC214", "replaced-node-type")
NODE_TYPE_NAME = warning("RC215", "node-type-name")
_SUFFIXES = frozenset({".yaml", ".yml"})
IDLE_PORT = warning("RC438", "idle-port")
SEVERAL_IMPLEMENTATIONS = error("RC470", "several-implementations")
SETTING_WITHOUT_EFFECT = error("RC474", "setting-without-effect")
_OTHERS = {
    ImplementationKind.EXECUTABLE: "an executable",
    ImplementationKind.COMPONENT: "a component",
    ImplementationKind.EXTERNAL: "an external node",
}
#: Keys of a node's entry that need its process, or its code.
_NOT_OF_OTHERS = frozenset({"executor", "introspection"})
_NOT_OF_EXTERNAL = _NOT_OF_OTHERS | {"log_level"}
#: What a node without a behavior can do instead, by the kind of its port or timer.
_MISSING_REACTIONS = {
    "timer": "add 'publish', 'call', 'set' or 'log'",
    PortKind.SERVICE.value: "add 'respond'",
    PortKind.ACTION_SERVER.value: "add 'result'",
}


def check_unknown_node_type(context: Context) -> Iterator[Diagnostic]:
    """Check the type of every node that names one."""
    for node in context.system.nodes:
        name = node.type_name
        if name is None or node.type_found or is_unresolved(name.value):
            continue
        if context.node_types.find(name.value) is not None:
            continue  # the file exists but is invalid, which is reported elsewhere
        if context.node_types.find_outside_project(name.value) is not None:
            message = f"the file of node type '{name}' is a symbolic link out of the project"
            yield Diagnostic(
                UNKNOWN_NODE_TYPE, message, name.span, hint="copy the target into the project"
            )
            continue
        yield Diagnostic(
            UNKNOWN_NODE_TYPE,
            f"node '{node.name}' has type '{name}', which does not exist",
            name.span,
            hint=suggestion(name.value, context.node_types.names()),
            relies_on=(("folder", "nodes"),),
        )


def check_replaced_node_type(context: Context) -> Iterator[Diagnostic]:
    """Check the file of every node type, once."""
    seen = set()
    for node in context.system.nodes:
        if node.type_name is None or not node.type_files or node.type_files[0] in seen:
            continue
        path = node.type_files[0]
        seen.add(path)
        if replaced_built_in_type(path) is None:
            continue
        project = Project.at(path.parent)
        if not project.is_declared:
            yield Diagnostic(
                REPLACED_NODE_TYPE,
                f"'{shown_path(path)}' replaces the built-in node type '{node.type_name}'",
                node.type_name.span,
                hint=f"rename it, or create {shown_path(project.root / SETTINGS_FILE)}, which"
                " declares the project",
            )


def check_node_type_name(context: Context) -> Iterator[Diagnostic]:
    """Compare the name of a node type, or the types of nodes, with the names of their files."""
    system = context.system
    if system.node_type:
        yield from _compare_with_file(system.name)
    names = (node.own_type_name for node in system.nodes)
    places = {location(name.span): name for name in names if name is not None}
    for name in places.values():
        yield from _compare_with_file(name)


def _compare_with_file(name: Located[str]) -> Iterator[Diagnostic]:
    file = PurePath(name.span.file.path)
    if file.suffix in _SUFFIXES and file.stem != name.value and not is_unresolved(name.value):
        yield Diagnostic(
            NODE_TYPE_NAME,
            f"node type '{name}' is in a file named '{file.name}'",
            name.span,
            hint=f"write 'node: {file.stem}', or rename the file to '{name}{file.suffix}'",
        )


def unused_node_types(loaded: Iterable[System]) -> Iterator[Diagnostic]:
    """Check all systems and node types of a run together."""
    node_types: list[System] = []
    systems: list[System] = []
    for system in loaded:
        (node_types if system.node_type else systems).append(system)
    used = {
        path.resolve() for system in systems for node in system.nodes for path in node.type_files
    }
    for node_type in node_types if systems else ():
        is_unused = Path(node_type.source.path).resolve() not in used
        if is_unused and not is_opaque(node_type.name.value):
            message = f"no system here uses node type '{node_type.name}'"
            yield Diagnostic(UNUSED_DECLARATION, message, node_type.name.span)


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
