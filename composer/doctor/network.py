"""The network as DDS uses it: interfaces, multicast, shared memory."""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

from composer.doctor.finding import Finding, fine, note, warning
from composer.runtime.process.shared_memory import SHARED_MEMORY

AREA = "network"
#: The flags of net/if.h.
_UP, _LOOPBACK, _MULTICAST = 0x1, 0x8, 0x1000
#: Where participants announce themselves. See the DDS Interoperability Protocol, 9.6.1.4.
_GROUP = "239.255.0.1"
_PROBE_S = 0.5
_MEGABYTE = 1_000_000
#: A participant of Fast DDS takes about half a megabyte, a large message its size.
_LEAST_SHARED_MEMORY_BYTES = 16 * _MEGABYTE


def look_at_network(
    reach: str,
    *,
    devices: Path = Path("/sys/class/net"),
    shared_memory: Path | None = SHARED_MEMORY,
) -> Iterator[Finding]:
    """Yield what hinders participants from meeting.

    ``reach`` is the discovery range; ``shared_memory`` None where DDS does not use it.
    """
    if reach == "SUBNET":
        yield _interfaces(devices)
        yield _multicast()
    if shared_memory is not None and shared_memory.is_dir():
        yield _space(shared_memory)
        yield from _leftovers(shared_memory)


def _interfaces(devices: Path) -> Finding:
    usable = sorted(
        device.name for device in devices.glob("*") if _reaches_others(device / "flags")
    )
    if usable:
        return fine(AREA, f"interfaces with multicast: {', '.join(usable)}")
    return warning(
        AREA,
        "no network interface is up and has multicast: other computers are not found",
        "bring one up ('ip link set <name> up multicast on'), or name the other computers in"
        " ROS_STATIC_PEERS",
    )


def _reaches_others(flags_file: Path) -> bool:
    try:
        flags = int(flags_file.read_text(encoding="ascii"), 16)
    except (OSError, ValueError):
        return False
    return bool(flags & _UP and flags & _MULTICAST and not flags & _LOOPBACK)


def _multicast() -> Finding:
    """Send a datagram to the group of DDS discovery and see whether it comes back."""
    try:
        arrived = _probe()
    except OSError as problem:
        return _no_multicast(f"multicast does not work here: {problem.strerror or problem}")
    if arrived:
        return fine(AREA, "multicast works on this computer")
    return _no_multicast(f"a multicast datagram did not come back within {_PROBE_S:g} s")


def _no_multicast(message: str) -> Finding:
    return warning(
        AREA,
        message,
        "let UDP to 239.255.0.1 through the firewall ('ufw allow in proto udp to 224.0.0.0/4'),"
        " or set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST or ROS_STATIC_PEERS",
    )


def _probe() -> bool:
    content = os.urandom(16)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind(("", 0))
        membership = socket.inet_aton(_GROUP) + socket.inet_aton("0.0.0.0")  # noqa: S104 - any
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        receiver.settimeout(_PROBE_S)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.sendto(content, (_GROUP, receiver.getsockname()[1]))
        try:
            return receiver.recv(len(content)) == content
        except TimeoutError:
            return False


def _space(folder: Path) -> Finding:
    free_bytes = shutil.disk_usage(folder).free
    if free_bytes >= _LEAST_SHARED_MEMORY_BYTES:
        return fine(AREA, f"shared memory: {free_bytes / _MEGABYTE:.0f} MB free in {folder}")
    return warning(
        AREA,
        f"shared memory: only {free_bytes / _MEGABYTE:.1f} MB free in {folder}",
        "give the container more (docker run --shm-size=1g), remove leftovers"
        " ('fastdds shm clean'), or set FASTDDS_BUILTIN_TRANSPORTS=UDPv4",
    )


def _leftovers(folder: Path) -> Iterator[Finding]:
    """Count segments of killed processes: Fast DDS locks the files of those that live."""
    dead = [path for path in sorted(folder.glob("fastrtps_*_el")) if _is_unlocked(path)]
    if dead:
        yield note(
            AREA,
            f"{len(dead)} shared memory segment{'s' if len(dead) > 1 else ''} of processes that"
            " were killed: Fast DDS complains about them",
            "run 'fastdds shm clean'",
        )


def _is_unlocked(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            # A shared lock: it hinders nobody who is just starting from sharing it.
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
