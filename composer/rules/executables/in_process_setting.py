"""A setting of a node in another process that only nodes of this process have."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from composer.analysis.call_settings import callback_settings
from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error
from composer.model import Isolation, Node, Port, System
from composer.source import Span

RULE = error(
    code="RC474",
    name="in-process-setting",
    summary="An executable or external node has a setting for nodes of the process.",
    why=(
        "The composer does not call the callbacks of these nodes: it starts their processes, "
        "drives their lifecycle and observes their ports. The setting would have no effect. "
        "What the type of an external node declares is for where the node runs."
    ),
    bad="""\
# file: system.yaml
system: lights
nodes:
  lamp:
    executable: {command: [sh, driver.sh]}
    subscriptions:
      light: {type: std_msgs/msg/Bool, qos: command, external: true, log: "{message.data}"}
# file: driver.sh
exec driver
""",
    good="""\
# file: system.yaml
system: lights
nodes:
  lamp:
    executable: {command: [sh, driver.sh]}
    subscriptions: {light: {type: std_msgs/msg/Bool, qos: command, external: true}}
# file: driver.sh
exec driver
""",
)


#: Keys of a node's entry that need its process, or its code.
_NOT_OF_OTHERS = frozenset({"executor", "introspection"})
_NOT_OF_EXTERNAL = _NOT_OF_OTHERS | {"log_level"}


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that do not run in the process."""
    for node in context.system.nodes:
        kind = node.implementation
        if kind.in_process:
            continue
        settings = _of_entry(node, context.system)
        if node.external is None or node.type_name is None:
            settings = chain(settings, _declared(node, context.once(_isolated_by_connection)))
        for what, span in settings:
            yield Diagnostic(
                RULE,
                f"{what} has no effect: node '{node.name}' is an {kind} node"
                if kind == "external"
                else f"{what} has no effect: node '{node.name}' is an executable",
                span,
                hint="remove it",
            )


def _of_entry(node: Node, system: System) -> Iterator[tuple[str, Span]]:
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


def _declared(node: Node, isolated: frozenset[tuple[str, str]]) -> Iterator[tuple[str, Span]]:
    """Yield what the node or its type declares for the callbacks."""
    yield from callback_settings(node)
    for port in node.ports:
        yield from _of_port(port)
        is_default = node.hosted_class is not None or (node.name.value, port.name.value) in isolated
        if port.isolation is Isolation.COPY and not is_default:
            yield f"'isolation' of {port.kind} '{port.name}'", port.span


def _of_port(port: Port) -> Iterator[tuple[str, Span]]:
    if port.budget_ms is not None:
        yield "'budget_ms'", port.budget_ms.span
    for name, is_set in (("reentrant", port.reentrant), ("always_on", port.always_on)):
        if is_set:
            yield f"'{name}' of {port.kind} '{port.name}'", port.span
