"""The DDS participants on this host, by their sockets, and those that have ended.

DDS does not report when discovery is complete. But each participant holds a UDP port, whose number
follows from its domain and index, and Linux lists the ports in use: as long as there are more of
them than discovered participants, some are missing. See 'Discovery traffic' in the DDSI-RTPS
specification, 9.6.1.1, for the numbers.

DDS lists participants of killed processes until their lease ends, for 20 s. A process that was
started again in that time has the same nodes, and all of them would be listed twice.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Set
from pathlib import Path

#: The ports of all IPv4 sockets in this network namespace; proc_net(5).
_TABLE = Path("/proc/net/udp")
_BASE_PORT = 7400
_PORTS_OF_A_DOMAIN = 250
_FIRST_PARTICIPANT = 10
_PORTS_OF_A_PARTICIPANT = 2
#: Enough for announcements of some thousands of endpoints; Linux may limit it to less.
_RECEIVE_BUFFER_BYTES = 4_194_304


def count_participants(domain_id: int, table: Path = _TABLE) -> int:
    """Return the number of participants of a domain on this host, including this process.

    0 if unknown, as on systems other than Linux.
    """
    try:
        rows = table.read_text(encoding="ascii").splitlines()[1:]
    except OSError:
        return 0
    ports = {int(row.split()[1].rpartition(":")[2], 16) for row in rows if row.strip()}
    unicast = ports_of_domain(domain_id)[_FIRST_PARTICIPANT::_PORTS_OF_A_PARTICIPANT]
    return len(ports.intersection(unicast))


def ports_of_domain(domain_id: int) -> range:
    """Return the ports that the participants of a domain may use."""
    first = _BASE_PORT + _PORTS_OF_A_DOMAIN * domain_id
    return range(first, first + _PORTS_OF_A_DOMAIN)


def enlarge_receive_buffers() -> None:
    """Enlarge the receive buffers of the UDP sockets of this process.

    By default they hold about 80 packets. A system of three nodes announces its endpoints with more
    within a millisecond, and those that do not fit are announced again up to a second later.
    """
    for number in _open_sockets():
        try:
            with socket.socket(fileno=os.dup(number)) as udp_socket:
                if (udp_socket.family, udp_socket.type) == (socket.AF_INET, socket.SOCK_DGRAM):
                    udp_socket.setsockopt(
                        socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES
                    )
        except OSError:  # closed in the meantime
            continue


def _open_sockets() -> list[int]:
    """Return the file descriptors of the open sockets of this process."""
    folder = Path("/proc/self/fd")
    if not folder.is_dir():
        return []
    return [int(path.name) for path in folder.iterdir() if path.is_socket()]


#: The prefix of a participant of Fast DDS: its vendor, the computer, and the lower half of the
#: process id, with the lowest byte first.
_FAST_DDS = b"\x01\x0f"
_HOST, _PROCESS = slice(2, 4), slice(4, 6)
_LOWER_HALF = 0xFFFF


def ended_participants(known: Set[bytes], domain_id: int) -> frozenset[bytes]:
    """Return which of the ``known`` participants have ended, by their prefixes.

    None unless that is certain. Processes of containers have process ids of their own, but their
    participants hold ports of this computer: the remaining ones must be as many as these.
    """
    own = [prefix for prefix in known if _process(prefix) == os.getpid() & _LOWER_HALF]
    hosts = {prefix[_HOST] for prefix in own}
    local = {prefix for prefix in known if prefix[_HOST] in hosts}
    running = {int(path.name) & _LOWER_HALF for path in Path("/proc").glob("[0-9]*")}
    ended = {prefix for prefix in local if _process(prefix) not in running}
    is_certain = len(local) - len(ended) == count_participants(domain_id)
    return frozenset(ended) if is_certain else frozenset()


def is_in_group(prefix: bytes, leader: int) -> bool:
    """Return whether a participant is in a process of the group that ``leader`` leads."""
    return _process(prefix) in {
        pid & _LOWER_HALF
        for pid in (int(path.name) for path in Path("/proc").glob("[0-9]*"))
        if _group(pid) == leader
    }


def _group(pid: int) -> int | None:
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return None


def _process(prefix: bytes) -> int | None:
    """Return the lower half of the id of the process of a participant, None if unknown."""
    is_known = prefix.startswith(_FAST_DDS)
    return int.from_bytes(prefix[_PROCESS], "little") if is_known else None
