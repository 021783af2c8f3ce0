from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from composer.runtime.process import query_socket
from composer.runtime.process.instance_lock import socket_path
from composer.runtime.process.query_socket import QuerySocket, ask
from composer.runtime.protocol.codec import encode
from composer.runtime.protocol.requests import (
    GraphAnswer,
    GraphQuery,
    GraphView,
    NodesQuery,
    visible_names,
)
from tests.unit.support.waiting import wait_until

VIEW: GraphView = {
    "node": (("/a", ()), ("/_hidden", ())),
    "topic": (("/chatter", ("std_msgs/msg/String", "std_msgs/msg/Int32")),),
    "service": (),
    "action": (("/navigate", ("composer_interfaces/action/Navigate",)),),
}
LIMIT_S = 30.0


def read_graph(system: str, timeout_s: float) -> GraphView | None:
    answer = ask(system, GraphQuery(), timeout_s)
    return None if answer is None else answer.names


@pytest.fixture(autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
    path = socket_path("/robot")
    assert path is not None
    return path.parent


Serve = Callable[[Callable[[], GraphView | None]], list[Exception]]


@pytest.fixture
def serve() -> Iterator[Serve]:
    """Serve a view as the system /robot; return the list of errors."""
    sockets: list[QuerySocket] = []

    def start(view: Callable[[], GraphView | None]) -> list[Exception]:
        def answer(_: object) -> GraphAnswer | None:
            names = view()
            return None if names is None else GraphAnswer(names)

        errors: list[Exception] = []
        sockets.append(QuerySocket("/robot", {GraphQuery: answer}, errors.append))
        return errors

    yield start
    for item in sockets:
        item.close(LIMIT_S)


def connected() -> socket.socket:
    """Return a connection to the system /robot."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(LIMIT_S)
    connection.connect(str(socket_path("/robot")))
    return connection


def names_of_threads(before: set[threading.Thread]) -> list[str]:
    """Return the names of the threads that have started since ``before``."""
    return [thread.name for thread in set(threading.enumerate()) - before]


def test_a_view_arrives_unchanged_and_an_error_is_reported(serve: Serve) -> None:
    topics = tuple((f"/topic_{number}", ("std_msgs/msg/String",)) for number in range(20_000))
    views: list[GraphView | None] = [None, {**VIEW, "topic": topics}, VIEW, VIEW]
    served = iter(views)
    problems = [ValueError("broken")]

    def view() -> GraphView | None:
        if problems:
            raise problems.pop()
        return next(served)

    errors = serve(view)
    assert read_graph("/robot", LIMIT_S) is None
    assert [str(error) for error in errors] == ["broken"]
    assert [read_graph("/robot", LIMIT_S) for _ in views] == views
    assert read_graph("/other", LIMIT_S) is None
    assert visible_names(VIEW["node"]) == (("/a", ()),)


UNKNOWN = f"{encode(NodesQuery())}\n".encode()


@pytest.mark.parametrize("line", [b"", b"\n", b"[1, 2]\n", b"{}\n", UNKNOWN, b"\xff\n"])
def test_an_unknown_query_has_no_answer(line: bytes, serve: Serve) -> None:
    errors = serve(lambda: VIEW)
    with connected() as connection:
        connection.sendall(line)
        connection.shutdown(socket.SHUT_WR)
        assert connection.recv(1) == b""
    assert ask("/robot", NodesQuery(), LIMIT_S) is None
    assert read_graph("/robot", LIMIT_S) is not None
    assert errors == []


def test_the_view_of_another_discovery_range_is_not_used(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    serve(lambda: VIEW)
    # Server and client share an environment here: each reads it once, the server first.
    ranges = iter(["LOCALHOST", "SUBNET"])
    monkeypatch.setattr(query_socket, "discovery_environment", lambda: next(ranges))
    assert read_graph("/robot", LIMIT_S) is None


def test_an_answer_of_another_version_is_not_used(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of_next_version(value: Any) -> str:
        document = json.loads(encode(value))
        return json.dumps(document | {"version": document["version"] + 1})

    serve(lambda: VIEW)
    for kind in (GraphAnswer, GraphQuery):
        monkeypatch.setattr(
            query_socket,
            "encode",
            lambda value, kind=kind: (of_next_version if type(value) is kind else encode)(value),
        )
        assert read_graph("/robot", LIMIT_S) is None


def test_a_system_that_does_not_respond_costs_no_more_than_the_limit(serve: Serve) -> None:
    released = threading.Event()
    serve(lambda: VIEW if released.wait(LIMIT_S) else None)
    began_s = time.monotonic()
    assert read_graph("/robot", 0.02) is None
    assert time.monotonic() - began_s < LIMIT_S / 2
    released.set()


def test_a_query_whose_command_has_given_up_is_skipped(serve: Serve) -> None:
    released, answered = threading.Event(), threading.Semaphore(0)

    def view() -> GraphView:
        answered.release()
        released.wait(LIMIT_S)
        return VIEW

    serve(view)
    with ThreadPoolExecutor() as pool:
        first = pool.submit(read_graph, "/robot", LIMIT_S)
        assert answered.acquire(timeout=LIMIT_S)
        for _ in range(2):
            assert read_graph("/robot", 0.02) is None
        released.set()
        assert first.result(LIMIT_S) == VIEW
    assert read_graph("/robot", LIMIT_S) == VIEW
    assert answered.acquire(blocking=False)
    assert not answered.acquire(blocking=False)


def test_a_slow_command_blocks_only_itself(serve: Serve) -> None:
    """Neither one that sends slowly nor one that does not read its answer."""
    before = set(threading.enumerate())
    topics = tuple((f"/topic_{number}", ()) for number in range(20_000))
    serve(lambda: {**VIEW, "topic": topics})
    with ExitStack() as stack:
        for sent in (b"[", f"{encode(GraphQuery())}\n".encode()) * 8:
            stack.enter_context(connected()).sendall(sent)
        assert read_graph("/robot", LIMIT_S) is not None
    # Each ends within its limit, and with it its thread; a busy machine needs longer.
    wait_until(lambda: "query" not in names_of_threads(before), "all ends", 3 * LIMIT_S)


def test_a_query_that_arrives_after_closing_ends() -> None:
    """Its thread was left for the rest of the process."""
    before = set(threading.enumerate())
    server = QuerySocket("/robot", {GraphQuery: lambda _: GraphAnswer(VIEW)}, lambda _: None)
    with connected() as connection:
        wait_until(lambda: "query" in names_of_threads(before), "the query")
        server.close(LIMIT_S)
        connection.sendall(f"{encode(GraphQuery())}\n".encode())
        wait_until(lambda: "query" not in names_of_threads(before), "the end of the query")
        assert connection.recv(1) == b""


def test_a_command_that_sends_slowly_is_left_in_the_end(serve: Serve) -> None:
    serve(lambda: VIEW)
    with connected() as connection:
        began_s = time.monotonic()
        connection.settimeout(0.1)
        while time.monotonic() < began_s + LIMIT_S:
            try:
                connection.sendall(b" ")
                assert connection.recv(1) == b""
            except TimeoutError:
                continue
            except OSError:
                break
            break
        assert time.monotonic() < began_s + LIMIT_S


def test_the_socket_of_a_killed_process_is_replaced_and_none_is_left(folder: Path) -> None:
    (folder / "left").touch()
    path = socket_path("/robot")
    assert path is not None
    path.touch()
    assert read_graph("/robot", LIMIT_S) is None
    too_long = "/" + "x" * 150
    queries = {GraphQuery: lambda _: GraphAnswer(VIEW)}
    servers = [QuerySocket(name, queries, lambda _: None) for name in ("/robot", too_long)]
    assert read_graph("/robot", LIMIT_S) == VIEW
    assert read_graph(too_long, LIMIT_S) is None
    for server in servers:
        server.close(LIMIT_S)
    assert list(folder.iterdir()) == [folder / "left"]
