"""UDP ports and shared memory that DDS participants hold on this computer, also killed ones.

DDS does not report when discovery is complete. But each participant holds a UDP port, whose number
follows from its domain and index, and Linux lists the ports in use: as long as there are more of
them than discovered participants, some are missing. See 'Discovery traffic' in the DDSI-RTPS
specification, 9.6.1.1, for the numbers.

DDS lists participants of killed processes until their lease ends, for 20 s. A process that was
started again in that time has the same nodes, and all of them would be listed twice.

Fast DDS opens or creates a shared memory segment for each port. If a process is killed between
creating and filling it, every later participant that opens it waits in its constructor forever,
without reacting to signals: see boost/interprocess/detail/managed_open_or_create_impl.hpp. A FIFO
of that name has the same effect. Every local user can create such files, so owner and type of each
are checked, and only segments of this user are removed.

A process also has a segment for its messages, and locks a file next to it until it ends. Nothing
else removes the segment of a killed one: each kill would take 0.5 or 16 MB until the next boot.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import socket
import stat
from collections.abc import Set
from contextlib import suppress
from pathlib import Path

from composer.runtime.clock import COMPUTER
from composer.runtime.process import StartRefused

#: The ports of all IPv4 sockets in this network namespace; proc_net(5).
_TABLE = Path("/proc/net/udp")
_BASE_PORT = 7400
_PORTS_OF_A_DOMAIN = 250
_FIRST_PARTICIPANT = 10
_PORTS_OF_A_PARTICIPANT = 2
#: Enough for announcements of some thousands of endpoints; Linux may limit it to less.
_RECEIVE_BUFFER_BYTES = 4_194_304
#: The prefix of a participant of Fast DDS: its vendor, the computer, and the lower half of the
#: process id, with the lowest byte first.
_FAST_DDS = b"\x01\x0f"
_HOST, _PROCESS = slice(2, 4), slice(4, 6)
_LOWER_HALF = 0xFFFF
#: Where Linux keeps it; shm_open(3).
SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - nothing is written there
MEGABYTE = 1024 * 1024
#: The segment of a process that sends large messages; otherwise it is 0.5 MB.
LARGE_SEGMENT_BYTES = 16 * MEGABYTE
#: Such a process needs that much: its other segments, and those of other processes, take the rest.
MIN_FREE_BYTES = 2 * LARGE_SEGMENT_BYTES
_PORT = re.compile(r"fastrtps_port(\d{1,9})", re.ASCII)
_SEGMENT = re.compile(r"fastrtps_[0-9a-f]{16}", re.ASCII)
_LOCK = "_el"  # the end of the name of its lock file
#: A process locks the file right after it has created it.
_LOCKED_WITHIN_S = 10.0
#: As shm_open(3) opens it for a participant, and without waiting for the other end of a FIFO.
_OPEN = os.O_RDWR | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC
#: The first word of a segment: uninitialized, initializing. 2 means initialized.
_UNFINISHED = (0, 1)
_WORD_BYTES = 4
#: Filling a segment takes microseconds: after this time, its process was killed.
_FILLED_WITHIN_S = 1.0
_POLL_S = 0.02


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


def remove_incomplete_ports(domain_id: int, folder: Path = SHARED_MEMORY) -> None:
    """Remove the segments of this user that would hang a new participant.

    Wait up to a second for segments that a process may be filling. Raises StartRefused if one in
    the domain would hang a participant and is not a segment of this user.
    """
    ports = ports_of_domain(domain_id)
    for port in filter(None, map(_PORT.fullmatch, _names(folder))):
        path = folder / port[0]
        status = _status(path)
        if status is None:
            continue
        removable = stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
        if (removable or int(port[1]) in ports) and _stays_incomplete(path):
            if not removable:
                raise _refusal(path, _description(status))
            _remove(path)


def remove_dead_segments(folder: Path = SHARED_MEMORY) -> None:
    """Remove the segments of this user whose processes were killed."""
    for name in filter(_SEGMENT.fullmatch, _names(folder)):
        lock = folder / f"{name}{_LOCK}"
        with suppress(OSError), os.fdopen(os.open(lock, _OPEN), "rb", buffering=0) as file:
            status = os.fstat(file.fileno())
            is_own = stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
            if is_own and COMPUTER.time() - status.st_mtime >= _LOCKED_WITHIN_S:
                # Raises BlockingIOError while the process lives.
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                (folder / name).unlink(missing_ok=True)
                lock.unlink()


def free_bytes(folder: Path = SHARED_MEMORY) -> int:
    """Return how much shared memory is free; 0 if there is none."""
    return shutil.disk_usage(folder).free if folder.is_dir() else 0


def _names(folder: Path) -> list[str]:
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        return sorted(entry.name for entry in entries)


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.lstat()
    except OSError:  # removed in the meantime
        return None


def _stays_incomplete(path: Path) -> bool:
    until_s = COMPUTER.monotonic() + _FILLED_WITHIN_S
    while (changed_s := _incomplete_since_s(path)) is not None:
        # The clock of files may jump; the monotonic one limits the wait.
        if COMPUTER.time() - changed_s >= _FILLED_WITHIN_S or COMPUTER.monotonic() >= until_s:
            return True
        COMPUTER.sleep(_POLL_S)
    return False


def _incomplete_since_s(path: Path) -> float | None:
    """Return when the file was last changed if a participant would wait for it, else None."""
    try:
        descriptor = os.open(path, _OPEN)
    except OSError:
        return None  # removed, or a participant cannot open it either
    with os.fdopen(descriptor, "rb", buffering=0) as segment:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            return 0.0  # it is never filled
        word = segment.read(_WORD_BYTES)
    if len(word) < _WORD_BYTES or int.from_bytes(word, "little") in _UNFINISHED:
        return status.st_mtime
    return None


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as problem:
        raise _refusal(path, f"it cannot be removed: {problem.strerror}") from problem


def _refusal(path: Path, why: str) -> StartRefused:
    return StartRefused(
        f"{path} would hang this process: {why}",
        f"remove {path}, or set another ROS_DOMAIN_ID",
    )


def _description(status: os.stat_result) -> str:
    """Describe a file that is not a segment of this user."""
    kind = "incomplete shared memory of Fast DDS"
    if not stat.S_ISREG(status.st_mode):
        kind = "not shared memory, but named like a port of Fast DDS"
    return f"it is {kind} (owner: user {status.st_uid})"
