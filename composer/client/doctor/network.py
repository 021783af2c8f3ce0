"""The network as used by DDS: interfaces, multicast, shared memory, and the discovery of a system.

Whether a server answers is shown by :func:`composer.client.doctor.graph.check_discovery`: two
participants discover each other through it.
"""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path

from composer.base.characters import counted
from composer.client.doctor import CheckResult, error, note, ok, warning
from composer.model import Discovery, DiscoveryKind
from composer.runtime.middleware.environment import discovery_conflict
from composer.runtime.middleware.local_resources import (
    LARGE_SEGMENT_BYTES,
    MEGABYTE,
    MIN_FREE_BYTES,
    SHARED_MEMORY,
    free_bytes,
)
from composer.runtime.process.computer import (
    PortState,
    has_interface,
    interface_names,
    port_state,
    resolve,
)

#: Areas of the checks.
_NETWORK = "network"
_DISCOVERY = "discovery"
#: The flags of net/if.h.
_UP, _LOOPBACK, _MULTICAST = 0x1, 0x8, 0x1000
#: The multicast group of DDS discovery. See the DDS Interoperability Protocol, 9.6.1.4.
_MULTICAST_GROUP = "239.255.0.1"
_PROBE_S = 0.5
#: A datagram to this port is for no program (RFC 863).
_DISCARD_PORT = 9


def check_network(
    reach: str,
    *,
    devices: Path = Path("/sys/class/net"),
    shared_memory: Path | None = SHARED_MEMORY,
) -> Iterator[CheckResult]:
    """Check interfaces, multicast and shared memory.

    ``reach`` is the discovery range; ``shared_memory`` is None if DDS does not use it.
    """
    if reach == "SUBNET":
        yield _check_devices(devices)
        yield _check_multicast()
    if shared_memory is not None and shared_memory.is_dir():
        yield _check_free_space(shared_memory)
        yield from _check_leftovers(shared_memory)


def _check_devices(devices: Path) -> CheckResult:
    usable = sorted(device.name for device in devices.glob("*") if _is_usable(device / "flags"))
    if usable:
        return ok(_NETWORK, f"interfaces with multicast: {', '.join(usable)}")
    return warning(
        _NETWORK,
        "no network interface is up and supports multicast: other computers are not discovered",
        "bring one up ('ip link set <name> up multicast on'), or list the other computers in"
        " ROS_STATIC_PEERS",
    )


def _is_usable(flags_file: Path) -> bool:
    try:
        flags = int(flags_file.read_text(encoding="ascii"), 16)
    except (OSError, ValueError):
        return False
    return bool(flags & _UP and flags & _MULTICAST and not flags & _LOOPBACK)


def _check_multicast() -> CheckResult:
    """Send a datagram to the multicast group of DDS and check that it arrives."""
    try:
        arrived = _probe()
    except OSError as problem:
        return _no_multicast(f"multicast does not work: {problem.strerror or problem}")
    if arrived:
        return ok(_NETWORK, "multicast works on this computer")
    return _no_multicast(f"a multicast datagram did not arrive within {_PROBE_S:g} s")


def _no_multicast(message: str) -> CheckResult:
    return warning(
        _NETWORK,
        message,
        "allow UDP to 239.255.0.1 in the firewall ('ufw allow in proto udp to 224.0.0.0/4'),"
        " or set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST or ROS_STATIC_PEERS",
    )


def _probe() -> bool:
    content = os.urandom(16)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind(("", 0))
        membership = socket.inet_aton(_MULTICAST_GROUP) + socket.inet_aton("0.0.0.0")  # noqa: S104 - any
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        receiver.settimeout(_PROBE_S)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.sendto(content, (_MULTICAST_GROUP, receiver.getsockname()[1]))
        try:
            return receiver.recv(len(content)) == content
        except TimeoutError:
            return False


def _check_free_space(folder: Path) -> CheckResult:
    free = free_bytes(folder)
    if free >= MIN_FREE_BYTES:
        return ok(_NETWORK, f"shared memory: {free / MEGABYTE:.0f} MB free in {folder}")
    return warning(
        _NETWORK,
        f"shared memory: only {free / MEGABYTE:.1f} MB free in {folder}; a system that sends"
        f" images or point clouds takes {LARGE_SEGMENT_BYTES // MEGABYTE} MB if"
        f" {MIN_FREE_BYTES // MEGABYTE} MB are free",
        "increase it for the container (docker run --shm-size=1g), remove leftovers"
        " ('fastdds shm clean'), or set FASTDDS_BUILTIN_TRANSPORTS=UDPv4",
    )


def _check_leftovers(folder: Path) -> Iterator[CheckResult]:
    """Count the segments of killed processes, whose files Fast DDS no longer locks."""
    dead = [path for path in sorted(folder.glob("fastrtps_*_el")) if _is_unlocked(path)]
    if dead:
        yield note(
            _NETWORK,
            f"{counted(len(dead), 'shared memory segment')} of killed processes:"
            " Fast DDS prints errors about them",
            "run 'fastdds shm clean'",
        )


def _is_unlocked(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            # A shared lock does not block processes that are starting.
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def check_declared_discovery(
    discovery: Discovery, environment: Mapping[str, str]
) -> Iterator[CheckResult]:
    """Check the discovery of a system from this computer."""
    conflict = discovery_conflict(discovery, environment)
    if conflict is not None:
        yield warning(_DISCOVERY, conflict, "unset it, unless it is intended")
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
    servers = ((resolve(host), port) for host, port in discovery.servers)
    return any(at and port_state(at, port) is PortState.FREE for at, port in servers)


def _check_server(host: str, port: int, *, starts: bool) -> CheckResult:
    address = resolve(host)
    name = f"discovery server {host}:{port}"
    if address is None:
        return _unresolved(name, host)
    start_it = f"start it there: fastdds discovery -i 0 -l {address} -p {port}"
    match port_state(address, port):
        case PortState.FREE if starts:
            return ok(
                _DISCOVERY, f"{name} does not run yet: 'compose run' starts it on this computer"
            )
        case PortState.FREE | PortState.REFUSED:
            return error(_DISCOVERY, f"{name} does not run: nothing listens on that port", start_it)
        case PortState.UNREACHABLE:
            remedy = "check its address, the cable or Wi-Fi, and the route ('ip route')"
            return error(_DISCOVERY, f"{name} cannot be reached from this computer", remedy)
        case PortState.IN_USE:
            return ok(_DISCOVERY, f"{name}: a program of this computer listens on that port")
        case PortState.UNKNOWN:
            return ok(_DISCOVERY, f"{name}: its computer does not refuse that port")


def _check_peer(host: str) -> CheckResult:
    address = resolve(host)
    if address is None:
        return _unresolved(f"peer {host}", host)
    if port_state(address, _DISCARD_PORT) is PortState.UNREACHABLE:
        remedy = "check its address, the cable or Wi-Fi, and the route ('ip route')"
        return error(_DISCOVERY, f"peer {host} cannot be reached from this computer", remedy)
    return ok(_DISCOVERY, f"peer {host}: there is a route to {address}")


def _check_interface(text: str) -> CheckResult:
    if has_interface(text):
        return ok(_DISCOVERY, f"network interface {text} exists")
    listed = ", ".join(interface_names())
    return error(_DISCOVERY, f"there is no network interface {text}", f"use one of {listed}")


def _unresolved(name: str, host: str) -> CheckResult:
    remedy = f"correct it, use an IPv4 address, or add {host} to /etc/hosts"
    return error(_DISCOVERY, f"{name}: the name cannot be resolved on this computer", remedy)
