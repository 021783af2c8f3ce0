"""A system of three processes with a discovery server: found by commands and other ROS programs."""

from __future__ import annotations

import os
import re
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros.support.commands import (
    PATIENCE_S,
    Observer,
    Running,
    code_of_end,
    compose,
    listed,
    observing,
    running,
    start,
)
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import write_system

SYSTEM = """
system: robot
discovery: {{kind: server, address: 127.0.0.1, port: {port}, start: true}}
{processes}
nodes:
  camera:
    publishers: {{image: {{type: std_msgs/msg/String, qos: command}}}}
    timers: {{tick: {{period_ms: 50, publish: {{image: {{data: picture}}}}}}}}
  arm:
    subscriptions:
      image: {{type: std_msgs/msg/String, qos: command, publish: {{move: {{data: go}}}}}}
    publishers: {{move: {{type: std_msgs/msg/String, qos: command}}}}
    lifecycle: {{depends_on: [camera]}}
  logger:
    subscriptions: {{move: {{type: std_msgs/msg/String, qos: command, log: "{{message.data}}"}}}}
"""
PROCESSES = "processes: {sensing: {nodes: [camera]}, acting: {nodes: [arm]}}"
NODES = ("arm", "camera", "logger")
ALL = [*NODES, *["manager"] * 3]


@pytest.fixture(scope="module")
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def written(
    folder: Path, port: int, address: str = "127.0.0.1", processes: str = PROCESSES
) -> Path:
    """Return the path of the system, which is written to ``folder``."""
    text = SYSTEM.replace("127.0.0.1", address)
    return write_system(folder, text.format(port=port, processes=processes))


@pytest.fixture(scope="module")
def system(
    port: int, shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("robot")
    with running(folder / "log.txt", str(written(folder, port))) as run:
        run.wait_for("3 of 3 nodes active")
        yield run


def environment(port: int | None = None) -> dict[str, str]:
    """Return the environment of a program of ROS, with that of a client if there is a ``port``."""
    server = {"ROS_DISCOVERY_SERVER": f"127.0.0.1:{port}", "ROS_SUPER_CLIENT": "TRUE"}
    return {**os.environ, **({} if port is None else server)}


def servers(port: int) -> list[int]:
    """Return the process ids of the servers with this port."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"fast-discovery-server" in words[0] and str(port).encode() in words:
            found.append(int(entry.parent.name))
    return found


def wait_for_messages(observer: Observer, count: int) -> None:
    """Wait until an observer has received ``count`` messages."""
    until_s = time.monotonic() + PATIENCE_S
    while observer.ask()[0] < count:
        assert time.monotonic() < until_s


# The first test, as commands wait for the killed programs of others.
def test_commands_discover_it_without_settings(system: Running) -> None:
    for part, *command in (
        ("/robot/sensing: running, 1 of 1 nodes active", "ps"),
        ("data: go", "topic", "echo", "/move", "--once"),
        ("count: 1", "topic", "info", "/move"),
    ):
        listed((part,), *command)


def test_the_system_and_other_programs_discover_each_other(system: Running, port: int) -> None:
    variables = f"export ROS_DISCOVERY_SERVER=127.0.0.1:{port} ROS_SUPER_CLIENT=TRUE"
    assert f"to discover this system with other tools: {variables}\n" in system.log.read_text()
    with (
        observing("/move", *NODES, environment=environment(port)) as client,
        observing("/move", environment=environment()) as other,
    ):
        client.wait_until_ready()
        known: list[str] = []

        def knows_all() -> bool:
            count, known[:] = client.ask()
            return count > 0 and [name for name in known if name != "observer"] == ALL

        wait_until(knows_all, "messages and all nodes")
        other.wait_until_ready()
        assert other.ask() == (0, ["observer"])


def test_the_server_ends_with_the_system(system: Running, port: int) -> None:
    (pid,) = servers(port)
    ended = system.log.read_text().count("has ended")
    code, _, log = system.stop()
    assert code == code_of_end(log), log
    wait_until(lambda: not Path("/proc", str(pid)).exists(), "the end of the server")
    assert log.count("has ended") == ended  # not reported as a failure


def test_a_system_uses_a_server_that_does_not_end_with_it(port: int, tmp_path: Path) -> None:
    path = written(tmp_path, port, processes="")
    assert compose("hosts", "discovery-server", path, "--ready").returncode == 1
    server = start("hosts", "discovery-server", str(path))
    try:
        listed((), "hosts", "discovery-server", str(path), "--ready")
        running_now = servers(port)
        assert len(running_now) == 1
        assert "runs already\n" in compose("hosts", "discovery-server", path).stderr
        with running(tmp_path / "log.txt", str(path)) as run:
            run.wait_for("3 of 3 nodes active")
            code, _, log = run.stop()
        assert code == code_of_end(log), log
        assert f"discovery server 127.0.0.1:{port} runs already, and is used" in log
        assert servers(port) == running_now
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 0
    wait_until(lambda: not servers(port), "the end of the server")


# The tests from here on start systems of their own: that of the module has ended by now, or was not
# started if only these are run.


@pytest.mark.soak
def test_a_killed_server_is_replaced(port: int, shared_domain_id: int, tmp_path: Path) -> None:
    with (
        running(tmp_path / "log.txt", str(written(tmp_path, port))) as system,
        observing("/move", *NODES, environment=environment(port)) as before,
    ):
        system.wait_for("3 of 3 nodes active")
        before.wait_until_ready()
        (pid,) = servers(port)
        os.kill(pid, signal.SIGKILL)
        system.wait_for("was ended by SIGKILL; the next one starts in 6 s")
        wait_for_messages(before, before.ask()[0] + 20)  # for a second
        assert servers(port) == []
        system.wait_for("is started again")
        (successor,) = wait_until(lambda: servers(port), "the next server")
        assert successor != pid
        with observing("/move", *NODES, environment=environment(port)) as after:
            after.wait_until_ready()
            wait_for_messages(after, after.ask()[0] + 1)
        assert system.stop()[0] == 0


@pytest.mark.soak
def test_clients_discover_a_system_that_starts_after_a_killed_one(
    port: int, shared_domain_id: int, tmp_path: Path
) -> None:
    path = written(tmp_path, port)
    with observing("/move", *NODES, environment=environment(port)) as client:
        with running(tmp_path / "killed.txt", str(path)) as killed:
            killed.wait_for("3 of 3 nodes active")
            client.wait_until_ready()
            killed.process.kill()
            killed.process.wait()
        with running(tmp_path / "next.txt", str(path)) as run:
            run.wait_for("starts in 6 s: the last one was lost")
            assert servers(port) == []
            count, _ = client.ask()  # nothing is sent before the server runs
            run.wait_for("3 of 3 nodes active")
            wait_for_messages(client, count + 1)
            assert run.stop()[0] == 0


@pytest.mark.soak
@pytest.mark.timeout(900)  # 24 starts, which take half of that on one slow processor
def test_clients_discover_a_system_that_starts_after_one_that_has_ended(
    port: int, shared_domain_id: int, tmp_path: Path
) -> None:
    path = written(tmp_path, port)
    for _ in range(12):
        with observing("/move", *NODES, environment=environment(port)) as client:
            for log in ("first.txt", "next.txt"):
                count, _ = client.ask() if log == "next.txt" else (0, [])
                with running(tmp_path / log, str(path)) as run:
                    run.wait_for("3 of 3 nodes active")
                    if log == "first.txt":
                        client.wait_until_ready()
                    wait_for_messages(client, count + 1)
                    assert run.stop()[0] == 0


def test_a_server_of_another_computer_cannot_be_started(tmp_path: Path) -> None:
    done = compose("run", written(tmp_path, 11811, "203.0.113.77"))
    assert done.returncode == 1
    assert "the discovery server cannot be started here: this computer is not 203" in done.stderr


@pytest.mark.soak
def test_the_doctor_starts_the_server_for_its_check(
    port: int, shared_domain_id: int, tmp_path: Path
) -> None:
    assert servers(port) == []
    done = compose("doctor", written(tmp_path, port))
    assert done.returncode == 0, done.stdout
    assert (
        f"discovery server 127.0.0.1:{port} does not run yet: 'compose run' starts" in done.stdout
    )
    assert re.search(rf"discovered each other within .* s through .* 127.0.0.1:{port}", done.stdout)
    assert servers(port) == []
