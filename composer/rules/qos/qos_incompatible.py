"""Endpoints with incompatible QoS profiles."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, location
from composer.analysis.endpoints.qos_conflicts import QosConflict, qos_conflicts
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Channel

RULE = error(
    code="RC311",
    name="qos-incompatible",
    summary="One endpoint of a topic or service requests more than the other offers.",
    why=(
        "A subscription requests, a publisher offers, and they match only if the offer is at "
        "least as strong as the request: a best-effort publisher never reaches a reliable "
        "subscription, while a reliable publisher does reach a best-effort one. Requests and "
        "responses of services follow the same rule in both directions. Endpoints that do not "
        "match exchange no data, and ROS logs a warning at most."
    ),
    bad="""\
system: quality
nodes:
  lidar:
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}
  mapper:
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, qos: command}}
""",
    good="""\
system: quality
nodes:
  lidar:
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}
  mapper:
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}
""",
)

#: Maximum number of further endpoints to show for one problem.
_SHOWN = 3


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the profiles on every channel, and report each cause once."""
    for channel in context.all_channels:
        for conflicts in qos_conflicts(context, channel):
            yield _diagnostic(channel, conflicts)


def _diagnostic(channel: Channel, conflicts: list[QosConflict]) -> Diagnostic:
    first = conflicts[0]
    offer, request = first.offers[0], first.requests[0]
    wrong, other = (offer, request) if first.is_offer_wrong else (request, offer)
    verbs = ("offers", "requests") if first.is_offer_wrong else ("requests", "offers")
    pairs = [(item.policy, item.offered, item.requested) for item in first.problems]
    if not first.is_offer_wrong:
        pairs = [(policy, requested, offered) for policy, offered, requested in pairs]
    message = (
        f"{wrong.port.kind} '{port_name(wrong)}' {verbs[0]} "
        f"{' and '.join(f'{policy} {value}' for policy, value, _ in pairs)} "
        f"on '{channel.name}', but {other.port.kind} '{port_name(other)}' {verbs[1]} "
        f"{' and '.join(value for _, _, value in pairs)}"
    )
    hints = (f"offer {item.requested}, or request {item.offered}" for item in first.problems)
    labels = [label for conflict in conflicts for label in _labels(conflict)]
    return Diagnostic(RULE, message, first.place, tuple(labels), "; ".join(hints))


def _labels(conflict: QosConflict) -> Iterator[Label]:
    """Yield the other endpoints of a conflict, and where a shared profile sets the policy."""
    policy, problem = conflict.policy, conflict.problems[0]
    wrong = (conflict.offers if conflict.is_offer_wrong else conflict.requests)[0]
    for verb, value, endpoints in (
        ("offers", problem.offered, conflict.offers),
        ("requests", problem.requested, conflict.requests),
    ):
        is_wrong = wrong is endpoints[0]
        shown = endpoints[1 : 1 + _SHOWN] if is_wrong else endpoints[: 1 + _SHOWN]
        for endpoint in shown:
            text = f"{endpoint.port.kind} '{port_name(endpoint)}' {verb} {value}"
            too = " too" if is_wrong else ""
            yield Label(endpoint.port.qos.own_span(policy), f"{text}{too}")
    shared = wrong.port.qos.policy_span(policy)
    if location(shared) != location(wrong.port.qos.own_span(policy)):
        yield Label(shared, f"{policy} is set here")
