"""What this computer knows of the last discovery server with an identity: whether it was lost.

A server that a killed process has started leaves clients that take its successor for it. The next
process has to know, so there is a file next to the instance locks. While a server runs, the file
has the id of the boot of this computer. It is empty once the server has ended in order.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import TextIO

from composer.runtime.process import StartRefused
from composer.runtime.process.instance_lock import open_private

_BOOT = Path("/proc/sys/kernel/random/boot_id")


class ServerRecord:
    """The record of one server, locked by the process that runs it.

    Without a folder that only this user can write to, nothing is recorded.
    """

    def __init__(self, number: int, address: str, port: int) -> None:
        """Open the record of the server with this position in the list, and lock it."""
        #: Whether another process of this computer runs the server, or is about to.
        self.is_held_elsewhere = False
        self._file = _open(f"discovery-server.{number}.{address}.{port}")
        if self._file is None:
            return
        try:
            # Not inherited by processes that user code forks, as a lock of flock() would be.
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.is_held_elsewhere = True
            self.close()

    @property
    def is_lost(self) -> bool:
        """Whether the server did not end in order, since this computer was started."""
        if self._file is None:
            return False
        self._file.seek(0)
        return self._file.read() == _this_boot()

    def set_running(self) -> None:
        """Record that the server runs, before it is started."""
        self._write(_this_boot())

    def set_ended(self) -> None:
        """Record that no client can take the next server for this one."""
        self._write("")

    def close(self) -> None:
        """Release the lock."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _write(self, text: str) -> None:
        if self._file is not None:
            self._file.seek(0)
            self._file.truncate()
            self._file.write(text)
            self._file.flush()


def _open(name: str) -> TextIO | None:
    try:
        return open_private(name)
    except (OSError, StartRefused):
        return None


def _this_boot() -> str:
    return _BOOT.read_text(encoding="ascii")
