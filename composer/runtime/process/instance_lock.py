"""The instance lock: one process per system and ROS domain.

On one host, a lock file ensures that before anything starts. Processes on other hosts are detected
by the manager node (:mod:`composer.runtime.manager.other_instances`).
"""

from __future__ import annotations

import fcntl
import json
import os
import socket
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from composer.runtime.clock import COMPUTER
from composer.runtime.process import StartRefused

#: The key of the reports of a process that the coordinating process of its system starts. Such a
#: process ends with ``ALREADY_RUNS``, and says nothing, if another one holds its instance lock.
REPORT_KEY_VARIABLE = "COMPOSE_REPORT_KEY"
ALREADY_RUNS = 75  # EX_TEMPFAIL of sysexits.h
#: The name of the folder of the lock files.
FOLDER_NAME = f"ros2-composer-{os.geteuid()}"
#: Services, cron jobs and shells of the same user have this folder in common.
COMMON_FOLDER = "/tmp"  # noqa: S108 - the folder in it belongs to the user, or is refused
#: The folders of login sessions. Services do not have one, and it ends with the last session.
_SESSIONS = "/run/user/"
_DEFAULT_DOMAIN = "0"
_SUFFIX = ".lock"
#: A process that only looks whether a system runs shares its lock for some microseconds, on a busy
#: computer for longer.
_LOOKED_AT_WITHIN_S = 5.0
#: A process that has just started writes who it is.
_WRITTEN_WITHIN_S = 0.05
_POLL_S = 0.005
_OPEN_LOCK = os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


class AlreadyRunning(StartRefused):
    """Another process runs the system."""


def already_running(name: str, host: str, pid: str | int) -> AlreadyRunning:
    """Return the error for a system that runs already. ``name`` is its manager's namespace."""
    system = name if name.count("/") > 1 else name.removeprefix("/")
    return AlreadyRunning(
        f"system '{system}' already runs in ROS domain {_domain()}: host {host}, process {pid}",
        f"stop it with 'compose down {system}', or set another ROS_DOMAIN_ID or --namespace",
    )


@contextmanager
def hold_instance_lock(
    name: str, discovery: Mapping[str, str] | None = None, report_key: str = ""
) -> Iterator[None]:
    """Hold the instance lock of a system; ``name`` is the namespace of its manager.

    Commands on this computer use the variables in ``discovery`` to discover the system. Processes
    of the same user learn ``report_key`` by :func:`report_key`. The operating system releases the
    lock however the process ends. Raises StartRefused and AlreadyRunning.
    """
    lock = _open(name)
    if lock is None:
        yield
        return
    with lock, _kept_folder():
        start_s = COMPUTER.monotonic()
        while not _is_locked(lock, fcntl.LOCK_EX):
            is_shared = _is_locked(lock, fcntl.LOCK_SH)
            limit_s = _LOOKED_AT_WITHIN_S if is_shared else _WRITTEN_WITHIN_S
            if COMPUTER.monotonic() - start_s > limit_s:
                holder = _holder(lock)
                raise already_running(name, holder["host"], holder["pid"])
            fcntl.flock(lock, fcntl.LOCK_UN)
            COMPUTER.sleep(_POLL_S)
        lock.seek(0)
        lock.truncate()
        holder = {
            "host": socket.gethostname(),
            "pid": os.getpid(),
            "discovery": discovery or {},
            "report_key": report_key,
        }
        json.dump(holder, lock)
        lock.flush()
        yield


def local_systems() -> dict[str, str]:
    """Return the process ids of this user's systems on this host and in this domain, by name.

    Unlike discovery, which may take seconds, this is complete at once.
    """
    return {name: str(holder["pid"]) for name, holder in _holders()}


def local_discovery() -> dict[str, dict[str, str]]:
    """Return the variables with which the systems of :func:`local_systems` are discovered."""
    return {
        name: {str(key): str(value) for key, value in found.items()}
        for name, holder in _holders()
        if isinstance(found := holder.get("discovery", {}), dict)
    }


def _holders() -> list[tuple[str, dict[str, Any]]]:
    """Return the name and the holder of each lock that is held, sorted by name.

    There is none if the folder is not safe.
    """
    prefix = f"{_domain()}."
    if _is_without_locks():
        return []
    found = []
    try:
        with _open_folder() as folder:
            names = os.listdir(folder)  # noqa: PTH208 - may be thousands
            ours = [name for name in names if name.startswith(prefix) and name.endswith(_SUFFIX)]
            for file_name in sorted(ours):
                holder = _holder_in(folder, file_name)
                if holder is not None:
                    name = file_name.removeprefix(prefix).removesuffix(_SUFFIX)
                    found.append((f"/{name.replace('.', '/')}", holder))
    except (OSError, StartRefused):
        return []
    return found


def _holder_in(folder: int, file_name: str) -> dict[str, Any] | None:
    """Return the holder of a lock file in an open folder, None if its lock is not held."""
    try:
        descriptor = os.open(file_name, _OPEN_LOCK, dir_fd=folder)
    except OSError:
        return None
    try:
        if _is_locked(descriptor, fcntl.LOCK_SH):
            return None
        with os.fdopen(descriptor, encoding="utf-8", closefd=False) as lock:
            return _holder(lock)
    finally:
        os.close(descriptor)


def is_held(name: str) -> bool:
    """Return whether a process on this host holds the instance lock of a system."""
    return _holder_of(name) is not None


def report_key(name: str) -> str | None:
    """Return the key of the reports of the process that holds an instance lock, None without one.

    It is empty while the process writes it.
    """
    holder = _holder_of(name)
    return None if holder is None else str(holder.get("report_key", ""))


def _holder_of(name: str) -> dict[str, Any] | None:
    """Return the holder of the instance lock of a system, None if it is not held."""
    if _is_without_locks():
        return None
    try:
        with _open_folder() as folder:
            return _holder_in(folder, _file_name(name, _SUFFIX))
    except (OSError, StartRefused):
        return None


def socket_path(name: str) -> Path | None:
    """Return the path of the Unix socket of a system, next to its lock file.

    None if there is no folder that only this user can write to.
    """
    return private_path(_file_name(name, ".sock"))


def goals_path(name: str) -> Path | None:
    """Return the path of the file with the goals of a system; see :func:`socket_path`."""
    return private_path(_file_name(name, ".goals"))


def private_path(file_name: str) -> Path | None:
    """Return the path of a file in the folder of the lock files; see :func:`socket_path`."""
    try:
        with _open_folder():
            return _folder() / file_name
    except (OSError, StartRefused):
        return None


def open_private(file_name: str) -> TextIO:
    """Open a file in the folder of the lock files, to read and write; both are created if needed.

    Raises OSError, and StartRefused if other users can write to the folder.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
    with _open_folder() as folder:
        descriptor = os.open(file_name, flags, 0o600, dir_fd=folder)
    return os.fdopen(descriptor, "r+", encoding="utf-8")


def _is_locked(lock: TextIO | int, kind: int) -> bool:
    """Lock the file until it is closed; return False if another process has locked it."""
    try:
        fcntl.flock(lock, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _domain() -> str:
    return os.environ.get("ROS_DOMAIN_ID") or _DEFAULT_DOMAIN


def _folder() -> Path:
    chosen = os.environ.get("XDG_RUNTIME_DIR", "")
    parent = COMMON_FOLDER if chosen.startswith(_SESSIONS) else chosen or COMMON_FOLDER
    return Path(parent, FOLDER_NAME)


@contextmanager
def _kept_folder() -> Iterator[None]:
    """Keep the folder of the lock files: systemd-tmpfiles removes old files unless it is locked."""
    with _open_folder() as folder:
        with suppress(OSError):  # not on every file system
            fcntl.flock(folder, fcntl.LOCK_SH)
        yield


@contextmanager
def _open_folder() -> Iterator[int]:
    """Open the folder of the lock files, which is created if needed. Raises OSError, StartRefused.

    Every user can write to the folder of temporary files and may have created another folder, or a
    symbolic link, of that name.
    """
    folder = _folder()
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        descriptor = os.open(folder, flags)
    except FileNotFoundError:
        folder.mkdir(mode=0o700, exist_ok=True)
        descriptor = os.open(folder, flags)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != os.geteuid() or status.st_mode & _WRITABLE_BY_OTHERS:
            raise _unsafe(folder)
        yield descriptor
    finally:
        os.close(descriptor)


def _unsafe(folder: Path) -> StartRefused:
    return StartRefused(
        f"other users can write to '{folder}', the folder for instance locks",
        "remove it, or set XDG_RUNTIME_DIR to a folder that only you can write to",
    )


def _file_name(name: str, suffix: str) -> str:
    return f"{_domain()}{name.replace('/', '.')}{suffix}"


def _open(name: str) -> TextIO | None:
    """Open the lock file of a system; None if there cannot be one, and thus no lock.

    Raises StartRefused if other users can write to the folder of the lock files.
    """
    if _is_without_locks():
        return None
    try:
        return open_private(_file_name(name, _SUFFIX))
    except OSError:
        if _folder().is_symlink():
            raise _unsafe(_folder()) from None
        return None


def _is_without_locks() -> bool:
    """Return whether no process discovers another one."""
    return os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF"


def _holder(lock: TextIO) -> dict[str, Any]:
    """Return what a lock file says: the host, the process id and the discovery of the system."""
    try:
        holder = json.load(lock)
        return {**holder, "host": str(holder["host"]), "pid": str(holder["pid"])}
    except (ValueError, KeyError, TypeError):
        return {"host": socket.gethostname(), "pid": "unknown"}  # it is being written
