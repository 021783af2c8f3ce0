"""Browsers may come and go at any time: while the dashboard joins, leaves, or ends."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import threading
import time
from typing import Any, Self

import pytest
import uvicorn
from uvicorn.server import ServerState
from websockets.asyncio.client import connect

from composer.client import shared_session
from composer.client.shared_session import SharedSession
from composer.dashboard import ros_side
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.ros_side import RosSide
from composer.dashboard.web.server import WebSocketProtocol
from composer.interfaces import Interfaces
from tests.ros.dashboard.test_foxglove_limits import Unread, raw
from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import Dashboard
from tests.ros.support.in_process import PATIENCE_S, wait_until


def test_a_browser_that_comes_while_leaving_is_served(
    ros_domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    leaving, may_leave = threading.Event(), threading.Event()
    threads: list[threading.Thread] = []

    class SlowToLeave(SharedSession):
        """Leaves the ROS graph for the first time only when it may."""

        def __enter__(self) -> Self:
            threads.append(threading.current_thread())
            return super().__enter__()

        def __exit__(self, *error: object) -> None:
            if threading.current_thread() is threads[0]:
                leaving.set()
                may_leave.wait(PATIENCE_S)
            super().__exit__(*error)

    monkeypatch.setattr(ros_side, "LINGER_S", 0.0)
    monkeypatch.setattr(shared_session, "SharedSession", SlowToLeave)
    ros = RosSide(Feeds(), Forms(Interfaces.load()))
    try:
        ros.enter()
        wait_until(lambda: ros.state == "ready")
        ros.leave()
        assert leaving.wait(PATIENCE_S)
        ros.enter()
        wait_until(lambda: len(threads) == 2 and ros.state == "ready")
        may_leave.set()
        threads[0].join(PATIENCE_S)
        assert ros.state == "ready"
    finally:
        may_leave.set()
        ros.leave()
        ros.close(PATIENCE_S)


#: A browser comes while the dashboard imports rclpy, in the middle of the package.
EARLY_BROWSER = """
import builtins, threading, time
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.ros_side import RosSide
from composer.interfaces import Interfaces

def interrupted(name, *rest):
    if name == "rclpy.signals" and threading.current_thread().name == "prepare":
        side.enter()
        threading.Event().wait(0.5)  # for the thread of the browser
    return found(name, *rest)

found, builtins.__import__ = builtins.__import__, interrupted
side = RosSide(Feeds(), Forms(Interfaces.load()))
side.prepare()
while side.state not in ("ready", "failed"):
    time.sleep(0.01)
print(side.state, side.message)
side.leave()
side.close(5.0)
"""


def test_a_browser_that_comes_during_the_imports_is_served(ros_domain_id: int) -> None:
    command = (sys.executable, "-c", EARLY_BROWSER)
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.returncode) == ("ready \n", 0), done.stderr
    assert "Traceback" not in done.stderr


class EndsMeanwhile(WebSocketProtocol):
    """Of a server that ends just when the other side has closed the connection."""

    def handle_close(self, event: Any) -> None:
        super().handle_close(event)
        self.shutdown()


async def accepting(scope: Any, receive: Any, send: Any) -> None:
    await receive()
    await send({"type": "websocket.accept"})
    await receive()


def test_the_other_side_may_be_closing() -> None:
    failures: list[dict[str, Any]] = []

    async def close() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: failures.append(context))
        config = uvicorn.Config(accepting, lifespan="off", log_config=None)
        config.load()
        server = await loop.create_server(
            lambda: EndsMeanwhile(config, ServerState(), {}), "127.0.0.1", 0
        )
        async with server:
            port = server.sockets[0].getsockname()[1]
            async with connect(f"ws://127.0.0.1:{port}"):
                pass

    asyncio.run(close())
    assert not failures


def test_a_client_that_does_not_read_delays_no_end(ros_domain_id: int) -> None:
    with hand_written("hand_written_camera.py"):
        server = Dashboard()
        with raw(server.address, max_queue=1, close_timeout=0) as client:
            client.subscribe("/camera")
            client.wait(lambda: client.frames)
            unread = Unread(client.socket.socket)
            wait_until(unread.is_full, "full buffers of the operating system")
            started_s = time.monotonic()
            server.process.send_signal(signal.SIGINT)
            assert server.process.wait(timeout=PATIENCE_S) == 0
            assert time.monotonic() - started_s < 10.0
            assert "Traceback" not in server.errors()
