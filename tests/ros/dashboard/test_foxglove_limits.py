"""Whatever a client of the Foxglove protocol sends or does not read, everything else continues."""

from __future__ import annotations

import fcntl
import json
import socket
import struct
import termios
import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from composer.dashboard.foxglove.encoding import SUBPROTOCOLS
from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import (
    PATIENCE_S,
    Address,
    Dashboard,
    browser,
    close_code,
    dashboard,
)
from tests.ros.support.in_process import wait_until

MESSAGE, SERVICE = b"\x01", b"\x02"
#: A part of what the camera publishes on /large.
MESSAGE_SIZE = 100_000


@pytest.fixture(scope="module")
def server(shared_domain_id: int) -> Iterator[Dashboard]:
    with (
        hand_written("hand_written_camera.py"),
        hand_written("hand_written_talker.py"),
        dashboard() as running,
    ):
        yield running


class Raw:
    """A client that sends what it wants."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.frames: list[bytes] = []
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self.capabilities: list[str] = []
        self.said: list[str] = []
        self.failures: list[dict[str, Any]] = []

    def send(self, content: Any) -> None:
        self.socket.send(content if isinstance(content, str | bytes) else json.dumps(content))

    def wait(self, condition: Callable[[], Any]) -> None:
        while not condition():
            message = self.socket.recv(timeout=PATIENCE_S)
            if isinstance(message, bytes):
                self.frames.append(message)
                continue
            content = json.loads(message)
            self.channels |= {item["topic"]: item for item in content.get("channels", [])}
            self.services |= {item["name"]: item for item in content.get("services", [])}
            self.capabilities = content.get("capabilities", self.capabilities)
            if content["op"] == "status":
                self.said.append(content["message"])
            elif content["op"] == "serviceCallFailure":
                self.failures.append(content)

    def refused(self, content: Any) -> str:
        """Return the reason why a message is refused."""
        count = len(self.said)
        self.send(content)
        self.wait(lambda: len(self.said) > count)
        return self.said[count]

    def subscribe(self, topic: str, identifier: int = 0) -> None:
        self.wait(lambda: topic in self.channels)
        wanted = [{"id": identifier, "channelId": self.channels[topic]["id"]}]
        self.send({"op": "subscribe", "subscriptions": wanted})

    def is_served(self) -> bool:
        """Wait for a message of a topic."""
        self.subscribe("/lab/count", 999)
        self.wait(lambda: any(frame[1:5] == struct.pack("<I", 999) for frame in self.frames))
        return True


@contextmanager
def raw(address: Address, **options: Any) -> Iterator[Raw]:
    # Everything is received at once: behind messages that wait, the end would not be seen.
    default = {"subprotocols": [Subprotocol(name) for name in SUBPROTOCOLS], "max_queue": None}
    values = {**default, **options}
    url = f"ws://{address.host}/foxglove?token={address.token}"
    with connect(url, compression=None, max_size=None, **values) as socket:
        yield Raw(socket)


def status_of(address: Address, query: str, **options: Any) -> int:
    with pytest.raises(InvalidStatus) as caught:
        connect(f"ws://{address.host}/foxglove{query}", **options)
    return caught.value.response.status_code


def test_only_with_the_token_and_a_known_protocol(server: Dashboard) -> None:
    address, names = server.address, [Subprotocol("foxglove.sdk.v1")]
    token = f"?token={address.token}"
    assert status_of(address, "", subprotocols=names) == 403
    assert status_of(address, "?token=wrong", subprotocols=names) in (401, 403)
    evil: Any = "https://app.example"
    cookie = {"Cookie": address.cookie}
    assert status_of(address, "", origin=evil, subprotocols=names, additional_headers=cookie) == 403
    assert status_of(address, token) == 400
    assert status_of(address, token, subprotocols=[Subprotocol("foxglove.websocket.v9")]) == 400
    # A page of another site may connect if its user has given it the token.
    with raw(address, origin=evil) as client:
        assert client.is_served()


def test_simulated_time_and_a_latched_map_reach_every_client(server: Dashboard) -> None:
    with raw(server.address) as first, raw(server.address) as second:
        first.wait(lambda: "time" in first.capabilities)
        first.wait(lambda: len(first.frames) > 5)
        times = [struct.unpack("<BQ", frame) for frame in first.frames]
        for client in (first, second):
            client.subscribe("/map")
            client.wait(lambda client=client: any(frame[0] == 1 for frame in client.frames))
    assert {opcode for opcode, _ in times} == {2}
    seconds = [time_ns / 1e9 for _, time_ns in times]
    assert seconds == sorted(seconds)
    assert 1000 < seconds[0] < 100_000


def test_it_can_be_switched_off(shared_domain_id: int) -> None:
    with dashboard("--no-foxglove") as server:
        token = f"?token={server.address.token}"
        assert (
            status_of(server.address, token, subprotocols=[Subprotocol("foxglove.sdk.v1")]) == 404
        )


def test_malformed_messages_are_answered_with_a_reason(server: Dashboard) -> None:
    with raw(server.address) as client:
        client.wait(lambda: "/lab/count" in client.channels and "/lab/add" in client.services)
        for content in ("", "{", "[]", "null", '{"op": 1}', "[" * 5000, "\x00", "9" * 5000):
            assert client.refused(content)
        assert "did you mean 'subscribe'" in client.refused({"op": "subscrib"})
        for content in (
            {"op": "subscribe", "subscriptions": 1},
            {"op": "subscribe", "subscriptions": [1]},
            {"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]},
            {"op": "subscribe", "subscriptions": [{"id": 1e9, "channelId": 1}]},
            {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 2**40}]},
            {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99999}]},
            {"op": "unsubscribe", "subscriptionIds": [7]},
            {"op": "unadvertise", "channelIds": ["x"]},
            {"op": "advertise", "channels": [{"id": 1, "topic": "/a", "encoding": "json"}]},
            _advertise(2, "/a", "x", encoding="json"),
            _advertise(3, "/a", "os/msg/System"),
            _advertise(4, "a b", "std_msgs/msg/String"),
            _advertise(5, "/a", "std_srvs/srv/SetBool"),
            _advertise(6, "/a", "String"),
            _advertise(7, "/a", "/String"),
            _advertise(8, "/a", "std_msgs/"),
            _advertise(9, "/a\ud800", "std_msgs/msg/String"),
            '{"op": "advertise", "channels": [{"id": 1' + "0" * 400 + "}]}",
            b"",
            b"\x07abc",
            b"\x01ab",
            b"\x01" + bytes(4),
            SERVICE + bytes(3),
            SERVICE + struct.pack("<III", 1, 1, 2**31) + b"cdr",
        ):
            assert client.refused(content), content
        assert client.is_served()
        wanted = [{"id": 1, "channelId": client.channels["/lab/count"]["id"]}]
        client.send({"op": "subscribe", "subscriptions": wanted})
        client.wait(lambda: any("already" in text for text in client.said))


def _advertise(identifier: int, topic: str, name: str, encoding: str = "cdr") -> dict[str, Any]:
    channel = {"id": identifier, "topic": topic, "encoding": encoding, "schemaName": name}
    return {"op": "advertise", "channels": [channel]}


def test_all_that_waits_for_a_client_has_one_limit_in_bytes(server: Dashboard) -> None:
    """Messages on channels that fail or that are slow, and names."""
    before_mb = server.memory_mb()
    with raw(server.address, close_timeout=0) as client:
        for number in range(3):
            assert client.refused(_advertise(number, f"bad name {number}", "std_msgs/msg/String"))
        with suppress(ConnectionClosed):
            for _ in range(80):
                for number in range(3):
                    client.send(MESSAGE + struct.pack("<I", number) + b"x" * 1_000_000)
    with raw(server.address, close_timeout=0) as client, suppress(ConnectionClosed):
        for number in range(40):
            name = f"/t{number}{'x' * 900_000}"
            client.send(_advertise(number, name, "std_msgs/msg/String"))
        client.wait(lambda: any("MB are the limit" in text for text in client.said))
    assert server.memory_mb() < before_mb + 80
    with raw(server.address) as client:
        assert client.is_served()


def test_the_end_does_not_wait_for_a_client_that_does_not_read(server: Dashboard) -> None:
    with raw(server.address, max_queue=1, close_timeout=0, ping_interval=None) as client:
        client.subscribe("/large")
        unread = Unread(client.socket.socket)
        wait_until(unread.is_full, "messages that wait")
        with pytest.raises(ConnectionClosed):
            send_forever(client)


@pytest.mark.soak
def test_a_client_that_reads_nothing_is_disconnected(server: Dashboard) -> None:
    """It does not answer pings either: their time limit is 20 s, and they come every 20 s."""
    with raw(server.address, max_queue=1, close_timeout=0, ping_interval=None) as client:
        client.subscribe("/large")
        connected = server.open_files()
        wait_until(lambda: server.open_files() < connected, "the end", 60.0)


def send_forever(client: Raw) -> None:
    while True:
        client.send(b"\xff" * 100_000)


class Unread:
    """What waits in a socket. It is full once nothing has arrived for a while."""

    def __init__(self, socket: socket.socket) -> None:
        self._socket = socket
        self._size = 0
        self._full_at_s = 0.0

    def is_full(self) -> bool:
        size = array("i", [0])
        fcntl.ioctl(self._socket, termios.FIONREAD, size)
        if size[0] != self._size:
            self._size, self._full_at_s = size[0], time.monotonic() + 1.5
        return self._size > MESSAGE_SIZE and time.monotonic() > self._full_at_s


def test_malformed_cdr_is_refused(server: Dashboard) -> None:
    with raw(server.address) as client:
        client.wait(lambda: "/lab/add" in client.services)
        client.send(_advertise(1, "/lab/in", "std_msgs/msg/String"))
        for data in (b"", b"\x00", b"\xff" * 100, b"\x00\x01\x00\x00" + b"\xff" * 50):
            assert "are not a message std_msgs/msg/String" in client.refused(
                MESSAGE + struct.pack("<I", 1) + data
            )
        number = client.services["/lab/add"]["id"]
        for call, (service, encoding, data) in enumerate(
            ((number, b"cdr", b""), (number, b"json", b"{}"), (99999, b"cdr", b"\0\1\0\0\1"))
        ):
            head = struct.pack("<III", service, call, len(encoding))
            client.send(SERVICE + head + encoding + data)
            client.wait(lambda call=call: len(client.failures) > call)
        assert [item["callId"] for item in client.failures] == [0, 1, 2]
        assert client.is_served()


def test_messages_of_any_type_are_skipped_if_they_have_too_many_bytes(server: Dashboard) -> None:
    with raw(server.address) as client, browser(server.address) as page:
        client.subscribe("/large")
        client.wait(
            lambda: any("messages of '/large' were skipped" in text for text in client.said)
        )
        assert client.is_served()
        # What is skipped for the page is counted there, and only the dashboard has not read it.
        echo = page.subscribe("echo", topic="/large", max_hz=100)
        page.until(echo, lambda data: data["messages"])
        page.wait(lambda: any(each["dropped"] > 5 for each in page.updates if each["sub"] == echo))
        topics = page.subscribe("topics", measure=["/large"])
        data = page.until(
            topics, lambda data: (data["figures"].get("/large", {}).get("messages") or 0) > 3
        )
        assert data["figures"]["/large"]["mean_bytes"] > 1_000_000


def test_clients_that_never_read_cost_no_memory(server: Dashboard) -> None:
    with ExitStack() as stack, raw(server.address) as other:
        for _ in range(10):
            stalled = stack.enter_context(raw(server.address, max_queue=1, close_timeout=0))
            stalled.subscribe("/camera")
            stalled.subscribe("/lab/count", 10)
        other.subscribe("/camera")
        other.wait(lambda: other.frames)
        before_mb = server.memory_mb()
        received = len(other.frames)
        # A second of images: 28 MB for each client.
        other.wait(lambda: len(other.frames) > received + 30)
        assert server.memory_mb() < before_mb + 80
        assert other.is_served()
        with browser(server.address) as page:
            assert page.ok("ping")
    # A client that requests without reading is disconnected.
    with raw(server.address, max_queue=1, close_timeout=0) as client:
        client.wait(lambda: client.channels)
        with suppress(ConnectionClosed):
            for _ in range(200_000):
                client.send({"op": "unsubscribe", "subscriptionIds": [7]})
        assert close_code(client.socket) in (1008, None)
