"""What things are called in a diagram's data: the same thing has the same key in every view."""

from __future__ import annotations

from composer.graph.scene import Actor, Channel, End


def node_key(actor: Actor) -> str:
    """Return the key of a node."""
    return f"node:{actor.full_name}"


def end_key(actor: Actor, end: End) -> str:
    """Return the key of a port. A running node may have a publisher and a subscription of a name.

    So the kind is part of it.
    """
    return f"{end.kind.value.replace(' ', '_')}:{actor.full_name}.{end.name}"


def channel_key(channel: Channel) -> str:
    """Return the key of a topic, service or action."""
    return f"{channel.kind}:{channel.name}"
