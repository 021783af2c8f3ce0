"""The ports of a running node, one kind per file. The node's lifecycle state gates all of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.runtime.intra_process.lifecycle_gate import LifecycleGate


class RunningPort:
    """A port or timer between the configuration and the cleanup of its node."""

    __slots__ = ()

    def activate(self) -> None:
        """Begin: the node is active now. Without effect if the gate alone lets traffic through."""

    def deactivate(self) -> None:
        """Stop and discard what waits: the node is leaving *active*."""

    async def drain(self) -> None:
        """Wait until what has begun has ended, up to a time limit."""

    def follow_clock(self) -> None:
        """Follow the node's switch to or from simulated time."""

    def destroy(self) -> None:
        """Destroy the ROS entity."""


class PortSet:
    """The ports and timers of a configured node, in the order in which they were created.

    Those that are always on work from configure to cleanup, the others while the node is active.
    Any thread may add one.
    """

    def __init__(self) -> None:
        self._ports: dict[object, RunningPort] = {}
        self._always_on: set[RunningPort] = set()

    def add(self, entity: object, port: RunningPort, *, always_on: bool = False) -> None:
        """Add the port of an entity."""
        self._ports[entity] = port
        if always_on:
            self._always_on.add(port)

    def pop(self, entity: object) -> RunningPort | None:
        """Remove and return the port of an entity, or None if it has none."""
        port = self._ports.pop(entity, None)
        if port is not None:
            self._always_on.discard(port)
        return port

    @property
    def ports(self) -> Iterator[RunningPort]:
        """All ports and timers."""
        return iter(tuple(self._ports.values()))

    @property
    def gated(self) -> Iterator[RunningPort]:
        """The ports and timers that work only while the node is active."""
        return (port for port in self.ports if port not in self._always_on)

    @property
    def always_on(self) -> tuple[RunningPort, ...]:
        """The ports and timers that work while the node is inactive, too."""
        return tuple(port for port in self.ports if port in self._always_on)


async def deactivate(gate: LifecycleGate, ports: Iterable[RunningPort]) -> None:
    """Stop receiving and cancel what is pending. Publishers stay open for last messages."""
    gate.incoming = False
    deactivated = tuple(ports)
    for port in deactivated:
        port.deactivate()
    gate.cancel_pending()
    for port in deactivated:
        await port.drain()


def settle(gate: LifecycleGate, state: str, is_open: bool, ports: Iterable[RunningPort]) -> None:
    """Open or close a gate, and the ports behind it, in the primary state ``state``."""
    gate.state = state
    if is_open:
        gate.open()
        for port in ports:
            port.activate()
        return
    for port in ports:
        port.deactivate()
    gate.close()
