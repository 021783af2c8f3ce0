"""What Linux says about this computer: its addresses and UDP ports, and what processes use."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
from enum import Enum

from composer.base.fast_dataclass import dataclass
from composer.runtime.clock import COMPUTER

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


_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MB = 1e6
_MAX_BYTES = 4096  # more than it can be
#: Fields of /proc/PID/stat after the name of the command; see proc(5).
_UTIME, _STIME, _THREADS, _STARTED, _RSS = 11, 12, 17, 19, 21


@dataclass(frozen=True, slots=True)
class ProcessUsage:
    """What a process has used until ``at_s`` of the monotonic clock; ``up_s`` is its age."""

    at_s: float
    cpu_s: float
    memory_mb: float
    threads: int
    up_s: float


def process_usage(pid: str) -> ProcessUsage | None:
    """Return the usage of a process, or of this one for ``self``; None if it cannot be read."""
    try:
        descriptor = os.open(f"/proc/{pid}/stat", os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        text = os.read(descriptor, _MAX_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return None
    finally:
        os.close(descriptor)
    values = text.rpartition(")")[2].split()
    return ProcessUsage(
        at_s=COMPUTER.monotonic(),
        cpu_s=(int(values[_UTIME]) + int(values[_STIME])) / _TICKS_PER_S,
        memory_mb=int(values[_RSS]) * _PAGE_BYTES / _MB,
        threads=int(values[_THREADS]),
        up_s=COMPUTER.since_boot_s() - int(values[_STARTED]) / _TICKS_PER_S,
    )


def process_start_s() -> float:
    """Return when this process started, by the monotonic clock; now if that cannot be read.

    Python may have been started again in it, as by the ROS wheels. Linux counts steps of 10 ms.
    """
    usage = process_usage("self")
    return COMPUTER.monotonic() - (0.0 if usage is None else max(0.0, usage.up_s))
