"""Hosts that refuse, break or send back what they want: bounded, and shown as part of one line."""

from __future__ import annotations

import asyncio
import json
import os
import stat
import time
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from composer.model import Host, LogLevel, Process
from tests.unit.support.hosts import SPAN, host, located

asyncssh = pytest.importorskip("asyncssh", reason="asyncssh is not installed")
from composer.client.hosts import connection as host_connection  # noqa: E402
from composer.client.hosts import sync  # noqa: E402
from composer.client.hosts.connection import HostError, HostsError  # noqa: E402
from composer.client.hosts.deployment import Deployment, DeploymentOptions, RemoteProcess  # noqa: E402
from composer.client.hosts.inventory import Inventory, Question  # noqa: E402
from composer.client.hosts.start import compare_all, connect_all  # noqa: E402

EVIL = "\x1b[2J\x07evil\u202e\r\n[FATAL] [compose] forged "
HERE = Inventory("3.11", {"numpy": "2.0"}, {}, {"a.yaml": "00"})
LONGEST = 700
#: 500 a second and no longer than 2000 bytes, whatever is sent.
LINES_PER_S, LONGEST_LINE = 500, 2100


async def endless(process: Any) -> None:
    while True:
        process.stdout.write("x" * 100_000)
        await process.stdout.drain()


async def forged_reason(process: Any) -> None:
    process.stderr.write(f"{EVIL}{'y' * 100_000}\n{EVIL}{'y' * 100_000}")
    process.exit(1)


async def forged_answer(process: Any) -> None:
    packages = {"numpy": f"{EVIL}{'9' * 100_000}"}
    answer = {"python": EVIL, "packages": packages, "interfaces": {}, "files": {}}
    process.stdout.write(json.dumps(answer) + "\n")
    process.exit(0)


async def nested_answer(process: Any) -> None:
    process.stdout.write('{"python": ' + "[" * 500_000 + "\n")
    process.exit(0)


async def forged_lines(process: Any) -> None:
    process.stdout.write("[INFO] [compose] ready\n[INFO] [camera] ready\n")
    for _ in range(2000):
        process.stdout.write(f"[FATAL] [planner] {EVIL}{'z' * 5000}\n")
    process.exit(0)


async def serve(
    folder: Path,
    answer: Callable[[Any], Coroutine[Any, Any, None]],
    use: Callable[[Host, Any], Coroutine[Any, Any, None]],
) -> None:
    """Log in at a host whose commands give an answer, and call ``use(host, connection)``."""
    key = asyncssh.generate_private_key("ssh-ed25519")
    key.write_private_key(folder / "key")
    (folder / "key").chmod(0o600)
    key.write_public_key(folder / "authorized")

    server = await asyncssh.create_server(
        asyncssh.SSHServer,
        "127.0.0.1",
        0,
        server_host_keys=[key],
        authorized_client_keys=str(folder / "authorized"),
        process_factory=answer,
    )
    port = server.sockets[0].getsockname()[1]
    known = f"[127.0.0.1]:{port} {key.export_public_key().decode()}"
    (folder / "known").write_text(known)
    keys = {"identity_file": str(folder / "key"), "known_hosts": str(folder / "known")}
    login = {"address": located("127.0.0.1"), "port": port, "user": located("robot")}
    other = host(**login, **keys)
    async with server, AsyncExitStack() as stack:
        connections = await connect_all([other], folder, stack)
        await use(other, connections["jetson"])


async def compare(other: Host, connection: Any) -> None:
    await compare_all([other], {"jetson": connection}, Question(("a.yaml",), ()), HERE)


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (endless, "it sends more than 1 MB as an answer"),
        (forged_reason, "[FATAL] [compose] forged yyy"),
        (forged_answer, "numpy is \\x1b[2J\\x07evil\\u202e\\r\\n[FATAL]"),
        (nested_answer, "answers in another way"),
    ],
)
def test_what_a_host_answers(
    answer: Any, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_connection, "MOST_OUTPUT", 1_000_000)
    with pytest.raises(HostsError) as refusal:
        asyncio.run(serve(tmp_path, answer, compare))
    problems = [text for text, _ in refusal.value.problems]
    assert any(expected in text for text in problems), problems
    for text in problems:
        assert text.startswith("jetson (robot@127.0.0.1): ")
        assert text.isprintable()
        assert len(text) < LONGEST


def test_lines_of_a_process(tmp_path: Path) -> None:
    """They have the label of the process, and its log has no lines of other nodes."""
    written: list[str] = []
    logged: list[tuple[LogLevel, str, str]] = []

    async def run(other: Host, connection: Any) -> None:
        process = Process(located("vision"), SPAN, host=other.name)
        item = RemoteProcess(process, other, ("/camera",))
        coordinator = ("/bin/sh", "-c", "exec sleep 600", "--")
        deployed: Deployment

        def write(text: str) -> None:
            written.append(text)
            if "starting again" in text:
                deployed.end()

        options = DeploymentOptions(
            *(tmp_path, "robot.yaml", (), coordinator, write),
            lambda _, *record: logged.append(record),
        )
        deployed = Deployment([item], options)
        await deployed.run({"jetson": connection})

    began_s = time.monotonic()
    asyncio.run(asyncio.wait_for(serve(tmp_path, forged_lines, run), 100.0))
    passed_s = time.monotonic() - began_s
    assert all(text.startswith("vision@jetson | ") for text in written)
    assert {logger for _, logger, _ in logged} == {"vision", "camera"}
    assert (LogLevel.INFO, "camera", "ready") in logged
    assert (LogLevel.INFO, "vision", "[compose] ready") not in logged
    assert any(message.startswith("[planner] ") for _, _, message in logged)
    assert 0 < len(logged) < LINES_PER_S * (passed_s + 2.0)
    assert max(map(len, written)) < LONGEST_LINE


#: In place of rsync: its messages are those of the host.
RSYNC = """#!/bin/sh
printf '\\033[2Jevil\\r[FATAL] [compose] forged\\n' >&2
[ -e "$(dirname "$0")/endless" ] && exec yes >&2
exit 12
"""


@pytest.mark.parametrize("is_endless", [True, False])
def test_messages_of_rsync(
    is_endless: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sync, "MOST_OUTPUT", 1_000_000)
    program = tmp_path / "rsync"
    program.write_text(RSYNC)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    if is_endless:
        (tmp_path / "endless").touch()
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    options = sync.SyncOptions(tmp_path, excluded=("a",) * 1000)
    started_s = time.monotonic()
    with pytest.raises(HostError) as refusal:
        sync.copy_project(host(), "/robot", options)
    assert time.monotonic() - started_s < 30.0
    expected = "sends more than 1 MB" if is_endless else "rsync failed: \\x1b[2Jevil"
    assert expected in str(refusal.value)
    assert str(refusal.value).isprintable()


def deployment(folder: Path) -> Deployment:
    process = Process(located("vision"), SPAN, host=host().name)
    wait = ("/bin/sh", "-c", "trap '' INT; exec sleep 60", "--")
    options = DeploymentOptions(*(folder, "robot.yaml", (), wait, lambda _: None), lambda *_: None)
    return Deployment([RemoteProcess(process, host())], options)


def test_the_second_request_ends_everything_at_once(tmp_path: Path) -> None:
    deployed = deployment(tmp_path)

    async def silent(*_: object, **__: object) -> None:
        await asyncio.sleep(60.0)

    async def run() -> None:
        connections: Any = {"jetson": SimpleNamespace(create_process=silent, abort=lambda: None)}
        loop = asyncio.get_running_loop()
        for delay_s in (0.5, 0.8):
            loop.call_later(delay_s, deployed.end)
        await asyncio.wait_for(deployed.run(connections), 8.0)

    asyncio.run(run())


@pytest.mark.parametrize(
    ("error", "kind", "text"),
    [
        # A refused session is not tried again. The connection is not lost: it would be closed,
        # and with it all other processes end.
        (
            asyncssh.ChannelOpenError(asyncssh.OPEN_CONNECT_FAILED, "open failed"),
            HostError,
            "refuses another session",
        ),
        # A defect must not leave the system waiting for a process that nothing starts.
        (KeyError("defect"), KeyError, "defect"),
    ],
)
def test_a_refused_session_and_a_defect_end_everything(
    tmp_path: Path, error: Exception, kind: type[Exception], text: str
) -> None:
    async def broken(*_: object, **__: object) -> None:
        raise error

    connection: Any = SimpleNamespace(
        create_process=broken, is_closed=lambda: False, abort=lambda: None
    )
    with pytest.raises(kind, match=text) as raised:
        asyncio.run(deployment(tmp_path).run({"jetson": connection}))
    if isinstance(raised.value, HostError):
        ((_, hint),) = raised.value.problems
        assert "MaxSessions" in str(hint)
