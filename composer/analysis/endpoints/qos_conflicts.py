"""Endpoints that do not match because of their QoS, and which of them is probably wrong."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import IntEnum
from pathlib import Path

from composer.analysis.context import Context, location
from composer.fast_dataclass import dataclass
from composer.model import Channel, ChannelKind, PortOfNode
from composer.qos import Incompatibility, QosProfile, incompatibilities
from composer.resources import nodes_folder
from composer.source import Span

_Groups = Mapping[QosProfile, list[PortOfNode]]


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
    if not (channel.sources and channel.sinks and _has_one_type(channel)):
        return  # another rule reports different types
    sources, sinks = _by_profile(channel.sources), _by_profile(channel.sinks)
    yield from _direction(context, sources, sinks)
    if channel.kind is not ChannelKind.TOPIC:
        yield from _direction(context, sinks, sources)


def _has_one_type(channel: Channel) -> bool:
    return len({endpoint.port.interface.value for endpoint in channel.ends}) == 1


def _by_profile(endpoints: Iterable[PortOfNode]) -> _Groups:
    groups: dict[QosProfile, list[PortOfNode]] = defaultdict(list)
    for endpoint in endpoints:
        if endpoint.port.qos.known:
            groups[endpoint.port.qos.profile].append(endpoint)
    return groups


def _direction(
    context: Context, offering: _Groups, requesting: _Groups
) -> Iterator[list[QosConflict]]:
    for offered, offers in offering.items():
        found = [
            (problems, requests)
            for requested, requests in requesting.items()
            if (problems := tuple(incompatibilities(offered, requested)))
        ]
        all_requests = [endpoint for _, requests in found for endpoint in requests]
        by_place: dict[tuple[str, int, int], list[QosConflict]] = defaultdict(list)
        for problems, requests in found:
            fits_others = len(found) < len(requesting)
            is_offer = not (fits_others and _is_of_streams(problems)) and _is_offer_wrong(
                context, problems, offers, all_requests
            )
            place = _place(context, (offers if is_offer else requests)[0], problems[0].policy)
            conflict = QosConflict(problems, tuple(offers), tuple(requests), is_offer, place)
            by_place[location(place)].append(conflict)
        yield from by_place.values()


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

    It is a guess: built-in types are not edited, several endpoints that agree are right more often
    than one, the file of the system is nearer to what a user changes than a file that several
    systems share, and transient-local is never requested by default.
    """
    policy = problems[0].policy
    offer, request = (_origin(context, ends[0], policy) for ends in (offers, requests))
    if _Origin.BUILT_IN in (offer, request):
        return request is _Origin.BUILT_IN and offer is not _Origin.BUILT_IN
    offered, requested = (
        {location(end.port.qos.own_span(policy)) for end in ends} for ends in (offers, requests)
    )
    if min(len(offered), len(requested)) == 1 != max(len(offered), len(requested)):
        return len(offered) == 1
    if offer is not request:
        return offer < request
    return any(item.policy == "durability" for item in problems)


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
    for connection in context.system.connections:
        for end in connection.ends:
            if end.text.value == name:
                return end.text.span
    return endpoint.node.name.span
