"""Services of a running node respond to requests, or fail them."""

from __future__ import annotations

from pathlib import Path

import pytest
from std_srvs.srv import Empty, SetBool, Trigger

from tests.ros.support.in_process import Peer, finished, running

STUB = """
system: stub
nodes:
  stub:
    services:
      trigger:
        type: std_srvs/srv/Trigger
        external: true
        when: count < 2
        log: "request {count}"
        respond: {success: true, message: "answer {count} of {node}"}
      empty: {type: std_srvs/srv/Empty, external: true}
"""


def test_refusals_and_declared_responses(tmp_path: Path, peer: Peer) -> None:
    with running(STUB, tmp_path) as system:
        assert peer.change("/stub", "deactivate")
        refusal = peer.call(Trigger, "/trigger")
        assert (refusal.success, refusal.message) == (False, "/stub is inactive, not active")
        unanswered = peer.client(Empty, "/empty").call_async(Empty.Request())
        system.wait_for_log("service 'empty' refuses a request: /stub is inactive, not active")
        assert peer.change("/stub", "activate")
        answers = [peer.call(Trigger, "/trigger") for _ in range(3)]
        assert [(answer.success, answer.message) for answer in answers] == [
            (True, "answer 0 of /stub"),
            (True, "answer 1 of /stub"),
            (False, ""),  # the default one: 'when' is false
        ]
        assert system.log()[1:] == ["request 0", "request 1"]
        assert peer.call(Empty, "/empty") == Empty.Response()
        assert not unanswered.done()  # a response would look like a result


ADDING = """
system: adding
nodes:
  away: {behavior: "adding:Adder", services: {away: {type: rcl_interfaces/srv/GetParameters}},
         lifecycle: {autostart: inactive}}
  adder: {behavior: "adding:Adder", services: {adder: {type: rcl_interfaces/srv/GetParameters}}}
  caller:
    behavior: adding:Caller
    clients:
      away: {type: rcl_interfaces/srv/GetParameters}
      adder: {type: rcl_interfaces/srv/GetParameters}
    timers: {tick: {period_ms: 10}}
"""
ADDING_MODULE = """
from composer.behavior import Behavior, CallError

class Adder(Behavior):
    def on_adder(self, request, response):
        raise KeyError("two")

    on_away = on_adder

class Caller(Behavior):
    async def on_tick(self):
        for client in (self.clients.away, self.clients.adder):
            try:
                await client.call(client.service_type.Request())
            except CallError as error:
                self.log.info(f"{type(error).__name__}: {error}")
"""


def test_a_caller_of_the_process_gets_an_error_where_a_response_would_look_like_a_result(
    tmp_path: Path,
) -> None:
    with running(ADDING, tmp_path, adding=ADDING_MODULE) as system:
        system.wait_for_log("ServerUnavailable: service '/away': /away is inactive, not active")
        system.wait_for_log("CallError: service '/adder': on_adder: KeyError: 'two'")


HANDLED = """
system: handled
executors: {shared: {kind: KIND}}
nodes:
  handled:
    executor: shared
    behavior: handled:Handled
    services:
      set: {type: std_srvs/srv/SetBool, external: true, respond: {message: "prefilled"}}
      plain: {type: std_srvs/srv/Trigger, external: true}
      deferred: {type: std_srvs/srv/Trigger, external: true}
"""
MODULE = """
from composer.behavior import Behavior

class Handled(Behavior):
    def on_set(self, request, response):
        response.success = request.data
        return response

    def on_plain(self, request, response):
        OUTCOME

    async def on_deferred(self, request, response):
        await self.clock.sleep(0.001)
        OUTCOME
"""
KINDS = ["events", "multi_threaded"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_handler_gets_the_declared_response_and_returns_its_own(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    module = MODULE.replace("OUTCOME", 'response.message = "fine"; return response')
    with running(HANDLED.replace("KIND", kind), tmp_path, handled=module):
        answer = peer.call(SetBool, "/set", SetBool.Request(data=True))
        plain, deferred = (peer.call(Trigger, name) for name in ("/plain", "/deferred"))
    assert (answer.success, answer.message) == (True, "prefilled")
    assert (plain.message, deferred.message) == ("fine", "fine")


def test_pending_requests_are_refused_when_the_node_leaves_active(
    tmp_path: Path, peer: Peer
) -> None:
    module = MODULE.replace("OUTCOME", "await_forever = None").replace(
        "await self.clock.sleep(0.001)", "self.log.info('begun'); await self.clock.sleep(60.0)"
    )
    with running(HANDLED.replace("KIND", "events"), tmp_path, handled=module) as system:
        client = peer.client(Trigger, "/deferred")
        first = client.call_async(Trigger.Request())
        system.wait_for_log("begun")
        waiting = client.call_async(Trigger.Request())
        assert peer.change("/handled", "deactivate")
        answers = [finished(first), finished(waiting)]
    assert [answer.success for answer in answers] == [False, False]
    assert "/handled is deactivating, not active" in answers[0].message
    assert "not active" in answers[1].message  # it may arrive a moment later
    assert system.end().exit_code == 0
    assert system.end().nodes[0].errors == 0
