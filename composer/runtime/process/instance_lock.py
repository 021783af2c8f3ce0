"""One composer a system and domain: whoever comes second is refused, and told who was first.

On one host a lock file says so before anything starts. Lock files of other hosts cannot be seen:
there the manager node finds its rival (:mod:`composer.runtime.manager.node`).
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
    """Return why the system cannot be run. ``name`` is its manager's namespace."""
    system = name if name.count("/") > 1 else name.removeprefix("/")
    return StartRefused(
        f"system '{system}' runs already in ROS domain {_domain()}: host {host}, process {pid}",
        f"end it with 'compose down {system}', or run this one with another ROS_DOMAIN_ID or"
        " --namespace",
    )


@contextmanager
def hold_instance_lock(name: str) -> Iterator[None]:
    """Hold the right to run the system for the length of a ``with`` block.

    ``name`` is the namespace of its manager. The operating system gives the right back however the
    process ends. Raises StartRefused.
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
    """Return the systems that composers of this user run on this host and in this domain.

    By name, with the process. Their nodes may take seconds to be discovered; this is known at once.
    """
    found: dict[str, str] = {}
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
                found[name] = _holder(lock)[1]
    return found


def _domain() -> str:
    return os.environ.get("ROS_DOMAIN_ID") or _DEFAULT_DOMAIN


def _folder() -> Path:
    parent = os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()
    return Path(parent, f"ros2-composer-{os.getuid()}")


def _open(name: str) -> TextIO | None:
    """Open the lock file of a system; None where there can be none: then there is no such right."""
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        return None  # nobody sees anybody
    folder = _folder()
    path = folder / f"{_domain()}{name.replace('/', '.')}{_SUFFIX}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        if folder.stat().st_uid != os.getuid():
            return None
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError:
        return None
    return os.fdopen(descriptor, "r+", encoding="utf-8")


def _holder(lock: TextIO) -> tuple[str, str]:
    """Return the host and the process that a lock file names."""
    try:
        holder = json.load(lock)
        return str(holder["host"]), str(holder["pid"])
    except (ValueError, KeyError, TypeError):
        return socket.gethostname(), "unknown"  # it is writing just now
