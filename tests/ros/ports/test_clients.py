"""Service clients of a running node: responses, failures and cancellation."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

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
    clients:
      trigger: {type: std_srvs/srv/Trigger, external: true, timeout_ms: 30000}
    timers:
      ask: {period_ms: 10}
      rest: {period_ms: 10}
"""
MODULE = """
from composer.behavior import Behavior, CallCancelled, ServerUnavailable

class Caller(Behavior):
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


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_calls_and_sleeps_end_when_the_node_leaves_active(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(CALLER.replace("KIND", kind), tmp_path, caller=MODULE) as system:
        system.wait_for_log("asking")
        system.wait_for_log("resting")
        context, _ = system.node("caller").contexts
        assert peer.change("/caller", "deactivate")
        assert peer.state("/caller") == "inactive"
        wait_until(lambda: not context.tasks, "no task is running")
        counted = system.summary("/caller")
    assert "cancelled: /caller is deactivating, not active" in system.log()
    assert "last try: no server of service '/trigger' was available within 20 ms" in system.log(), (
        "a node may make calls while it deactivates"
    )
    assert counted.errors == 0


def test_errors_in_a_call_are_raised_at_once(tmp_path: Path) -> None:
    module = """
    from composer.behavior import Behavior, CallCancelled

    class Caller(Behavior):
        async def on_configure(self):
            try:
                self.clients.trigger.call("nonsense")
            except TypeError as error:
                self.log.info(str(error))
            try:
                await self.clients.trigger.call(self.clients.trigger.service_type.Request())
            except CallCancelled as error:
                self.log.info(str(error))
            try:
                self.clients.triger
            except AttributeError as error:
                self.log.info(str(error))
    """
    with running(CALLER.replace("KIND", "events"), tmp_path, caller=module) as system:
        pass
    assert system.log() == [
        "client 'trigger' takes a Trigger.Request, not str",
        "/caller is configuring, not active",
        "no client 'triger'; available: trigger",
    ]
