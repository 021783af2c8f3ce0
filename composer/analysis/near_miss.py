"""Which topic, service or action a port that meets nobody may have been meant for."""

from __future__ import annotations

from typing import TypeAlias

from composer.analysis.context import Context
from composer.model import PortKind, PortOfNode
from composer.spelling import vocabulary

_OPPOSITES = {
    PortKind.PUBLISHER: PortKind.SUBSCRIPTION,
    PortKind.SERVICE: PortKind.CLIENT,
    PortKind.ACTION_SERVER: PortKind.ACTION_CLIENT,
}
COUNTERPARTS = _OPPOSITES | {sink: source for source, sink in _OPPOSITES.items()}

#: For a kind of port and a type: the names such ports have, each with the nodes they belong to.
_Names: TypeAlias = dict[tuple[PortKind, str], dict[str, set[str]]]

_LOOKED_AT = 5  # names, of which some may be of the very node or the very name


def nearest_channel(context: Context, end: PortOfNode) -> str | None:
    """Return a hint at the name that ports of the other side and of the same type have."""
    port = end.port
    wanted = (COUNTERPARTS[port.kind], port.interface.value)
    nodes = context.once(_names).get(wanted, {})
    for name in vocabulary(tuple(nodes)).close(port.full_name, _LOOKED_AT):
        if name != port.full_name and nodes[name] != {end.node.name.value}:
            return f"did you mean '{name}'?"
    return None


def _names(context: Context) -> _Names:
    found: _Names = {}
    for channel in context.channels:
        for end in channel.ends:
            names = found.setdefault((end.port.kind, end.port.interface.value), {})
            names.setdefault(channel.name, set()).add(end.node.name.value)
    return found
