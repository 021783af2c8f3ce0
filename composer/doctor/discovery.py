"""The discovery of a system, as seen from this computer: addresses, ports and interfaces.

Whether a server answers is shown by :func:`composer.doctor.graph.check_discovery`: two participants
discover each other through it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from composer.doctor.result import CheckResult, error, ok, warning
from composer.model import Discovery, DiscoveryKind
from composer.runtime.middleware.discovery import discovery_conflict
from composer.runtime.process.addresses import (
    PortState,
    has_interface,
    interface_names,
    port_state,
    resolve,
)

AREA = "discovery"
#: A datagram to this port is for no program (RFC 863).
_DISCARD_PORT = 9


def check_declared_discovery(
    discovery: Discovery, environment: Mapping[str, str]
) -> Iterator[CheckResult]:
    """Check the discovery of a system from this computer."""
    conflict = discovery_conflict(discovery, environment)
    if conflict is not None:
        yield warning(AREA, conflict, "unset it, unless it is intended")
        return
    match discovery.kind.value:
        case DiscoveryKind.SERVER:
            for host, port in discovery.servers:
                yield _check_server(host, port, starts=discovery.start)
        case DiscoveryKind.PEERS:
            for peer in discovery.peers:
                yield _check_peer(peer.value)
        case DiscoveryKind.MULTICAST:
            for interface in discovery.interfaces:
                yield _check_interface(interface.value)


def starts_server(discovery: Discovery, environment: Mapping[str, str]) -> bool:
    """Return whether 'compose run' would start a server on this computer now."""
    if not discovery.start or discovery_conflict(discovery, environment) is not None:
        return False
    found = ((resolve(host), port) for host, port in discovery.servers)
    return any(at and port_state(at, port) is PortState.FREE for at, port in found)


def _check_server(host: str, port: int, *, starts: bool) -> CheckResult:
    address = resolve(host)
    name = f"discovery server {host}:{port}"
    if address is None:
        return _unresolved(name, host)
    start_it = f"start it there: fastdds discovery -i 0 -l {address} -p {port}"
    match port_state(address, port):
        case PortState.FREE if starts:
            return ok(AREA, f"{name} does not run yet: 'compose run' starts it on this computer")
        case PortState.FREE | PortState.REFUSED:
            return error(AREA, f"{name} does not run: nothing listens on that port", start_it)
        case PortState.UNREACHABLE:
            remedy = "check its address, the cable or Wi-Fi, and the route ('ip route')"
            return error(AREA, f"{name} cannot be reached from this computer", remedy)
        case PortState.IN_USE:
            return ok(AREA, f"{name}: a program of this computer listens on that port")
        case PortState.UNKNOWN:
            return ok(AREA, f"{name}: its computer does not refuse that port")


def _check_peer(host: str) -> CheckResult:
    address = resolve(host)
    if address is None:
        return _unresolved(f"peer {host}", host)
    if port_state(address, _DISCARD_PORT) is PortState.UNREACHABLE:
        remedy = "check its address, the cable or Wi-Fi, and the route ('ip route')"
        return error(AREA, f"peer {host} cannot be reached from this computer", remedy)
    return ok(AREA, f"peer {host}: there is a route to {address}")


def _check_interface(text: str) -> CheckResult:
    if has_interface(text):
        return ok(AREA, f"network interface {text} exists")
    listed = ", ".join(interface_names())
    return error(AREA, f"there is no network interface {text}", f"use one of {listed}")


def _unresolved(name: str, host: str) -> CheckResult:
    remedy = f"correct it, use an IPv4 address, or add {host} to /etc/hosts"
    return error(AREA, f"{name}: the name cannot be resolved on this computer", remedy)
