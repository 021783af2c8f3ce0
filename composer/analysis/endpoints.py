"""Every place where a system names a port as ``node.port``."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Endpoint, System


def endpoints(system: System) -> Iterator[Endpoint]:
    """Yield the ends of connections and the stations of chains."""
    for connection in system.connections:
        yield from connection.sources
        yield from connection.sinks
    for chain in system.chains:
        yield from chain.through
