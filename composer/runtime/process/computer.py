"""What Linux says about this computer: addresses, UDP ports, what processes use and may use.

What they may use are CPUs, priorities and memory, as the system declares them.
"""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
import sys
from collections.abc import Iterable, Iterator
from enum import Enum

from composer.base.fast_dataclass import dataclass
from composer.model import Executor, Process
from composer.runtime.clock import COMPUTER

_REFUSED_WITHIN_S = 0.3
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_MB = 1e6
_MAX_BYTES = 4096  # more than it can be
#: Fields of /proc/PID/stat after the name of the command; see proc(5).
_UTIME, _STIME, _THREADS, _STARTED, _RSS = 11, 12, 17, 19, 21
_PRIORITY_HINT = (
    "it is allowed to root, with CAP_SYS_NICE, or up to the 'rtprio' of the user in"
    " /etc/security/limits.conf"
)
#: Python's default is 5 ms.
_SWITCH_INTERVAL_S = 0.001


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


def switch_threads_sooner() -> None:
    """Let a thread wait less for the interpreter while another one computes.

    A shorter interval that is set already is kept.
    See docs/decisions/0007-event-driven-executor.md.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL_S))


def memory_excess(process: Process) -> str | None:
    """Return why this process uses too much memory, or None."""
    limit = process.memory_mb
    if limit is None:
        return None
    usage = process_usage("self")
    if usage is None or usage.memory_mb <= limit.value:
        return None
    used = f"process '{process.name}' uses {usage.memory_mb:.0f} MB of memory"
    return f"{used}, more than {limit.value:g} MB"


def place_threads(
    settings: Executor | Process, native_thread_ids: Iterable[int] = (0,)
) -> tuple[str, ...]:
    """Apply CPUs and a priority to threads of this process, by their Linux ids.

    By default, to the calling thread, and so to all that it starts. Returns a message for each
    request that Linux refuses; the threads run nevertheless.
    """
    ids = tuple(native_thread_ids)
    return tuple(dict.fromkeys((*_set_cpus(settings, ids), *_set_priority(settings, ids))))


def _set_cpus(settings: Executor | Process, native_thread_ids: Iterable[int]) -> Iterator[str]:
    if not settings.cpus:
        return
    for thread_id in native_thread_ids:
        try:
            os.sched_setaffinity(thread_id, settings.cpus)
        except OSError as error:
            allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
            desired = ", ".join(map(str, settings.cpus))
            yield (
                f"executor '{settings.name}' cannot run on CPU {desired}: {error.strerror};"
                f" this process may use {allowed}"
            )


def _set_priority(settings: Executor | Process, native_thread_ids: Iterable[int]) -> Iterator[str]:
    if settings.priority is None:
        return
    for thread_id in native_thread_ids:
        try:
            os.sched_setscheduler(thread_id, os.SCHED_FIFO, os.sched_param(settings.priority))
        except OSError as error:
            yield (
                f"executor '{settings.name}' cannot have real-time priority {settings.priority}:"
                f" {error.strerror}; {_PRIORITY_HINT}"
            )
