"""Silence monitoring of a publisher that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.earlier_errors import PORT_SECTIONS, earlier_errors
from composer.diagnostics import Diagnostic, error, suggestion
from composer.model import PortKind

RULE = error(
    code="RC213",
    name="unknown-watched-publisher",
    summary="topic_silence_ms names a publisher that the node does not have.",
    why="The publisher would not be monitored, and its silence would go unnoticed.",
    bad="""\
system: watching
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}
    lifecycle: {watch: {topic_silence_ms: {scans: 500}}}
""",
    good="""\
system: watching
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}
    lifecycle: {watch: {topic_silence_ms: {scan: 500}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the watched publishers with the declared ones."""
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        if not node.complete or errors.may_declare(node.name.value, *PORT_SECTIONS):
            continue
        known = [port.name.value for port in node.ports_of(PortKind.PUBLISHER)]
        for name, _ in node.supervision.watch.topics:
            if name.value not in known and not is_unresolved(name.value):
                yield Diagnostic(
                    RULE,
                    f"node '{node.name}' has no publisher '{name}' to watch",
                    name.span,
                    hint=suggestion(name.value, known),
                )
