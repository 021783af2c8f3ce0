"""The DDS participants on this computer by their sockets: how many there are, what ours can hold.

Discovery tells nobody when it is complete. But each participant holds a UDP port that says its
domain and its index there, and Linux tells which ports are held: as long as there are more of them
than participants that were met, somebody is missing. See 'Discovery traffic' in the DDSI-RTPS
specification, 9.6.1.1, for the numbers.
"""

from __future__ import annotations

import os
import socket
from pathlib import Path

#: The ports of all IPv4 sockets in this network namespace; proc_net(5).
_TABLE = Path("/proc/net/udp")
_BASE_PORT = 7400
_PORTS_OF_A_DOMAIN = 250
_FIRST_PARTICIPANT = 10
_PORTS_OF_A_PARTICIPANT = 2
#: Enough for what some thousands of endpoints announce; Linux gives less where it may not be more.
_ROOM_BYTES = 4_194_304


def count_participants(domain_id: int, table: Path = _TABLE) -> int:
    """Return how many participants of a domain hold a port here, this process included.

    0 where nobody tells, as on other systems than Linux.
    """
    try:
        rows = table.read_text(encoding="ascii").splitlines()[1:]
    except OSError:
        return 0
    ports = {int(row.split()[1].rpartition(":")[2], 16) for row in rows if row.strip()}
    first = _BASE_PORT + _PORTS_OF_A_DOMAIN * domain_id + _FIRST_PARTICIPANT
    last = first - _FIRST_PARTICIPANT + _PORTS_OF_A_DOMAIN
    return len(ports.intersection(range(first, last, _PORTS_OF_A_PARTICIPANT)))


def enlarge_receive_buffers() -> None:
    """Let the UDP sockets of this process hold all that others announce to it at once.

    By default they hold some 80 packets. A system of three nodes announces its endpoints with more,
    within a millisecond, and what finds no room is announced again up to a second later.
    """
    for number in _open_sockets():
        try:
            with socket.socket(fileno=os.dup(number)) as end:
                if (end.family, end.type) == (socket.AF_INET, socket.SOCK_DGRAM):
                    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM_BYTES)
        except OSError:  # closed meanwhile
            continue


def _open_sockets() -> list[int]:
    """Return the numbers of the sockets that are open in this process."""
    folder = Path("/proc/self/fd")
    if not folder.is_dir():
        return []
    return [int(path.name) for path in folder.iterdir() if path.is_socket()]
