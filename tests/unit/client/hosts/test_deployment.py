"""What ends a system over several computers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from composer.base.source import Located, SourceFile, Span
from composer.model import Host, Process

asyncssh = pytest.importorskip("asyncssh", reason="asyncssh is not installed")
from composer.client.hosts.connection import HostError  # noqa: E402
from composer.client.hosts.deployment import Deployment, DeploymentOptions, RemoteProcess  # noqa: E402

SPAN = Span(SourceFile("robot.yaml"), 1, 1)


def located(text: str) -> Located[str]:
    return Located(text, SPAN)


def deployment(folder: Path, write: Callable[[str], None]) -> Deployment:
    host = Host(located("jetson"), SPAN, located("10.0.0.5"), workspace=located("~/robot"))
    process = Process(located("vision"), SPAN, host=host.name)
    wait = ("/bin/sh", "-c", "trap '' INT; exec sleep 60", "--")
    options = DeploymentOptions(folder, "robot.yaml", (), wait, write, lambda *_: None)
    return Deployment([RemoteProcess(process, host)], options)


def test_the_second_request_ends_everything_at_once(tmp_path: Path) -> None:
    deployed = deployment(tmp_path, lambda _: None)

    async def silent(*_: object, **__: object) -> None:
        await asyncio.sleep(60.0)

    async def run() -> None:
        connections: Any = {"jetson": SimpleNamespace(create_process=silent, abort=lambda: None)}
        loop = asyncio.get_running_loop()
        for delay_s in (0.5, 0.8):
            loop.call_later(delay_s, deployed.end)
        await asyncio.wait_for(deployed.run(connections), 8.0)

    asyncio.run(run())


async def refused(*_: object, **__: object) -> None:
    raise asyncssh.ChannelOpenError(asyncssh.OPEN_CONNECT_FAILED, "open failed")


def test_a_refused_session_is_not_tried_again(tmp_path: Path) -> None:
    """The connection is not lost. It would be closed, and with it all other processes end."""
    deployed = deployment(tmp_path, lambda _: None)
    connection: Any = SimpleNamespace(
        create_process=refused, is_closed=lambda: False, abort=lambda: None
    )
    with pytest.raises(HostError, match="refuses another session") as refusal:
        asyncio.run(deployed.run({"jetson": connection}))
    assert "MaxSessions" in str(refusal.value.hint)


def test_a_defect_ends_everything(tmp_path: Path) -> None:
    """It must not leave the system waiting for a process that nothing starts."""
    deployed = deployment(tmp_path, lambda _: None)

    async def broken(*_: object, **__: object) -> None:
        raise KeyError("defect")

    connections: Any = {"jetson": SimpleNamespace(create_process=broken, abort=lambda: None)}
    with pytest.raises(KeyError, match="defect"):
        asyncio.run(deployed.run(connections))
