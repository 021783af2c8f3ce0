"""Messages to the service manager that has started this process, as sd_notify(3) of systemd.

Without one, they go nowhere. The variable that names its socket is removed from the environment:
children are not the service.
"""

from __future__ import annotations

import os
import socket
from collections.abc import MutableMapping
from contextlib import suppress

_VARIABLE = "NOTIFY_SOCKET"
READY, STOPPING, ALIVE = "READY=1", "STOPPING=1", "WATCHDOG=1"


class ServiceManager:
    """Sends messages, from any thread."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ) -> None:
        name = environment.pop(_VARIABLE, "")
        # Those that begin with '@' are in Linux' abstract namespace.
        self._address = f"\0{name[1:]}" if name.startswith("@") else name

    def send(self, *messages: str) -> None:
        """Send messages such as READY; if the service manager is gone, they are lost."""
        if not self._address:
            return
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as datagrams:
            datagrams.setblocking(False)
            datagrams.sendto("\n".join(messages).encode(), self._address)
