"""The server ends whatever its connections are doing."""

from __future__ import annotations

import asyncio
import signal
import time
from typing import Any

import uvicorn
from uvicorn.server import ServerState
from websockets.asyncio.client import connect

from composer.dashboard.web.server import WebSocketProtocol
from tests.ros.dashboard.test_foxglove_limits import raw
from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import PATIENCE_S, Dashboard


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
            time.sleep(2.0)  # until the buffers of the operating system are full
            started_s = time.monotonic()
            server.process.send_signal(signal.SIGINT)
            assert server.process.wait(timeout=PATIENCE_S) == 0
            assert time.monotonic() - started_s < 10.0
            assert "Traceback" not in server.errors()
