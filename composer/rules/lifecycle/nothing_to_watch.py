"""Silence monitoring for a node that publishes nothing."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.earlier_errors import PORT_SECTIONS, earlier_errors
from composer.diagnostics import Diagnostic, error
from composer.model import PortKind

RULE = error(
    code="RC404",
    name="nothing-to-watch",
    summary="topic_silence_ms is set for a node without publishers.",
    why="A node without publishers is always silent, so it would fail repeatedly.",
    bad="""\
system: watching
nodes:
  logger:
    subscriptions: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true, log: scan}}
    lifecycle: {watch: {topic_silence_ms: 500}}
""",
    good="""\
system: watching
nodes:
  logger:
    subscriptions: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true, log: scan}}
    lifecycle: {watch: {callback_ms: 500}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every node that is watched as a whole."""
    errors = context.once(earlier_errors)
    for node in context.system.nodes:
        limit = node.supervision.watch.silence_ms
        if limit is None or not node.complete or node.ports_of(PortKind.PUBLISHER):
            continue
        if errors.may_declare(node.name.value, *PORT_SECTIONS):
            continue
        yield Diagnostic(
            RULE,
            f"node '{node.name}' is watched for silence, but has no publishers",
            limit.span,
            hint="watch the nodes that publish its input, or set 'callback_ms'",
        )
