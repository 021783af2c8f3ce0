"""Topics, services and actions whose ports have different types."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping

from composer.analysis.context import Context
from composer.analysis.fields import field_problems
from composer.fast_dataclass import dataclass
from composer.field_types import Problem
from composer.model import Channel, PortOfNode


@dataclass(frozen=True, slots=True)
class TypeMismatch:
    """A channel with several types: a port with the usual one, and all ports with others."""

    channel: Channel
    usual: PortOfNode
    others: Mapping[str, list[PortOfNode]]


def type_mismatches(context: Context) -> tuple[TypeMismatch, ...]:
    """Return the channels with several types."""
    return tuple(_mismatches(context))


def certain_field_problems(context: Context) -> Iterator[Problem]:
    """Yield the problems with fields, except of ports whose type is probably wrong."""
    doubtful = {
        _key(endpoint)
        for mismatch in context.once(type_mismatches)
        for endpoints in mismatch.others.values()
        for endpoint in endpoints
    }
    for found in context.once(field_problems):
        if found.port not in doubtful:
            yield found.problem


def _mismatches(context: Context) -> Iterator[TypeMismatch]:
    troubled = {found.port for found in context.once(field_problems)}
    for channel in context.all_channels:
        by_type: dict[str, list[PortOfNode]] = defaultdict(list)
        for endpoint in channel.ends:
            if context.interface(endpoint.port) is not None:
                by_type[endpoint.port.interface.value].append(endpoint)
        if len(by_type) > 1:
            yield _mismatch(channel, by_type, troubled)


def _mismatch(
    channel: Channel,
    by_type: dict[str, list[PortOfNode]],
    troubled: set[tuple[str, str] | None],
) -> TypeMismatch:
    """Choose the usual type: one that fits what its nodes do, then the most common, the first."""

    def weight(name: str) -> tuple[bool, int]:
        endpoints = by_type[name]
        fits = not any(_key(endpoint) in troubled for endpoint in endpoints)
        return fits, len(endpoints)

    common = max(by_type, key=weight)
    others = {name: endpoints for name, endpoints in by_type.items() if name != common}
    return TypeMismatch(channel, by_type[common][0], others)


def _key(endpoint: PortOfNode) -> tuple[str, str]:
    return endpoint.node.name.value, endpoint.port.name.value
