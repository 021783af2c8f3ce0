"""Whatever a client sends or does not read, memory is bounded and everything else continues."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack, suppress

import pytest
from rclpy.lifecycle import LifecycleNode
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from composer.dashboard.protocol.outbox import MAX_CONNECTIONS
from composer.dashboard.web.server import BACKLOG, MAX_OPEN
from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import (
    PATIENCE_S,
    Address,
    Browser,
    Dashboard,
    browser,
    close_code,
    dashboard,
)
from tests.ros.support.in_process import Peer, wait_until


@pytest.fixture(scope="module")
def server(shared_domain_id: int) -> Iterator[Dashboard]:
    with hand_written("hand_written_camera.py"), dashboard() as running:
        yield running


@pytest.fixture(scope="module")
def incomplete(server: Dashboard) -> Iterator[tuple[socket.socket, socket.socket]]:
    """A connection without a request, and one with a part of it, from the second test on.

    They are ended after five seconds, so the last test is about them.
    """
    with raw(server.address) as idle, raw(server.address, b"GET / HTTP/1.1\r\nX: ") as slow:
        yield idle, slow


@pytest.fixture
def page(server: Dashboard) -> Iterator[Browser]:
    with browser(server.address) as opened:
        yield opened


def raw(address: Address, text: bytes = b"") -> socket.socket:
    opened = socket.create_connection(("127.0.0.1", address.port), timeout=PATIENCE_S)
    opened.sendall(text)
    return opened


def websocket(address: Address) -> ClientConnection:
    return connect(
        address.websocket,
        origin=address.origin,  # type: ignore[arg-type]
        additional_headers={"Cookie": address.cookie},
        compression=None,
        max_size=None,
    )


def answer_of(opened: socket.socket) -> bytes:
    """Return the beginning of what the server has answered; empty if that was lost."""
    try:
        return opened.recv(100)
    except OSError:
        return b""


def test_half_open_and_many_connections(server: Dashboard, page: Browser) -> None:
    address = server.address
    wait_until(lambda: page.ok("ping")["state"] == "ready", "the dashboard in the ROS graph")
    before = server.open_files()
    with ExitStack() as stack:
        opened = []
        for number in range(1000):
            text = (b"", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nX: " + b"x" * 1000)[number % 3]
            try:
                opened.append(stack.enter_context(raw(address, text)))
            except ConnectionError:
                continue  # the server has ended it already
            if number % 100 == 0:
                assert page.ok("ping")  # a browser that is connected notices nothing
                with browser(address) as other:  # nor does one that connects now
                    assert other.ok("ping")
        assert server.open_files() <= before + MAX_OPEN + BACKLOG + 5
        refused = (answer_of(one).startswith(b"HTTP/1.1 503 ") for one in opened)
        assert any(refused)
    wait_until(lambda: server.open_files() <= before + 5, "the files of the ended connections")
    with browser(address) as other:
        assert other.ok("ping")


def test_nothing_is_left_of_a_transition(page: Browser, peer: Peer) -> None:
    name = peer.join("managed", LifecycleNode).get_fully_qualified_name()
    service = f"{name}/change_state"
    known = {"name": name, "state": "unconfigured"}
    nodes = page.subscribe("nodes")
    page.until(nodes, lambda data: any(known.items() <= node.items() for node in data["nodes"]))
    for transition in ("configure", "activate"):
        page.ok("transition", node=name, transition=transition)
        wait_until(lambda: not peer.node.count_clients(service), "the end of the client")


@pytest.mark.usefixtures("incomplete")
def test_malformed_requests_are_answered_with_a_reason(page: Browser) -> None:
    for message in ("", "{", "[]", "null", '{"id": 1}', "\x00", "[" * 5000):
        page.socket.send(message)
    page.socket.send(b"\x81\x7f")
    for op, values in (
        ("subscribe", {"channel": "nodez", "params": {}}),
        ("subscribe", {"channel": "nodes", "params": {"a": 1}}),
        ("subscribe", {"channel": "echo", "params": {"topic": 5}}),
        ("subscribe", {"channel": "echo", "params": {"topic": "/a", "max_hz": 1e9}}),
        ("subscribe", {"channel": "echo", "params": {"topic": "/a", "max_hz": 10**400}}),
        ("subscribe", {"channel": "graph", "params": {"view": "x"}}),
        ("publish", {"topic": "/a\ud800", "type": "std_msgs/msg/String", "message": {}}),
        ("subscribe", {"channel": "echo", "params": {"topic": "/\ud800"}}),
        ("unsubscribe", {"sub": 99}),
        ("update", {"sub": "x", "params": {}}),
        ("cancel", {"sub": [1]}),
        ("cal", {}),
        ("call", {"service": "/a", "request": [], "timeout_s": 1}),
        ("call", {"service": "a b", "type": "std_srvs/srv/SetBool", "request": {}}),
        ("publish", {"topic": "/a", "type": "os/msg/System", "message": {}}),
        ("__class__", {}),
    ):
        error = page.error(op, **values)
        assert error["code"] in ("bad_request", "not_found"), (op, error)
        assert error["message"]
    assert page.ok("ping")


def test_nonsense_and_large_messages_end_only_their_connection(
    server: Dashboard, page: Browser
) -> None:
    with websocket(server.address) as opened:
        for _ in range(20):
            opened.send("nonsense")
        assert close_code(opened) == 1008
    before_mb = server.memory_mb()
    for size in (2_000_000, 100_000_000):
        with websocket(server.address) as opened:
            opened.recv(timeout=PATIENCE_S)
            with suppress(ConnectionClosed):
                opened.send(b"x" * size)
            assert close_code(opened) in (1009, None)
    # A frame that only announces its size.
    announced = raw(server.address, handshake(server.address))
    announced.recv(4096)
    announced.sendall(b"\x81\xff" + (10**17).to_bytes(8, "big") + b"mask" + b"x" * 1000)
    assert closed(announced)
    assert page.ok("ping")
    assert server.memory_mb() < before_mb + 30


def handshake(address: Address) -> bytes:
    lines = (
        f"GET {address.websocket.partition(address.host)[2]} HTTP/1.1",
        f"Host: {address.host}",
        f"Origin: {address.origin}",
        f"Cookie: {address.cookie}",
        "Connection: Upgrade",
        "Upgrade: websocket",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        "",
        "",
    )
    return "\r\n".join(lines).encode()


def closed(opened: socket.socket) -> bool:
    """Wait until the server closes a connection."""
    opened.settimeout(PATIENCE_S)
    try:
        while opened.recv(65536):
            pass
    except ConnectionError:
        pass
    opened.close()
    return True


def test_odd_requests(server: Dashboard, page: Browser) -> None:
    for text in (
        b"\x00\x01\x02\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 100_000,
        b"GET / HTTP/1.1\r\nHost: \xff\r\nCookie: \xff\r\n\r\n",
        b"GET /?token=%ff%00&token HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n",
        b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\nHost: x\r\n\r\nffffffffff\r\n",
    ):
        with ExitStack() as stack:
            try:
                opened = stack.enter_context(raw(server.address, text))
                answer = opened.recv(100)
            except ConnectionError:
                continue
            assert answer[:10] in (b"", b"HTTP/1.1 4"), text[:40]
    assert page.ok("ping")


def test_browsers_and_subscriptions_have_a_limit(server: Dashboard) -> None:
    with ExitStack() as stack:
        pages: list[Browser] = []

        def are_all_open() -> bool:
            """Open one more; the server may still count a connection that was just closed."""
            with suppress(ConnectionClosed):
                pages.append(stack.enter_context(browser(server.address)))
            return len(pages) == MAX_CONNECTIONS

        wait_until(are_all_open, "as many pages as are possible")
        with websocket(server.address) as one_more, pytest.raises(ConnectionClosed) as caught:
            one_more.recv(timeout=PATIENCE_S)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1013
        for number in range(64):
            pages[0].subscribe("echo", topic=f"/nothing_{number}")
        assert pages[0].error("subscribe", channel="nodes", params={})["code"] == "too_many"
        assert pages[1].ok("ping")


def test_images_are_sampled_and_made_smaller(page: Browser) -> None:
    page.subscribe("image", topic="/camera", max_hz=10, max_width=320)
    page.wait(lambda: len(page.pictures) >= 3 and page.pictures[-1][0]["dropped"])
    header, pixels = page.pictures[-1]
    assert (header["width"], header["height"]) == (320, 240)
    assert (header["source_width"], header["source_encoding"]) == (640, "rgb8")
    assert header["dropped"] > 0
    assert pixels[:4] == bytes((10, 20, 30, 255))
    assert len(pixels) == 320 * 240 * 4
    page.subscribe("image", topic="/camera/compressed")
    page.wait(lambda: page.pictures[-1][0]["encoding"] == "png")
    assert page.pictures[-1][1].startswith(b"\x89PNG")
    assert "has no pictures" in page.failure(page.subscribe("image", topic="/rosout"))["message"]


def test_a_client_that_never_reads_costs_no_memory(server: Dashboard, page: Browser) -> None:
    subscriptions = {
        "image": {"topic": "/camera", "max_hz": 15, "max_width": 640},
        "echo": {"topic": "/camera", "max_hz": 100, "max_items": 1024},
        "plot": {"series": [{"topic": "/camera", "field": "width"}]},
        "nodes": {},
    }
    with ExitStack() as stack:
        for _ in range(5):
            opened = stack.enter_context(raw(server.address, handshake(server.address)))
            opened.recv(4096)
            for number, (channel, parameters) in enumerate(subscriptions.items()):
                request = {"id": number, "op": "subscribe", "channel": channel}
                opened.sendall(frame(json.dumps(request | {"params": parameters}).encode()))
        count = page.subscribe("plot", series=[{"topic": "/camera", "field": "height"}])
        page.until(count, bool)
        before_mb = server.memory_mb()
        received = len(page.updates)

        def images() -> int:
            """Return how many images this browser has received since the others have stalled."""
            return sum(
                len(update["data"]["series"][0]["values"])
                for update in page.updates[received:]
                if update["sub"] == count and "data" in update
            )

        page.wait(lambda: images() > 60)  # in two seconds, 37 MB for each of the others
        assert server.memory_mb() < before_mb + 60
        assert page.ok("ping")


def test_a_request_must_be_complete_in_time(
    incomplete: tuple[socket.socket, socket.socket], server: Dashboard
) -> None:
    idle, slow = incomplete
    assert answer_of(slow).startswith(b"HTTP/1.1 408 ")
    assert closed(slow)
    assert idle.recv(100) == b""  # a browser that uses it just then would take it for a response
    with browser(server.address) as other:
        assert other.ok("ping")


def frame(text: bytes) -> bytes:
    """Return a masked WebSocket frame with a short text."""
    assert len(text) < 65536
    return b"\x81\xfe" + len(text).to_bytes(2, "big") + bytes(4) + text
