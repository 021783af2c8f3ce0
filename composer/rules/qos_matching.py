"""Endpoints that do not match because of their QoS, and which of them is probably wrong."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum
from itertools import islice
from pathlib import Path

from composer.base.diagnostics import Diagnostic, Label, error, warning
from composer.base.fast_dataclass import dataclass
from composer.base.folders import nodes_folder
from composer.base.source import Span
from composer.model import Channel, ChannelKind, Node, Port, PortOfNode
from composer.model.qos import (
    DECIDING_POLICIES,
    Incompatibility,
    QosProfile,
    incompatibilities,
    strictest,
)
from composer.rules.analysis.context import Context, location
from composer.rules.analysis.formatting import listed, port_name

QOS_INCOMPATIBLE = error("RC311", "qos-incompatible")
OUTSIDE_QOS = warning("RC531", "outside-qos")

#: Reports about one profile; few topics have so many profiles that do not match it.
_MAX_CONFLICTS = 10

#: Endpoints by what these policies are, with the profile of the first one.
_Groups = Sequence[tuple[QosProfile, list[PortOfNode]]]
#: Maximum number of further endpoints to show for one problem.
_SHOWN_ENDPOINTS = 3


class _Origin(IntEnum):
    """The file that gives a port its QoS, nearest to the user first."""

    SYSTEM = 0
    INCLUDED = 1
    NODE_TYPE = 2
    BUILT_IN = 3


@dataclass(frozen=True, slots=True)
class QosConflict:
    """Endpoints with one profile that offer less than others request."""

    problems: tuple[Incompatibility, ...]
    offers: tuple[PortOfNode, ...]
    requests: tuple[PortOfNode, ...]
    is_offer_wrong: bool  # probably
    place: Span  # where to change it

    @property
    def policy(self) -> str:
        """The first policy that does not match."""
        return self.problems[0].policy


def qos_conflicts(context: Context, channel: Channel) -> Iterator[list[QosConflict]]:
    """Yield the conflicts of a channel, those with the same cause together."""
    types = {endpoint.port.interface.value for endpoint in channel.ends}
    if not (channel.sources and channel.sinks and len(types) == 1):
        return  # another rule reports different types
    sources, sinks = _by_profile(channel.sources), _by_profile(channel.sinks)
    yield from _direction(context, sources, sinks)
    if channel.kind is not ChannelKind.TOPIC:
        yield from _direction(context, sinks, sources)


def _by_profile(endpoints: Iterable[PortOfNode]) -> _Groups:
    groups: dict[tuple[object, ...], list[PortOfNode]] = defaultdict(list)
    for endpoint in endpoints:
        if endpoint.port.qos.known:
            groups[_policies(endpoint.port.qos.profile)].append(endpoint)
    return [(ends[0].port.qos.profile, ends) for ends in groups.values()]


def _policies(profile: QosProfile) -> tuple[object, ...]:
    return tuple(getattr(profile, name) for name in DECIDING_POLICIES)


def _direction(
    context: Context, offering: _Groups, requesting: _Groups
) -> Iterator[list[QosConflict]]:
    if not requesting:
        return
    all_requests = _Requests.of(requesting)
    for offered, offers in offering:
        found = list(islice(all_requests.conflicting(offered), _MAX_CONFLICTS))
        wanting = [endpoint for _, requests in found for endpoint in requests]
        by_place: dict[tuple[str, int, int], list[QosConflict]] = defaultdict(list)
        for problems, requests in found:
            fits_others = len(found) < len(requesting)
            is_offer = not (fits_others and _is_of_streams(problems)) and _is_offer_wrong(
                context, problems, offers, wanting
            )
            place = _place(context, (offers if is_offer else requests)[0], problems[0].policy)
            conflict = QosConflict(problems, tuple(offers), tuple(requests), is_offer, place)
            by_place[location(place)].append(conflict)
        yield from by_place.values()


@dataclass(frozen=True, slots=True)
class _Requests:
    """Endpoints with one profile, or two halves of more: halves that match are not searched."""

    strictest: QosProfile
    endpoints: list[PortOfNode]
    halves: tuple[_Requests, ...] = ()

    @classmethod
    def of(cls, groups: _Groups) -> _Requests:
        if len(groups) == 1:
            return cls(*groups[0])
        middle = len(groups) // 2
        halves = cls.of(groups[:middle]), cls.of(groups[middle:])
        return cls(strictest([half.strictest for half in halves]), [], halves)

    def conflicting(
        self, offered: QosProfile
    ) -> Iterator[tuple[tuple[Incompatibility, ...], list[PortOfNode]]]:
        """Yield why endpoints with one profile do not match an offer, with the endpoints."""
        problems = incompatibilities(offered, self.strictest)
        if problems and not self.halves:
            yield problems, self.endpoints
        for half in self.halves if problems else ():
            yield from half.conflicting(offered)


def _is_of_streams(problems: Sequence[Incompatibility]) -> bool:
    """Return whether both policies differ that distinguish a stream from a latched value."""
    return {"durability", "reliability"} <= {item.policy for item in problems}


def _is_offer_wrong(
    context: Context,
    problems: Sequence[Incompatibility],
    offers: Sequence[PortOfNode],
    requests: Sequence[PortOfNode],
) -> bool:
    """Return whether the offer is probably wrong, not the requests.

    It is a guess: an override by a parameter is the latest change, built-in types are not edited,
    several endpoints that agree are right more often than one, the file of the system is nearer to
    what a user changes than a file that several systems share, and transient-local is never
    requested by default.
    """
    policy = problems[0].policy
    overridden = [policy in ends[0].port.qos.overridden for ends in (offers, requests)]
    if any(overridden) and not all(overridden):
        return overridden[0]
    offer, request = (_origin(context, ends[0], policy) for ends in (offers, requests))
    if _Origin.BUILT_IN in (offer, request):
        return request is _Origin.BUILT_IN and offer is not _Origin.BUILT_IN
    has_one_place = [_has_one_place(ends, policy) for ends in (offers, requests)]
    if any(has_one_place) and not all(has_one_place):
        return has_one_place[0]
    if offer is not request:
        return offer < request
    return any(item.policy == "durability" for item in problems)


def _has_one_place(ends: Sequence[PortOfNode], policy: str) -> bool:
    """Return whether all endpoints get the policy from the same place in a file."""
    first = location(ends[0].port.qos.own_span(policy))
    return all(location(end.port.qos.own_span(policy)) == first for end in ends)


def _origin(context: Context, endpoint: PortOfNode, policy: str) -> _Origin:
    path = Path(endpoint.port.qos.own_span(policy).file.path)
    if str(path) == context.system.source.path:
        return _Origin.SYSTEM
    resolved = path.resolve()
    if resolved.parent == nodes_folder().resolve():
        return _Origin.BUILT_IN
    of_type = {file.resolve() for file in endpoint.node.type_files}
    return _Origin.NODE_TYPE if resolved in of_type else _Origin.INCLUDED


def _place(context: Context, endpoint: PortOfNode, policy: str) -> Span:
    """Return where the QoS of a port is set; of a built-in type, where it is connected or used."""
    if _origin(context, endpoint, policy) is not _Origin.BUILT_IN:
        return endpoint.port.qos.own_span(policy)
    name = f"{endpoint.node.name}.{endpoint.port.name}"
    return context.once(_connection_spans).get(name, endpoint.node.name.span)


def _connection_spans(context: Context) -> dict[str, Span]:
    """Return where connections name ports, the first time."""
    ends = [end for connection in context.system.connections for end in connection.ends]
    return {end.text.value: end.text.span for end in reversed(ends)}


def check_qos_incompatible(context: Context) -> Iterator[Diagnostic]:
    """Compare the profiles on every channel, and report each cause once."""
    for channel in context.all_channels:
        for conflicts in qos_conflicts(context, channel):
            yield _incompatible(channel, conflicts)


def _incompatible(channel: Channel, conflicts: list[QosConflict]) -> Diagnostic:
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
    overrides = tuple(
        ("qos override", port_name(end))
        for end in (wrong, other)
        if first.policy in end.port.qos.overridden
    )
    return Diagnostic(
        QOS_INCOMPATIBLE, message, first.place, tuple(labels), "; ".join(hints), relies_on=overrides
    )


def _labels(conflict: QosConflict) -> Iterator[Label]:
    """Yield the other endpoints of a conflict, and where a shared profile sets the policy."""
    policy, problem = conflict.policy, conflict.problems[0]
    wrong = (conflict.offers if conflict.is_offer_wrong else conflict.requests)[0]
    for verb, value, endpoints in (
        ("offers", problem.offered, conflict.offers),
        ("requests", problem.requested, conflict.requests),
    ):
        is_wrong = wrong is endpoints[0]
        shown = (
            endpoints[1 : 1 + _SHOWN_ENDPOINTS] if is_wrong else endpoints[: 1 + _SHOWN_ENDPOINTS]
        )
        for endpoint in shown:
            text = f"{endpoint.port.kind} '{port_name(endpoint)}' {verb} {value}"
            too = " too" if is_wrong else ""
            yield Label(endpoint.port.qos.own_span(policy), f"{text}{too}")
    shared = wrong.port.qos.policy_span(policy)
    if location(shared) != location(wrong.port.qos.own_span(policy)):
        yield Label(shared, f"{policy} is set here")


def check_outside_qos(context: Context) -> Iterator[Diagnostic]:
    """Compare the QoS of connections and of ports outside the process."""
    reported: set[Span] = set()
    for node in context.system.nodes:
        if node.implementation.in_process:
            continue
        for port in node.ports:
            if port.kind.channel is ChannelKind.TOPIC and port.qos.span not in reported:
                found = list(_own_qos(node, port))
                reported.update(item.primary for item in found)
                yield from found


def _own_qos(node: Node, port: Port) -> Iterator[Diagnostic]:
    declared = port.declared_qos
    if declared is None or not (declared.explicit and declared.known and port.qos.known):
        return
    different = _different_policies(declared.profile, port.qos.profile)
    if different:
        yield Diagnostic(
            OUTSIDE_QOS,
            f"'{node.name}.{port.name}' keeps its own {listed(different)}: "
            f"the node runs outside the process",
            port.qos.span,
            (Label(declared.span, "its own QoS"),),
            "use the QoS of that port for the connection",
            (("topic qos", port.full_name),),
        )


def _different_policies(first: QosProfile, second: QosProfile) -> tuple[str, ...]:
    pairs = zip(DECIDING_POLICIES, _policies(first), _policies(second), strict=True)
    return tuple(name for name, own, other in pairs if own != other)
