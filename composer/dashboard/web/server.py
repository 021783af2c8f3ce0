"""The web server: sockets, limits for connections, and the end on a signal.

uvicorn speaks HTTP and WebSocket. This adds what it lacks: a time limit for connections that send
nothing, a limit for their number, and a main loop that sleeps until a signal arrives.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import signal
import socket
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from types import FrameType
from typing import Any, cast

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import InvalidState

from composer.dashboard.access import Refusal
from composer.dashboard.protocol.outbox import MAX_MESSAGE
from composer.dashboard.web.app import AccessCheck, refusal_page, security_headers
from composer.runtime.process.watchdog import SAME_REQUEST_S, STOP_SIGNALS

DEFAULT_PORT = 8800
#: Ports that are tried if the default one is in use.
_PORTS = 100
#: Connections, most of which are free again after the time that each has for a request.
MAX_OPEN = 160
REQUEST_WITHIN_S = 5.0
#: Connections that are accepted at once, before those beyond the limit are ended. There are fewer
#: than MAX_OPEN, so that each is read once before newer ones can end it.
BACKLOG = 128
_MAX_HEADERS = 16 * 1024
#: A browser that has not answered a ping after this time is disconnected.
_PING_S = 20.0
#: A browser that has not confirmed the end of its connection after this time is disconnected.
_CLOSED_WITHIN_S = 2.0
#: At the end, for all connections together; then they are aborted.
_ENDED_WITHIN_S = 0.5
_END_S = 1
_SIGNAL_EXIT = 128


class PortInUseError(Exception):
    """The address cannot be listened on."""


def listen(host: str, port: int | None) -> socket.socket:
    """Return a listening socket. Without a port, the default one or the next that is free.

    Raises PortInUseError.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    ports = [port] if port is not None else [*range(DEFAULT_PORT, DEFAULT_PORT + _PORTS), 0]
    for candidate in ports:
        listening = socket.socket(family, socket.SOCK_STREAM)
        # Of an earlier dashboard, connections may linger; two servers never share a port.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, candidate))
            listening.listen(BACKLOG)
        except OSError as error:
            listening.close()
            if port is None and error.errno == errno.EADDRINUSE:
                continue
            raise PortInUseError(
                f"cannot listen on {host}:{candidate}: {error.strerror}"
            ) from error
        listening.setblocking(False)
        return listening
    raise PortInUseError(f"no port of {host} is free")


def serve(app: AccessCheck, listening: socket.socket, on_ready: Callable[[], None]) -> None:
    """Serve until a signal. A second one ends the process at once, also while it is ending."""
    config = uvicorn.Config(
        app,
        http=_GuardedProtocol,
        ws=WebSocketProtocol,
        loop="asyncio",
        lifespan="off",
        interface="asgi3",
        backlog=BACKLOG,
        ws_max_size=MAX_MESSAGE,
        ws_per_message_deflate=False,  # compression takes time and memory for each browser
        ws_ping_interval=_PING_S,
        ws_ping_timeout=_PING_S,
        h11_max_incomplete_event_size=_MAX_HEADERS,
        timeout_graceful_shutdown=_END_S,
        proxy_headers=False,
        server_header=False,
        date_header=False,
        access_log=False,
        log_config=None,
        log_level="error",
    )
    logging.getLogger("uvicorn.error").addFilter(_is_of_use)
    server = _Server(config, app, on_ready)
    try:
        asyncio.run(server.serve(sockets=[listening]))
    finally:
        for number in STOP_SIGNALS:  # uvicorn has set them back
            signal.signal(number, _end_at_once)


def _is_of_use(record: logging.LogRecord) -> bool:
    """Return whether to log something: each refused WebSocket would be a line."""
    return "without completing handshake" not in record.getMessage()


def _end_at_once(number: int, _: FrameType | None) -> None:
    os._exit(_SIGNAL_EXIT + number)


class _Server(uvicorn.Server):
    """A server that wakes up only for requests and signals."""

    def __init__(
        self, config: uvicorn.Config, app: AccessCheck, on_ready: Callable[[], None]
    ) -> None:
        super().__init__(config)
        self._app = app
        self._on_ready = on_ready

    async def main_loop(self) -> None:
        """Wait for a signal, then close all connections."""
        ended = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in STOP_SIGNALS:
            loop.add_signal_handler(number, ended.set)
        self._on_ready()
        await ended.wait()
        self.should_exit = True
        await asyncio.sleep(SAME_REQUEST_S)
        for number in STOP_SIGNALS:
            loop.remove_signal_handler(number)
            signal.signal(number, _end_at_once)
        await self._app.close(_ENDED_WITHIN_S)
        for connection in tuple(self.server_state.connections):
            if connection.transport.get_write_buffer_size():
                connection.transport.abort()


class _Transport:
    """A transport that also ends while the other side does not read.

    ``close`` of a transport of asyncio waits until everything was read.
    """

    def __init__(self, transport: asyncio.Transport, loop: asyncio.AbstractEventLoop) -> None:
        self._transport = transport
        self._loop = loop
        self.write = transport.write

    def close(self) -> None:
        """Close; discard soon what is not read."""
        if not self._transport.is_closing():
            self._transport.close()
            self._loop.call_later(_CLOSED_WITHIN_S, self._transport.abort)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """Does not wait long for the other side when a connection ends."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.close_timeout = _CLOSED_WITHIN_S

    def connection_made(self, transport: Any) -> None:
        """Begin a connection."""
        super().connection_made(cast("asyncio.Transport", _Transport(transport, self.loop)))

    async def send(self, message: Any) -> None:
        """Send a message. The last one is not sent if earlier ones are not read in time."""
        if message["type"] == "websocket.close":
            self.loop.call_later(self.close_timeout, self.transport.close)
        await super().send(message)

    def shutdown(self) -> None:
        """End the connection; one that the other side has just ended takes no message any more."""
        with suppress(InvalidState):
            super().shutdown()


class _GuardedProtocol(H11Protocol):
    """Ends connections that do not send a complete request in time, or that are too many.

    A refused request ends its connection, so only those with the token stay open after a request.
    They keep their places: beyond the limit, the oldest connection without a request is ended.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._check: asyncio.TimerHandle | None = None
        self._last_cycle: Any = None
        self.opened_at = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept a connection, or end it at once."""
        super().connection_made(transport)
        self.opened_at = self.loop.time()
        if len(self.connections) > MAX_OPEN:
            guarded = [item for item in self.connections if isinstance(item, _GuardedProtocol)]
            waiting = [item for item in guarded if item.cycle is None]  # this one at least
            oldest = min(waiting, key=lambda item: item.opened_at)
            oldest._refuse(Refusal(503, f"{MAX_OPEN} connections are open already"))
            self.connections.discard(oldest)
            if oldest is self:
                return
        self._check = self.loop.call_later(REQUEST_WITHIN_S, self._end_if_idle)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the checks."""
        if self._check is not None:
            self._check.cancel()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Answer what is not HTTP."""
        self._refuse(Refusal(400, msg.rstrip(".")))

    def _refuse(self, refusal: Refusal) -> None:
        """Say why the connection ends, and end it; nothing waits for one that does not read."""
        response = refusal_page(refusal)
        status = HTTPStatus(refusal.status)
        headers = [*response.raw_headers, *security_headers(""), (b"connection", b"close")]
        head = b"".join(b"%b: %b\r\n" % header for header in headers)
        start = f"HTTP/1.1 {status.value} {status.phrase}\r\n".encode()
        self.transport.write(b"%b%b\r\n%b" % (start, head, bytes(response.body)))
        if self.transport.get_write_buffer_size():
            self.transport.abort()
        else:
            self.transport.close()

    def _end_if_idle(self) -> None:
        """End the connection if it has sent nothing, or only a part of a request."""
        self._check = None
        if self.transport.get_protocol() is not self:
            return  # it is a WebSocket now
        is_busy = self.cycle is not None and not self.cycle.response_complete
        if not is_busy and self.cycle is self._last_cycle:
            if self.conn.trailing_data[0]:
                self._refuse(Refusal(408, f"no complete request within {REQUEST_WITHIN_S:g} s"))
            else:
                # A browser that is about to use it would take a reason for the response.
                self.transport.close()
            return
        self._last_cycle = self.cycle
        self._check = self.loop.call_later(REQUEST_WITHIN_S, self._end_if_idle)
