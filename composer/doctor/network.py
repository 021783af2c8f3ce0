"""The network as used by DDS: interfaces, multicast and shared memory."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from pathlib import Path

from composer.doctor.result import CheckResult, note, ok, warning
from composer.runtime.middleware.shared_memory import (
    LARGE_SEGMENT_BYTES,
    MEGABYTE,
    MIN_FREE_BYTES,
    SHARED_MEMORY,
    free_bytes,
)

AREA = "network"
#: The flags of net/if.h.
_UP, _LOOPBACK, _MULTICAST = 0x1, 0x8, 0x1000
#: The multicast group of DDS discovery. See the DDS Interoperability Protocol, 9.6.1.4.
_GROUP = "239.255.0.1"
_PROBE_S = 0.5


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
        yield _check_interfaces(devices)
        yield _check_multicast()
    if shared_memory is not None and shared_memory.is_dir():
        yield _check_free_space(shared_memory)
        yield from _check_leftovers(shared_memory)


def _check_interfaces(devices: Path) -> CheckResult:
    usable = sorted(device.name for device in devices.glob("*") if _is_usable(device / "flags"))
    if usable:
        return ok(AREA, f"interfaces with multicast: {', '.join(usable)}")
    return warning(
        AREA,
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
        return ok(AREA, "multicast works on this computer")
    return _no_multicast(f"a multicast datagram did not arrive within {_PROBE_S:g} s")


def _no_multicast(message: str) -> CheckResult:
    return warning(
        AREA,
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
        membership = socket.inet_aton(_GROUP) + socket.inet_aton("0.0.0.0")  # noqa: S104 - any
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        receiver.settimeout(_PROBE_S)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.sendto(content, (_GROUP, receiver.getsockname()[1]))
        try:
            return receiver.recv(len(content)) == content
        except TimeoutError:
            return False


def _check_free_space(folder: Path) -> CheckResult:
    free = free_bytes(folder)
    if free >= MIN_FREE_BYTES:
        return ok(AREA, f"shared memory: {free / MEGABYTE:.0f} MB free in {folder}")
    return warning(
        AREA,
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
            AREA,
            f"{len(dead)} shared memory segment{'s' if len(dead) > 1 else ''} of killed processes:"
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
