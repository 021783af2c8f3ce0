"""Queries of commands to the running systems of the same user on this computer.

A command that joins the ROS graph itself imports rclpy and waits for discovery, which takes about a
second. The manager of a running system discovered the graph long ago, and knows the states and
parameters of its nodes. It listens on a Unix socket next to the instance lock. A command sends a
query of :mod:`composer.runtime.protocol.requests` as one line, and receives a line with what the
system sees of the network, and the answer, which is empty if the manager is not certain. See
docs/decisions/0013-query-socket.md.
"""

from __future__ import annotations

import json
import os
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

from composer.runtime.clock import COMPUTER
from composer.runtime.process.instance_lock import socket_path
from composer.runtime.protocol.codec import ProtocolError, decode, encode

#: Processes that differ in one of these variables may see different graphs.
_VARIABLES = (
    "RMW_IMPLEMENTATION",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISCOVERY_SERVER",
    "ROS_LOCALHOST_ONLY",
    "ROS_SECURITY_ENABLE",
    "ROS_STATIC_PEERS",
)
_TRANSFER_WITHIN_S = 1.0
_READ_BYTES = 65_536
_MAX_QUERY_BYTES = 65_536
#: A command that comes in addition joins the graph itself.
_MAX_CONNECTIONS = 64
#: Answers a query of its type, or returns None if it is not certain.
Answer: TypeAlias = Callable[[Any], Any]


class QuerySocket:
    """Answers queries, one at a time. Each connection has a thread, which waits for its command."""

    def __init__(
        self,
        system: str,
        answers: Mapping[type[Any], Answer],
        on_error: Callable[[Exception], None],
    ) -> None:
        """``system`` is the namespace of the manager; ``answers`` are those to queries, by type.

        If there cannot be a socket, as with a very long name, commands join the graph themselves.
        """
        self._answers = answers
        self._on_error = on_error
        self._answering = threading.Lock()
        self._is_closed = False
        self._places = threading.Semaphore(_MAX_CONNECTIONS)
        self._path = socket_path(system)
        self._listener = None if self._path is None else _listen(self._path)
        self._thread: threading.Thread | None = None
        if self._listener is not None:
            self._thread = threading.Thread(
                target=self._serve, args=(self._listener,), name="query socket", daemon=True
            )
            self._thread.start()

    def close(self, timeout_s: float) -> None:
        """Stop serving; wait for an answer that is being computed."""
        if self._path is None or self._listener is None or self._thread is None:
            return
        with suppress(OSError):
            self._path.unlink()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes up accept
        self._is_closed = True
        end_s = COMPUTER.monotonic() + timeout_s
        self._thread.join(timeout_s)
        self._listener.close()
        if self._answering.acquire(timeout=max(0.0, end_s - COMPUTER.monotonic())):
            self._answering.release()

    def _serve(self, listener: socket.socket) -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:  # closed
                return
            if self._places.acquire(blocking=False):
                threading.Thread(
                    target=self._serve_one, args=(connection,), name="query", daemon=True
                ).start()
            else:
                connection.close()

    def _serve_one(self, connection: socket.socket) -> None:
        with connection:
            try:
                self._respond(connection)
            except OSError:  # the command has ended, or is too slow
                pass
            except Exception as error:  # the next command may fare better
                self._on_error(error)
            finally:
                self._places.release()

    def _respond(self, connection: socket.socket) -> None:
        try:
            query = decode(_read_line(connection), *self._answers)
        except ProtocolError:  # of another version, whose command joins the graph itself
            return
        with self._answering:
            if self._is_closed or _has_given_up(connection):
                return  # an answer may take half a second, for which the next commands would wait
            answer = self._answers[type(query)](query)
        document = "" if answer is None else encode(answer)
        connection.settimeout(_TRANSFER_WITHIN_S)  # the limit is for all of it
        connection.sendall(f"{discovery_environment()}\n{document}".encode())


def ask(system: str, query: Any, timeout_s: float) -> Any:
    """Return the answer of a system on this computer, which has the type ``query.Answer``.

    None if it does not respond in time, is not certain, is of another version, or may see another
    graph than this process.
    """
    path = socket_path(system)
    if path is None or timeout_s <= 0.0:
        return None
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(timeout_s)
            connection.connect(str(path))
            connection.sendall(encode(query).encode() + b"\n")
            received = b"".join(iter(lambda: connection.recv(_READ_BYTES), b""))
        environment, _, document = received.partition(b"\n")
        is_usable = document and environment == discovery_environment().encode()
        return decode(document, query.Answer) if is_usable else None
    except (OSError, ProtocolError):
        return None


def _read_line(connection: socket.socket) -> bytes:
    """Return the line that a command sends. Raises OSError if it takes too long."""
    line = b""
    end_s = COMPUTER.monotonic() + _TRANSFER_WITHIN_S
    while not line.endswith(b"\n") and len(line) < _MAX_QUERY_BYTES:
        connection.settimeout(max(0.001, end_s - COMPUTER.monotonic()))
        received = connection.recv(_READ_BYTES)
        if not received:
            break
        line += received
    return line


def _has_given_up(connection: socket.socket) -> bool:
    """Return whether the command has closed its side: it has waited for long enough."""
    connection.setblocking(False)
    try:
        return not connection.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False


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


def discovery_environment() -> str:
    """Return what decides which nodes a process discovers, in one line."""
    return json.dumps([os.environ.get(name, "") for name in _VARIABLES])
