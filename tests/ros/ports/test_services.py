"""Services and their clients: responses, refusals, failures and cancellation."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from std_srvs.srv import Empty, SetBool, Trigger

from composer.model import PrimaryState
from tests.ros.support.in_process import Peer, RunningSystem, finished, running, wait_until

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
      endless: {type: std_srvs/srv/Trigger, external: true}
"""
MODULE = """
from composer.behavior import Behavior

class Handled(Behavior):
    def on_set(self, request, response):
        response.success = request.data
        return response

    def on_plain(self, request, response):
        response.message = "fine"
        return response

    async def on_deferred(self, request, response):
        await self.clock.sleep(0.001)
        return self.on_plain(request, response)

    async def on_endless(self, request, response):
        self.log.info("begun")
        await self.clock.sleep(60.0)
"""
KINDS = ["events", "multi_threaded"]


@pytest.mark.parametrize("kind", KINDS)
def test_handlers_respond_and_pending_requests_are_refused_when_the_node_leaves_active(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(HANDLED.replace("KIND", kind), tmp_path, handled=MODULE) as system:
        answer = peer.call(SetBool, "/set", SetBool.Request(data=True))
        plain, deferred = (peer.call(Trigger, name) for name in ("/plain", "/deferred"))
        client = peer.client(Trigger, "/endless")
        first = client.call_async(Trigger.Request())
        system.wait_for_log("begun")
        waiting = client.call_async(Trigger.Request())
        assert peer.change("/handled", "deactivate")
        refusals = [finished(first), finished(waiting)]
    assert (answer.success, answer.message) == (True, "prefilled")  # the declared response
    assert (plain.message, deferred.message) == ("fine", "fine")
    assert [refusal.success for refusal in refusals] == [False, False]
    assert "/handled is deactivating, not active" in refusals[0].message
    assert "not active" in refusals[1].message  # it may arrive a moment later
    assert system.end().exit_code == 0
    assert system.end().nodes[0].errors == 0


ASKER = """
system: asker
nodes:
  asker:
    clients:
      trigger:
        type: std_srvs/srv/Trigger
        external: true
        timeout_ms: 200
        on_response: {log: "{response.message}, number {count}"}
    timers:
      ask: {period_ms: 50, when: count == 0, call: {trigger: {}}}
"""
ON_FAILURE = """
        on_failure: {log: {level: warn, message: "failed: {failure}"}}
    timers:"""
#: One client reacts to failures, the other does not.
UNSERVED = (
    ASKER.replace("    timers:", ON_FAILURE.lstrip("\n"))
    + """
  plain:
    clients: {trigger: {type: std_srvs/srv/Trigger, external: true, timeout_ms: 200}}
    timers: {ask: {period_ms: 50, when: count == 0, call: {trigger: {}}}}
"""
)


def activate_once_the_server_is_known(system: RunningSystem) -> None:
    """Wait for the server: discovery may take longer than the timeout of the call."""
    wait_until(lambda: system.has_server("asker", "/trigger"), "the server")
    system.change("asker", "activate")


def test_a_declared_call_is_answered(tmp_path: Path, peer: Peer) -> None:
    peer.node.create_service(
        Trigger, "/trigger", lambda _, response: Trigger.Response(message="yes")
    )
    text = ASKER.replace("timeout_ms: 200", "timeout_ms: 20000")
    with running(text, tmp_path, autostart=PrimaryState.INACTIVE) as system:
        activate_once_the_server_is_known(system)
        system.wait_for_log("yes, number 0")
        assert system.summary("/asker").calls == 1


def test_missing_servers_and_responses_are_failures(tmp_path: Path, peer: Peer) -> None:
    """Without a reaction, a failure is logged and counted."""
    no_server = "no server of service '/trigger' was available within 200 ms"
    held = threading.Event()

    def answer_late(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        held.wait(20.0)
        return response

    with running(UNSERVED, tmp_path) as system:
        assert system.wait_for_log("failed") == f"failed: {no_server}"
        assert system.wait_for_log("client 'trigger'") == f"client 'trigger': {no_server}"
        assert system.node("plain").statistics.errors == 1
        peer.node.create_service(Trigger, "/trigger", answer_late)
        system.change("asker", "deactivate", "cleanup", "configure")
        activate_once_the_server_is_known(system)  # it asks again
        line = system.wait_for_log("did not answer")
        held.set()
    assert line == "failed: service '/trigger' did not answer within 200 ms"


CALLER = """
system: caller
executors: {shared: {kind: KIND}}
nodes:
  caller:
    executor: shared
    behavior: caller:Caller
    clients: {trigger: {type: std_srvs/srv/Trigger, external: true, timeout_ms: 30000}}
    timers: {ask: {period_ms: 10}, rest: {period_ms: 10}}
"""
CALLER_MODULE = """
from composer.behavior import Behavior, CallCancelled, ServerUnavailable

class Caller(Behavior):
    async def on_configure(self):
        client = self.clients.trigger
        try:
            client.call("nonsense")
        except TypeError as error:
            self.log.info(str(error))
        try:
            await client.call(client.service_type.Request())
        except CallCancelled as error:
            self.log.info(str(error))
        try:
            self.clients.triger
        except AttributeError as error:
            self.log.info(str(error))

    async def on_ask(self):
        self.log.info("asking")
        try:
            await self.clients.trigger.call(self.clients.trigger.service_type.Request())
        except CallCancelled as error:
            self.log.info(f"cancelled: {error}")
            raise

    async def on_rest(self):
        self.log.info("resting")
        await self.clock.sleep(60.0)

    async def on_deactivate(self):
        try:
            await self.clients.trigger.call(
                self.clients.trigger.service_type.Request(), timeout_ms=20.0
            )
        except ServerUnavailable as error:
            self.log.info(f"last try: {error}")
"""


@pytest.mark.parametrize("kind", KINDS)
def test_errors_are_raised_at_once_and_calls_end_when_the_node_leaves_active(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(CALLER.replace("KIND", kind), tmp_path, caller=CALLER_MODULE) as system:
        system.wait_for_log("asking")
        system.wait_for_log("resting")
        context, _ = system.node("caller").contexts
        assert peer.change("/caller", "deactivate")
        assert peer.state("/caller") == "inactive"
        wait_until(lambda: not context.tasks, "no task is running")
        counted = system.summary("/caller")
    assert system.log()[:3] == [
        "client 'trigger' takes a Trigger.Request, not str",
        "/caller is configuring, not active",
        "no client 'triger'; available: trigger",
    ]
    assert "cancelled: /caller is deactivating, not active" in system.log()
    assert "last try: no server of service '/trigger' was available within 20 ms" in system.log(), (
        "a node may make calls while it deactivates"
    )
    assert counted.errors == 0
