"""Only those with the token get anything, and the dashboard does nothing without a browser."""

from __future__ import annotations

import http.client
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from composer.runtime.middleware.local_resources import count_participants
from tests.ros.support.commands import COMPOSE, compose, start
from tests.ros.support.dashboard import PATIENCE_S, Address, Browser, Dashboard, browser, dashboard
from tests.ros.support.in_process import wait_until
from tests.ros.support.system_process import RunningSystem

#: Fast DDS never ends this thread, which wakes up once a second.
FAST_DDS_WATCHDOG = "dds.shm.wdog"


@pytest.fixture(scope="module")
def server(shared_domain_id: int) -> Iterator[Dashboard]:
    with dashboard("--read-only") as running:
        yield running


def get(
    address: Address, path: str = "/", method: str = "GET", **headers: str
) -> http.client.HTTPResponse:
    """Return the response to a request with the cookie; an empty header is not sent."""
    given = {"Host": address.host, "Cookie": address.cookie, **headers}
    connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=60)
    connection.putrequest(method, path, skip_host=True)
    for name, value in given.items():
        if value:
            connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    response = connection.getresponse()
    response.body = response.read()  # type: ignore[attr-defined]
    connection.close()
    return response


def test_the_token_becomes_a_cookie_and_leaves_the_address(server: Dashboard) -> None:
    address = server.address
    response = get(address, f"/topics?token={address.token}", Cookie="")
    key = address.websocket.partition("?")[2]
    assert (response.status, response.getheader("Location")) == (303, f"/topics#{key}")
    cookie = response.getheader("Set-Cookie") or ""
    assert cookie == f"{address.cookie}; HttpOnly; SameSite=Strict; Path=/"
    assert address.token not in cookie
    away = get(address, f"//attacker.example/%0d%0aX:%20y?token={address.token}", Cookie="")
    assert away.getheader("Location") == f"/attacker.example/%0D%0AX%3A%20y#{key}"
    assert away.getheader("X") is None


REFUSED = (
    ({"Cookie": ""}, 401, "open the address with the token"),
    ({"Host": "attacker.example"}, 421, "this server is not"),
    ({"Origin": "http://attacker.example"}, 403, "are not allowed"),
    ({"Sec_Fetch_Site": "cross-site"}, 403, "are not allowed"),
)


def test_refused_requests_say_why_and_every_response_has_the_headers_of_a_safe_page(
    server: Dashboard,
) -> None:
    for headers, status, reason in (({}, 200, ""), *REFUSED):
        response = get(server.address, **headers)
        assert response.status == status
        assert reason in response.body.decode()  # type: ignore[attr-defined]
        check_headers(response)
    missing = get(server.address, "/page/%3Cscript%3Ealert(1)%3C/script%3E")
    assert b"<script" not in missing.body  # type: ignore[attr-defined]
    check_headers(missing)
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "ODD"):
        assert get(server.address, method=method).status == 405


def check_headers(response: http.client.HTTPResponse) -> None:
    policy = response.getheader("Content-Security-Policy") or ""
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert response.getheader("X-Content-Type-Options") == "nosniff"
    assert response.getheader("Referrer-Policy") == "no-referrer"
    assert response.getheader("Cross-Origin-Resource-Policy") == "same-origin"
    assert response.getheader("Server") is None


def test_what_is_not_http_gets_a_safe_page_too(server: Dashboard) -> None:
    with socket.create_connection(("127.0.0.1", server.address.port), PATIENCE_S) as opened:
        opened.sendall(b"<b> / HTTP/9.9\r\n\r\n")
        answer = b"".join(iter(lambda: opened.recv(4096), b"")).decode().lower()
    assert answer.startswith("http/1.1 400 bad request")
    assert "content-security-policy: default-src 'none'" in answer
    assert "invalid http request" in answer


NO_FILES_OF_THE_PAGE = (
    "/page/../access.py",
    "/page/%2e%2e/access.py",
    "/page/..%2faccess.py",
    "/page//etc/passwd",
    "/page/%2fetc%2fpasswd",
    "/page/.%00",
    "/page/" + "x" * 5000,
    "/page/graph/page.py",
    "/page/graph/..%2fpage.py",
    "/page",
    "/nothing",
)


def test_only_files_of_the_page_are_served(server: Dashboard) -> None:
    for path in NO_FILES_OF_THE_PAGE:
        response = get(server.address, path)
        assert response.status == 404, path
        assert b"import" not in response.body, path


def test_websockets_of_others_are_refused(server: Dashboard) -> None:
    address = server.address
    for cookie, origin, status in (
        (address.cookie, None, 403),
        ("compose_dashboard=guess", address.origin, 401),
        (address.cookie, "http://127.0.0.1:1", 403),
    ):
        shown: Any = origin
        with pytest.raises(InvalidStatus) as caught:
            connect(address.websocket, origin=shown, additional_headers={"Cookie": cookie})
        assert caught.value.response.status_code == status


#: With the least that a request needs otherwise.
CHANGES = {
    "transition": {"node": "/a", "transition": "activate"},
    "restart": {"node": "/a"},
    "command": {"system": "/a", "command": "shutdown"},
    "call": {"service": "/a", "request": {}},
    "publish": {"topic": "/a", "type": "std_msgs/msg/String", "message": {}},
    "set_parameter": {"node": "/a", "name": "b", "value": 1},
    "record": {"on": True},
    "replay": {"on": True, "bag": "a"},
}


def test_a_read_only_dashboard_changes_nothing(server: Dashboard) -> None:
    goal = {"channel": "goal", "params": {"action": "/a", "type": "t", "goal": {}}}
    publishing = {"channel": "publishing", "params": CHANGES["publish"]}
    with browser(server.address) as page:
        assert page.hello["read_only"] is True
        for op, values in (*CHANGES.items(), ("subscribe", goal), ("subscribe", publishing)):
            assert page.error(op, **values)["code"] == "read_only", op


def count_event_files(server: Dashboard) -> int:
    """Return the number of epoll instances, eventfds and timerfds of the process."""
    count = 0
    for link in Path(f"/proc/{server.process.pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed meanwhile
            count += str(link.readlink()).startswith("anon_inode:")
    return count


def test_nothing_happens_without_a_browser(ros_domain_id: int) -> None:
    with dashboard() as server:
        assert get(server.address, "/page/main.js").status == 200
        assert get(server.address, Cookie="").status == 401
        assert count_participants(ros_domain_id) == 0
        event_files = count_event_files(server)
        with browser(server.address) as page:
            wait_until(lambda: page.ok("ping")["state"] == "ready")
            assert count_participants(ros_domain_id) == 1
            assert count_event_files(server) > event_files
        wait_until(lambda: count_participants(ros_domain_id) == 0)
        wait_until(lambda: count_event_files(server) <= event_files)
        wait_until(lambda: is_asleep(server))
        with browser(server.address) as page:  # and again
            wait_until(lambda: page.ok("ping")["state"] == "ready")


def is_asleep(server: Dashboard) -> bool:
    """Return whether no thread of the process runs within a second, however fast the machine is."""
    before = context_switches(server)
    time.sleep(1.0)  # a measurement
    return context_switches(server) == before


def context_switches(server: Dashboard) -> dict[str, int]:
    """Return how often each thread went to sleep or was interrupted."""
    counts = {}
    for thread in Path(f"/proc/{server.process.pid}/task").iterdir():
        with suppress(FileNotFoundError, ProcessLookupError):  # ended meanwhile
            if (thread / "comm").read_text().strip() == FAST_DDS_WATCHDOG:
                continue
            lines = (thread / "status").read_text().splitlines()
            counts[thread.name] = sum(int(line.split()[1]) for line in lines if "ctxt" in line)
    return counts


def test_a_dashboard_of_a_system_ends_with_it(ros_domain_id: int) -> None:
    with RunningSystem("systems/talker_listener.yaml", "--dashboard", program=COMPOSE) as system:
        url = system.wait_for("dashboard: http").partition(": ")[2]
        page = Browser(Address(url))
        page.until(page.subscribe("nodes"), lambda data: len(data["nodes"]) >= 2)
        token = url.rpartition("=")[2]
        foxglove = system.wait_for("Foxglove and Lichtblick: ws://")
        assert foxglove.endswith(f"/foxglove?token={token}")
        assert token not in command_lines()
        assert system.stop()[0] == 0
        wait_until(lambda: not is_open(url))
        page.close()


def test_a_dashboard_of_a_killed_system_ends(ros_domain_id: int) -> None:
    with RunningSystem("systems/talker_listener.yaml", "--dashboard") as system:
        url = system.wait_for("dashboard: http").partition(": ")[2]
        system.process.send_signal(signal.SIGKILL)
        wait_until(lambda: not is_open(url))


def command_lines() -> str:
    """Return the command lines and environments of all processes, as others may see them."""
    texts = []
    for process in Path("/proc").glob("[0-9]*"):
        for name in ("cmdline", "environ"):
            try:
                texts.append((process / name).read_bytes().decode(errors="replace"))
            except OSError:
                continue
    return "\n".join(texts)


def is_open(url: str) -> bool:
    try:
        get(Address(url))
    except (OSError, http.client.HTTPException):  # it may end within a response
        return False
    return True


#: A browser in the terminal: it loads the page, and runs until its user leaves it.
BROWSER = """#!{python}
import os, pathlib, sys, time, urllib.error, urllib.request
dashboard = os.getppid()
try:
    urllib.request.urlopen(sys.argv[1], timeout={patience_s})
except urllib.error.HTTPError as error:  # without the cookie: it was redirected to /
    pathlib.Path("{seen}").write_text(f"{{sys.argv[1]}} {{error.code}} {{error.url}}")
while os.getppid() == dashboard:
    time.sleep(0.1)
"""


def test_the_browser_opens_the_page(
    shared_domain_id: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, seen = tmp_path / "browser", tmp_path / "seen"
    program.write_text(BROWSER.format(python=sys.executable, patience_s=PATIENCE_S, seen=seen))
    program.chmod(0o700)
    monkeypatch.setenv("BROWSER", str(program))
    with dashboard("--open") as server:
        address = server.address
        key = address.websocket.partition("?")[2]
        expected = f"{address.origin}/?token={address.token} 401 {address.origin}/#{key}"
        wait_until(lambda: seen.exists() and seen.read_text() == expected)


def test_without_a_browser_the_address_is_left_to_the_user(
    shared_domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BROWSER", "")
    monkeypatch.setenv("PATH", "")
    with dashboard("--open") as server:
        wait_until(lambda: "the browser cannot be opened" in server.errors())
        assert get(server.address).status == 200


def test_two_dashboards_use_two_ports(ros_domain_id: int) -> None:
    with ExitStack() as stack:
        addresses = []
        for _ in range(2):
            process = stack.enter_context(start("dashboard"))
            stack.callback(process.terminate)
            assert process.stdout is not None
            addresses.append(Address(process.stdout.readline()))
        one, other = addresses
        assert (other.port != one.port, other.token != one.token) == (True, True)
        assert get(other, Cookie=one.cookie).status == 401
        done = compose("dashboard", "--port", one.port)
        assert (done.returncode, "cannot listen on" in done.stderr) == (1, True)


def test_other_computers_need_a_token_of_the_user(tmp_path: Path) -> None:
    done = compose("dashboard", "--host", "0.0.0.0")
    assert done.returncode == 2
    assert "--host 0.0.0.0 needs --token-file" in done.stderr
    token = tmp_path / "token"
    token.write_text("0123456789abcdef0123456789abcdef")
    done = compose("dashboard", "--token-file", token)
    assert done.returncode == 1
    assert "can be read by other users" in done.stderr
    token.chmod(0o600)
    with dashboard("--token-file", str(token), "--host", "127.0.0.1") as server:
        assert server.address.token == token.read_text()
