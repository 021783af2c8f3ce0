"""A node that counts as silent between two messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.analysis.timing.rates import timed_publishers
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Node, PortKind, PortOfNode
from composer.source import Located

RULE = error(
    code="RC405",
    name="silence-too-short",
    summary="topic_silence_ms is not longer than the publishing period.",
    why=(
        "The node would fail although it publishes on time. Timers are never exact, so allow "
        "for several periods."
    ),
    bad="""\
system: watching
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}
    timers: {spin: {period_ms: 100, publish: {scan: {data: beep}}}}
    lifecycle: {watch: {topic_silence_ms: 50}}
""",
    good="""\
system: watching
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data, external: true}}
    timers: {spin: {period_ms: 100, publish: {scan: {data: beep}}}}
    lifecycle: {watch: {topic_silence_ms: 500}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the watched limits with the periods of the publishing timers."""
    periods: dict[str, dict[str, tuple[PortOfNode, float]]] = {}
    for endpoint, period_s in context.once(timed_publishers):
        of_node = periods.setdefault(endpoint.node.name.value, {})
        of_node[endpoint.port.name.value] = (endpoint, period_s)
    for node in context.system.nodes:
        known = periods.get(node.name.value, {})
        watch = node.supervision.watch
        for name, limit in watch.topics:
            if name.value in known:
                yield from _compare(limit, *known[name.value])
        if watch.silence_ms is not None and known and len(known) == _publishers(node):
            fastest = min(known.values(), key=lambda item: item[1])
            yield from _compare(watch.silence_ms, *fastest)


def _publishers(node: Node) -> int:
    return len(node.ports_of(PortKind.PUBLISHER))


def _compare(limit: Located[float], endpoint: PortOfNode, period_s: float) -> Iterator[Diagnostic]:
    period_ms = period_s * 1000.0
    deadline_ms = endpoint.port.qos.profile.deadline_ms
    if limit.value > period_ms or (deadline_ms is not None and deadline_ms < period_ms):
        return  # a deadline shorter than the period is reported instead
    yield Diagnostic(
        RULE,
        f"node '{endpoint.node.name}' counts as silent after {number(limit.value)} ms, "
        f"but publishes '{endpoint.port.name}' every {number(period_ms)} ms",
        limit.span,
        (Label(endpoint.port.name.span, "the watched publisher"),),
        f"allow for late messages, for example {number(3 * period_ms)}",
    )
