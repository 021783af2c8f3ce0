"""The instance lock: one process per system and ROS domain.

On one host, a lock file ensures that before anything starts. Processes on other hosts are detected
by the manager node (:mod:`composer.runtime.manager.other_instances`).
"""

from __future__ import annotations

import fcntl
import json
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from composer.runtime.process import StartRefused

_DEFAULT_DOMAIN = "0"
_SUFFIX = ".lock"


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
    for path in sorted(_folder().glob(f"{prefix}*{_SUFFIX}")):
        name = "/" + path.name.removeprefix(prefix).removesuffix(_SUFFIX).replace(".", "/")
        lock = _open(name)
        if lock is None:
            continue
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                pids[name] = _holder(lock)[1]
    return pids


def socket_path(name: str) -> Path:
    """Return the path of the Unix socket of a system, next to its lock file."""
    return _path(name, ".sock")


def _domain() -> str:
    return os.environ.get("ROS_DOMAIN_ID") or _DEFAULT_DOMAIN


def _folder() -> Path:
    parent = os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()
    return Path(parent, f"ros2-composer-{os.getuid()}")


def _path(name: str, suffix: str) -> Path:
    return _folder() / f"{_domain()}{name.replace('/', '.')}{suffix}"


def _open(name: str) -> TextIO | None:
    """Open the lock file of a system; None if there cannot be one, and thus no lock."""
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        return None  # no process discovers another one
    path = _path(name, _SUFFIX)
    folder = path.parent
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        if folder.stat().st_uid != os.getuid():
            return None
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError:
        return None
    return os.fdopen(descriptor, "r+", encoding="utf-8")


def _holder(lock: TextIO) -> tuple[str, str]:
    """Return the host and the process id in a lock file."""
    try:
        holder = json.load(lock)
        return str(holder["host"]), str(holder["pid"])
    except (ValueError, KeyError, TypeError):
        return socket.gethostname(), "unknown"  # it is being written
