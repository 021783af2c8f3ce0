"""Services between co-located nodes: in-process, with the same outcomes as by DDS."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from std_srvs.srv import SetBool

from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

TEXT = """
system: asking
delivery: DELIVERY
executors: {own: {kind: KIND}}
nodes:
  server:
    behavior: asking:Server
    executor: own
    services: {ask: {type: std_srvs/srv/SetBool}}
  client:
    behavior: asking:Client
    clients: {ask: {type: std_srvs/srv/SetBool, timeout_ms: 20000}}
"""
MODULE = """
from composer.behavior import Behavior, BehaviorError
from std_srvs.srv import SetBool

class Server(Behavior):
    def on_configure(self):
        self.asked = []
        self.answers = []

    async def on_ask(self, request, response):
        self.asked.append(request)
        if not request.data:
            await self.clock.sleep(60.0)
        response.success = True
        response.message = f"request {len(self.asked)}"
        self.answers.append(response)
        return response

class Client(Behavior):
    def on_configure(self):
        self.requests = []
        self.answers = []
        self.outcomes = []

    async def ask(self, data, timeout_ms):
        self.requests.append(SetBool.Request(data=data))
        try:
            response = await self.clients.ask.call(self.requests[-1], timeout_ms=timeout_ms)
        except BehaviorError as error:
            self.outcomes.append(type(error).__name__)
        else:
            self.answers.append(response)
            self.outcomes.append((response.success, response.message))

    def ask_and_go(self):
        self.clients.ask.call(SetBool.Request(), timeout_ms=20.0)

    async def ask_at_once(self, limits_ms):
        calls = [self.clients.ask.call(SetBool.Request(), timeout_ms=ms) for ms in limits_ms]
        for limit_ms, call in zip(limits_ms, calls):
            try:
                await call
            except BehaviorError as error:
                self.outcomes.append((type(error).__name__, limit_ms, str(error)))

    async def ask_and_change(self):
        request = SetBool.Request(data=True)
        call = self.clients.ask.call(request)
        request.data = False
        self.answers.append(await call)
"""
COPIED = """
connections:
  - {service: /ask, server: server.ask, clients: client.ask, isolation: copy}
"""
REFUSED = (False, "/server is inactive, not active")


def text_of(delivery: str, kind: str = "events") -> str:
    """Return the system; with ``copy``, the connection requires copies."""
    text = TEXT.replace("KIND", kind)
    if delivery == "copy":
        return text.replace("DELIVERY", "auto") + COPIED
    return text.replace("DELIVERY", delivery)


def ask(system: RunningSystem, data: bool = True, timeout_ms: float | None = None) -> None:
    system.spawn("client", system.behavior("client").ask(data, timeout_ms))


def outcomes(system: RunningSystem, count: int) -> list[Any]:
    """Wait for ``count`` outcomes and return them."""
    known: list[Any] = system.behavior("client").outcomes
    wait_until(lambda: len(known) == count, f"{count} outcomes")
    return known


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
@pytest.mark.parametrize("delivery", ["auto", "copy", "dds"])
def test_calls_have_the_same_outcomes_in_process_and_by_dds(
    tmp_path: Path, kind: str, delivery: str
) -> None:
    with running(text_of(delivery, kind), tmp_path, asking=MODULE) as system:
        client, server = (system.behavior(name) for name in ("client", "server"))
        ask(system)
        assert outcomes(system, 1)[-1] == (True, "request 1")
        assert server.asked == client.requests
        assert server.answers == client.answers
        assert (server.asked[0] is client.requests[0]) is (delivery == "auto")
        assert (server.answers[0] is client.answers[0]) is (delivery == "auto")

        ask(system, data=False, timeout_ms=300.0)
        assert outcomes(system, 2)[-1] == "CallTimeout"
        wait_until(lambda: len(server.asked) == 2, "the request that times out")
        system.node("client").loop.run(client.ask_and_go)  # it is not awaited
        line = system.wait_for_log("did not answer")
        assert line == "client 'ask': service '/ask' did not answer within 20 ms"

        system.change("server", "deactivate")
        ask(system)
        assert outcomes(system, 3)[-1] == REFUSED
        system.change("server", "cleanup")
        # By DDS it is discovered some milliseconds later.
        wait_until(lambda: not system.has_server("client", "/ask"), "the end of the server")
        ask(system, timeout_ms=300.0)
        assert outcomes(system, 4)[-1] == "ServerUnavailable"

        system.change("server", "configure")
        system.change("server", "activate")
        ask(system, data=False)
        server = system.behavior("server")
        wait_until(lambda: server.asked)
        system.change("client", "deactivate")
        assert outcomes(system, 5)[-1] == "CallCancelled"
    counted = {entry.node: (entry.calls, entry.errors) for entry in system.end().nodes}
    assert counted == {"/client": (5, 1), "/server": (4, 0)}


def test_a_server_that_shuts_down_refuses_pending_requests_and_serves_external_clients(
    tmp_path: Path,
) -> None:
    with running(text_of("auto"), tmp_path, asking=MODULE) as system:
        with closing(Peer()) as peer:
            answer = peer.call(SetBool, "/ask", SetBool.Request(data=True))
        assert (answer.success, answer.message) == (True, "request 1")
        ask(system, data=False)
        server = system.behavior("server")
        wait_until(lambda: len(server.asked) == 2)
        system.change("server", "deactivate")
        (success, message), *_ = outcomes(system, 1)
    assert not success
    assert "not active" in message


def test_concurrent_calls_end_each_at_its_own_timeout(tmp_path: Path) -> None:
    text = text_of("auto").replace("asking:Server}", "asking:Server, reentrant: true}")
    with running(text, tmp_path, asking=MODULE) as system:
        system.spawn("client", system.behavior("client").ask_at_once((90.0, 30.0, 60.0)))
        results = outcomes(system, 3)
        assert results == [
            ("CallTimeout", limit, f"service '/ask' did not answer within {limit:g} ms")
            for limit in (90.0, 30.0, 60.0)
        ]


def test_a_copied_request_is_as_it_was_when_sent(tmp_path: Path) -> None:
    with running(text_of("copy"), tmp_path, asking=MODULE) as system:
        client, server = (system.behavior(name) for name in ("client", "server"))
        system.spawn("client", client.ask_and_change())
        wait_until(lambda: client.answers)
        assert [request.data for request in server.asked] == [True]
        server.answers[0].message = "changed afterwards"
        assert client.answers[0].message == "request 1"
