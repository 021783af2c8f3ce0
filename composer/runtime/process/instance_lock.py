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
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from composer.runtime.process import StartRefused

_DEFAULT_DOMAIN = "0"
_SUFFIX = ".lock"
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def already_running(name: str, host: str, pid: str | int) -> StartRefused:
    """Return the error for a system that runs already. ``name`` is its manager's namespace."""
    system = name if name.count("/") > 1 else name.removeprefix("/")
    return StartRefused(
        f"system '{system}' already runs in ROS domain {_domain()}: host {host}, process {pid}",
        f"stop it with 'compose down {system}', or set another ROS_DOMAIN_ID or --namespace",
    )


@contextmanager
def hold_instance_lock(name: str) -> Iterator[None]:
    """Hold the instance lock of a system; ``name`` is the namespace of its manager.

    The operating system releases it however the process ends. Raises StartRefused.
    """
    lock = _open(name)
    if lock is None:
        yield
        return
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            host, pid = _holder(lock)
            raise already_running(name, host, pid) from error
        lock.seek(0)
        lock.truncate()
        json.dump({"host": socket.gethostname(), "pid": os.getpid()}, lock)
        lock.flush()
        yield


def local_systems() -> dict[str, str]:
    """Return the process ids of this user's systems on this host and in this domain, by name.

    Unlike discovery, which may take seconds, this is complete at once.
    """
    pids: dict[str, str] = {}
    prefix = f"{_domain()}."
    for file_name in _lock_files():
        if not (file_name.startswith(prefix) and file_name.endswith(_SUFFIX)):
            continue
        name = "/" + file_name.removeprefix(prefix).removesuffix(_SUFFIX).replace(".", "/")
        lock = _open(name)
        if lock is None:
            continue
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                pids[name] = _holder(lock)[1]
    return pids


def socket_path(name: str) -> Path | None:
    """Return the path of the Unix socket of a system, next to its lock file.

    None if there is no folder that only this user can write to.
    """
    try:
        with _open_folder():
            return _folder() / _file_name(name, ".sock")
    except (OSError, StartRefused):
        return None


def _domain() -> str:
    return os.environ.get("ROS_DOMAIN_ID") or _DEFAULT_DOMAIN


def _folder() -> Path:
    parent = os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()
    return Path(parent, f"ros2-composer-{os.geteuid()}")


@contextmanager
def _open_folder() -> Iterator[int]:
    """Open the folder of the lock files, which is created if needed. Raises OSError, StartRefused.

    Every user can write to the folder of temporary files and may have created another folder, or a
    symbolic link, of that name.
    """
    folder = _folder()
    folder.mkdir(mode=0o700, exist_ok=True)
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
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


def _lock_files() -> list[str]:
    """Return the names of the lock files, sorted; none if the folder is not safe."""
    try:
        with _open_folder() as folder, os.scandir(folder) as entries:
            return sorted(entry.name for entry in entries)
    except (OSError, StartRefused):
        return []


def _file_name(name: str, suffix: str) -> str:
    return f"{_domain()}{name.replace('/', '.')}{suffix}"


def _open(name: str) -> TextIO | None:
    """Open the lock file of a system; None if there cannot be one, and thus no lock.

    Raises StartRefused if other users can write to the folder of the lock files.
    """
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        return None  # no process discovers another one
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        with _open_folder() as folder:
            descriptor = os.open(_file_name(name, _SUFFIX), flags, 0o600, dir_fd=folder)
    except OSError:
        if _folder().is_symlink():
            raise _unsafe(_folder()) from None
        return None
    return os.fdopen(descriptor, "r+", encoding="utf-8")


def _holder(lock: TextIO) -> tuple[str, str]:
    """Return the host and the process id in a lock file."""
    try:
        holder = json.load(lock)
        return str(holder["host"]), str(holder["pid"])
    except (ValueError, KeyError, TypeError):
        return socket.gethostname(), "unknown"  # it is being written
