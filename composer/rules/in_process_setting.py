"""A setting of a node in another process that only nodes of this process have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import Node, Port, System
from composer.source import Span

RULE = register(
    Rule(
        code="RC474",
        name="in-process-setting",
        severity=Severity.ERROR,
        summary="An executable or external node has a setting for nodes of the process.",
        why=(
            "The composer does not call the callbacks of these nodes: it starts their processes, "
            "drives their lifecycle and observes their ports. The setting would have no effect."
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the nodes that do not run in the process."""
    for node in context.system.nodes:
        kind = node.implementation
        if kind.in_process:
            continue
        for what, span in _settings(node, context.system):
            yield Diagnostic(
                RULE,
                f"{what} has no effect: node '{node.name}' is an {kind} node"
                if kind == "external"
                else f"{what} has no effect: node '{node.name}' is an executable",
                span,
                hint="remove it",
            )


def _settings(node: Node, system: System) -> Iterator[tuple[str, Span]]:
    if node.executor is not None:
        yield "'executor'", node.executor.span
    for timer in node.timers:
        yield f"timer '{timer.name}'", timer.span
    for name, _ in node.state:
        yield f"state '{name}'", name.span
    for event, reaction in node.reactions:
        yield f"'on_{event}'", reaction.span
    for port in node.ports:
        yield from _of_port(port)
    watch, default = node.supervision.watch, system.supervision.watch
    if watch.silence_ms is not None and watch.silence_ms is not default.silence_ms:
        yield "'topic_silence_ms'", watch.silence_ms.span
    for topic, _ in watch.topics if watch.topics is not default.topics else ():
        yield "'topic_silence_ms'", topic.span
    if watch.callback_ms is not None and watch.callback_ms is not default.callback_ms:
        yield "'callback_ms'", watch.callback_ms.span
    if watch.max_errors is not None and watch.max_errors is not default.max_errors:
        yield "'max_errors'", watch.max_errors.span


def _of_port(port: Port) -> Iterator[tuple[str, Span]]:
    for event, reaction in port.reactions:
        yield f"the reaction of {port.kind} '{port.name}' to its {event}", reaction.span
    for name, located in (("budget_ms", port.budget_ms), ("timeout_ms", port.timeout_ms)):
        if located is not None and located.span != port.span:  # that of the default
            yield f"'{name}'", located.span
    for name, is_set in (("reentrant", port.reentrant), ("always_on", port.always_on)):
        if is_set:
            yield f"'{name}' of {port.kind} '{port.name}'", port.span
    if port.result is not None or port.feedback is not None or port.accept is not None:
        yield f"the reaction of {port.kind} '{port.name}'", port.span
