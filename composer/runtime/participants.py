"""How many DDS participants there are on this computer, met or not.

Discovery tells nobody when it is complete. But each participant holds a UDP port that says its
domain and its index there, and Linux tells which ports are held: as long as there are more of them
than participants that were met, somebody is missing. See 'Discovery traffic' in the DDSI-RTPS
specification, 9.6.1.1, for the numbers.
"""

from __future__ import annotations

from pathlib import Path

#: The ports of all IPv4 sockets in this network namespace; proc_net(5).
_TABLE = Path("/proc/net/udp")
_BASE_PORT = 7400
_PORTS_OF_A_DOMAIN = 250
_FIRST_PARTICIPANT = 10
_PORTS_OF_A_PARTICIPANT = 2


def participants_here(domain_id: int, table: Path = _TABLE) -> int:
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
