"""Endpoints with incompatible QoS profiles."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

from composer.analysis.context import Context
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Channel, ChannelKind, PortOfNode
from composer.qos import Incompatibility, QosProfile, incompatibilities

RULE = register(
    Rule(
        code="RC311",
        name="qos-incompatible",
        severity=Severity.ERROR,
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
)

#: Maximum number of further endpoints to show for one problem.
_SHOWN = 3

Groups = Mapping[QosProfile, list[PortOfNode]]


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the profiles on every channel, each pair of profiles once."""
    for channel in context.all_channels:
        if channel.sources and channel.sinks and _one_type(channel):
            sources, sinks = _by_profile(channel.sources), _by_profile(channel.sinks)
            yield from _direction(channel, sources, sinks)
            if channel.kind is not ChannelKind.TOPIC:
                yield from _direction(channel, sinks, sources)


def _one_type(channel: Channel) -> bool:
    """Return whether all endpoints have one type; another rule reports different types."""
    return len({endpoint.port.interface.value for endpoint in channel.ends}) == 1


def _by_profile(endpoints: Iterable[PortOfNode]) -> Groups:
    groups: dict[QosProfile, list[PortOfNode]] = defaultdict(list)
    for endpoint in endpoints:
        if endpoint.port.qos.known:
            groups[endpoint.port.qos.profile].append(endpoint)
    return groups


def _direction(channel: Channel, offering: Groups, requesting: Groups) -> Iterator[Diagnostic]:
    for offered, offers in offering.items():
        for requested, requests in requesting.items():
            problems = list(incompatibilities(offered, requested))
            if problems:
                yield _diagnostic(channel, problems, offers, requests)


def _diagnostic(
    channel: Channel,
    problems: list[Incompatibility],
    offers: list[PortOfNode],
    requests: list[PortOfNode],
) -> Diagnostic:
    request, offer = requests[0], offers[0]
    problem = problems[0]
    policy = problem.policy
    requested = " and ".join(f"{item.policy} {item.requested}" for item in problems)
    offered = " and ".join(item.offered for item in problems)
    hints = (f"offer {item.requested}, or request {item.offered}" for item in problems)
    labels = [
        Label(
            endpoint.port.qos.policy_span(policy),
            f"{endpoint.port.kind} '{port_name(endpoint)}' offers {problem.offered}",
        )
        for endpoint in offers[: 1 + _SHOWN]
    ]
    labels += [
        Label(
            endpoint.port.qos.policy_span(policy),
            f"{endpoint.port.kind} '{port_name(endpoint)}' requests {problem.requested} too",
        )
        for endpoint in requests[1 : 1 + _SHOWN]
    ]
    return Diagnostic(
        RULE,
        f"{request.port.kind} '{port_name(request)}' requests {requested} on "
        f"'{channel.name}', but {offer.port.kind} '{port_name(offer)}' offers {offered}",
        request.port.qos.policy_span(policy),
        tuple(labels),
        "; ".join(hints),
    )
