"""The server ends whatever its connections are doing."""

from __future__ import annotations

import asyncio
from typing import Any

import uvicorn
from uvicorn.server import ServerState
from websockets.asyncio.client import connect

from composer.dashboard.web.server import _WebSocketProtocol


class EndsMeanwhile(_WebSocketProtocol):
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
