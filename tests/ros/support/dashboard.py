"""A dashboard in a process of its own, and a browser without a page."""

from __future__ import annotations

import json
import re
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import cached_property
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tests.ros.support.forked import ForkedCommand

PATIENCE_S = 60.0
Message = dict[str, Any]


class Address:
    """The address that a dashboard has printed."""

    def __init__(self, url: str) -> None:
        found = re.fullmatch(r"http://([\w.:\[\]-]+)/\?token=([\w-]+)", url.strip())
        assert found, url
        self.host, self.token = found[1], found[2]
        self.port = urlsplit(f"//{self.host}").port or 0
        self.origin = f"http://{self.host}"

    @cached_property
    def _exchanged(self) -> tuple[str, str]:
        """What a browser gets for the token."""
        connection = HTTPConnection(self.host, timeout=PATIENCE_S)
        with closing(connection):
            connection.request("GET", f"/?token={self.token}")
            response = connection.getresponse()
        cookie = (response.getheader("Set-Cookie") or "").partition(";")[0]
        return cookie, (response.getheader("Location") or "").partition("#key=")[2]

    @property
    def cookie(self) -> str:
        """The cookie of a browser that has shown the token."""
        return self._exchanged[0]

    @property
    def websocket(self) -> str:
        """The address of the WebSocket, as the page opens it."""
        return f"ws://{self.host}/ws?key={self._exchanged[1]}"


class Dashboard:
    """``compose dashboard`` in a process of its own."""

    def __init__(self, *arguments: str, cwd: Path | None = None) -> None:
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 - as long as the process
        self.process = ForkedCommand(
            "dashboard", "--port", "0", *arguments, stderr=self._errors, cwd=cwd
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, self.errors()
        self.address = Address(line)

    def errors(self) -> str:
        """Return what the process has printed to stderr."""
        self._errors.seek(0)
        return self._errors.read()

    def memory_mb(self) -> float:
        """Return the resident memory of the process."""
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="utf-8")
        found = re.search(r"VmRSS:\s+(\d+) kB", status)
        assert found
        return int(found[1]) / 1e3

    def open_files(self) -> int:
        """Return the number of open file descriptors."""
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


@contextmanager
def dashboard(*arguments: str, cwd: Path | None = None) -> Iterator[Dashboard]:
    """Run ``compose dashboard`` for the length of the block."""
    running = Dashboard(*arguments, cwd=cwd)
    try:
        yield running
        assert running.process.poll() is None, "the dashboard has ended by itself"
        assert "Traceback" not in running.errors(), running.errors()
        running.process.terminate()
        assert running.process.wait(timeout=PATIENCE_S) == 0, running.errors()
    except BaseException as error:
        error.add_note(f"the dashboard printed:\n{running.errors()}")
        raise
    finally:
        running.process.terminate()
        running.process.wait(timeout=PATIENCE_S)


class Browser:
    """A WebSocket client that speaks to the dashboard as the page does."""

    def __init__(self, address: Address) -> None:
        self._stack = ExitStack()
        opening = connect(
            address.websocket,
            origin=address.origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": address.cookie},
            max_size=None,
            compression=None,
        )
        self.socket: ClientConnection = self._stack.enter_context(opening)
        self.updates: list[Message] = []
        self.pictures: list[tuple[Message, bytes]] = []
        self._replies: dict[Any, Message] = {}
        self._next = 0
        self.hello: Message = {}
        self.wait(lambda: self.hello)

    def close(self) -> None:
        """Leave."""
        self._stack.close()

    def request(self, op: str, **values: Any) -> Message:
        """Return the response to a request: ``ok`` or ``error`` is in it."""
        identifier, self._next = self._next, self._next + 1
        self.socket.send(json.dumps({"id": identifier, "op": op, **values}))
        self.wait(lambda: identifier in self._replies)
        return self._replies.pop(identifier)

    def ok(self, op: str, **values: Any) -> Any:
        """Return the result of a request that must succeed."""
        reply = self.request(op, **values)
        assert "ok" in reply, reply
        return reply["ok"]

    def error(self, op: str, **values: Any) -> Message:
        """Return the error of a request that must fail."""
        reply = self.request(op, **values)
        assert "error" in reply, reply
        error: Message = reply["error"]
        return error

    def subscribe(self, channel: str, **parameters: Any) -> int:
        """Subscribe to a channel; return the number of the subscription."""
        number: int = self.ok("subscribe", channel=channel, params=parameters)["sub"]
        return number

    def until(self, number: int, fits: Callable[[Any], Any]) -> Any:
        """Return the first data of a subscription, from now or before, that fit."""
        return self._first(number, "data", fits)

    def failure(self, number: int) -> Any:
        """Return the first error of a subscription."""
        return self._first(number, "error", lambda _: True)

    def _first(self, number: int, key: str, fits: Callable[[Any], Any]) -> Any:
        def found() -> list[Any]:
            updates = [item for item in self.updates if item["sub"] == number and key in item]
            return [item[key] for item in updates if fits(item[key])]

        self.wait(found)
        return found()[0]

    def wait(self, condition: Callable[[], Any]) -> None:
        """Receive messages until the condition holds."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            left_s = end_s - time.monotonic()
            assert left_s > 0, f"not within {PATIENCE_S:g} s, last: {self.updates[-2:]!s:.1500}"
            try:
                self._take(self.socket.recv(timeout=left_s))
            except TimeoutError:
                continue

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            length = int.from_bytes(message[:4], "big")
            header = json.loads(message[4 : 4 + length])
            self.pictures.append((header, message[4 + length :]))
            return
        content = json.loads(message)
        if "hello" in content:
            self.hello = content["hello"]
        elif "sub" in content:
            self.updates.append(content)
        else:
            self._replies[content["id"]] = content


def close_code(socket: ClientConnection) -> int | None:
    """Wait until the server closes a connection; return the code, if it could send one."""
    try:
        while True:
            socket.recv(timeout=PATIENCE_S)
    except ConnectionClosed as end:
        return None if end.rcvd is None else end.rcvd.code


@contextmanager
def browser(address: Address) -> Iterator[Browser]:
    """Connect for the length of the block."""
    opened = Browser(address)
    try:
        yield opened
    finally:
        opened.close()
