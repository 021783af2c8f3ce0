"""The network addresses of this computer, and what listens on UDP ports."""

from __future__ import annotations

import errno
import ipaddress
import socket
from enum import Enum

_REFUSED_WITHIN_S = 0.3


class PortState(Enum):
    """What is known of a UDP port."""

    FREE = "free"  # of this computer, and nothing listens
    IN_USE = "in use"  # of this computer
    REFUSED = "refused"  # of another one, which says that nothing listens
    UNREACHABLE = "unreachable"  # there is no route, or the computer does not answer
    UNKNOWN = "unknown"  # of another one: UDP does not say that something listens


def resolve(host: str) -> str | None:
    """Return the IPv4 address of a host; None if its name cannot be resolved."""
    try:
        found = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
    except (OSError, UnicodeError):
        return None
    return str(found[0][4][0])


def is_own_address(address: str) -> bool:
    """Return whether this computer has an IPv4 address."""
    return _bind(address, 0) is None


def is_this_computer(address: str) -> bool:
    """Return whether ``address``, a name or an IP address, belongs to this computer.

    Names are only compared: a name server may take long to respond.
    """
    try:
        literal = ipaddress.ip_address(address)
    except ValueError:
        return address in ("localhost", socket.gethostname())
    family = socket.AF_INET if literal.version == 4 else socket.AF_INET6
    return _bind(address, 0, family) is None


def interface_names() -> list[str]:
    """Return the names of the network interfaces."""
    return sorted(name for _, name in socket.if_nameindex())


def has_interface(text: str) -> bool:
    """Return whether there is a network interface with this name or IPv4 address."""
    return text in interface_names() or (text[:1].isdigit() and is_own_address(text))


def port_state(address: str, port: int) -> PortState:
    """Return what is known of a UDP port.

    For another computer, an empty datagram is sent to it.
    """
    problem = _bind(address, port)
    if problem is None:
        return PortState.FREE
    if problem != errno.EADDRNOTAVAIL:
        return PortState.IN_USE
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.settimeout(_REFUSED_WITHIN_S)
        try:
            probe.connect((address, port))
            probe.send(b"")
            probe.recv(1)
        except ConnectionRefusedError:
            return PortState.REFUSED
        except TimeoutError:
            return PortState.UNKNOWN
        except OSError:
            return PortState.UNREACHABLE
    return PortState.UNKNOWN


def _bind(address: str, port: int, family: int = socket.AF_INET) -> int | None:
    """Return why a UDP socket cannot be bound, as a number of errno; None if it can."""
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, port))
        except OSError as problem:
            return problem.errno or errno.EADDRNOTAVAIL
    return None
