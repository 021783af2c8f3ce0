"""The ROS graph as a running system sees it, for commands of the same user on this computer.

A command that joins the graph itself imports rclpy and waits for discovery, which takes about a
second. The manager of a running system discovered the graph long ago. It sends its view, as one
JSON document, to each connection to a Unix socket next to the instance lock, and null if its view
may be incomplete. See docs/decisions/0042-graph-socket.md.
"""

from __future__ import annotations

import json
import os
import socket
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from composer.names import is_hidden
from composer.runtime.process.instance_lock import socket_path

#: A name and its types. Nodes have none; more than one type is a mistake in some node.
NameAndTypes = tuple[str, tuple[str, ...]]
#: The sorted names of all nodes, topics, services and actions, including hidden ones.
GraphView: TypeAlias = Mapping[str, tuple[NameAndTypes, ...]]

KINDS = ("node", "topic", "service", "action")
#: Processes that differ in one of these variables may see different graphs.
_VARIABLES = (
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISCOVERY_SERVER",
    "ROS_LOCALHOST_ONLY",
    "ROS_SECURITY_ENABLE",
    "ROS_STATIC_PEERS",
)
_SEND_WITHIN_S = 1.0
_READ_BYTES = 65_536


def visible(names: Iterable[NameAndTypes]) -> tuple[NameAndTypes, ...]:
    """Return the names that ROS tools do not hide."""
    return tuple(item for item in names if not is_hidden(item[0]))


class GraphSocket:
    """Serves the view of a system from a thread of its own, one connection at a time."""

    def __init__(
        self,
        system: str,
        view: Callable[[], GraphView | None],
        on_error: Callable[[Exception], None],
    ) -> None:
        """``system`` is the namespace of the manager; ``view`` is called per connection.

        If there cannot be a socket, as with a very long name, commands join the graph themselves.
        """
        self._view = view
        self._on_error = on_error
        self._path = socket_path(system)
        self._listener = None if self._path is None else _listen(self._path)
        self._thread: threading.Thread | None = None
        if self._listener is not None:
            self._thread = threading.Thread(
                target=self._serve, args=(self._listener,), name="graph socket", daemon=True
            )
            self._thread.start()

    def close(self, timeout_s: float) -> None:
        """Stop serving; wait for the thread, which may be sending a view."""
        if self._path is None or self._listener is None or self._thread is None:
            return
        with suppress(OSError):
            self._path.unlink()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes up accept
        self._thread.join(timeout_s)
        self._listener.close()

    def _serve(self, listener: socket.socket) -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:  # closed
                return
            with connection:
                try:
                    connection.settimeout(_SEND_WITHIN_S)
                    connection.sendall(_encoded(self._view()))
                except OSError:  # the command has ended
                    continue
                except Exception as error:  # the next command may fare better
                    self._on_error(error)


def read_graph(system: str, timeout_s: float) -> GraphView | None:
    """Return the graph as a system on this computer sees it.

    None if it does not respond in time, is not certain, or may see another graph than this process.
    """
    path = socket_path(system)
    if path is None:
        return None
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(timeout_s)
            connection.connect(str(path))
            return _decoded(b"".join(iter(lambda: connection.recv(_READ_BYTES), b"")))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _listen(path: Path) -> socket.socket | None:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        path.unlink(missing_ok=True)  # of a killed process
        listener.bind(str(path))
        listener.listen()
    except OSError:
        listener.close()
        return None
    return listener


def _environment() -> list[str]:
    return [os.environ.get(name, "") for name in _VARIABLES]


def _encoded(view: GraphView | None) -> bytes:
    return json.dumps({"environment": _environment(), "graph": view}).encode()


def _decoded(data: bytes) -> GraphView | None:
    document = json.loads(data)
    graph = document["graph"]
    if graph is None or document["environment"] != _environment():
        return None
    return {kind: tuple((name, tuple(types)) for name, types in graph[kind]) for kind in KINDS}
