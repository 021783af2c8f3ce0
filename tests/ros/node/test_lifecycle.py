"""Every transition ends in a primary state, and every request gets a response."""

from __future__ import annotations

import gc
from collections.abc import Coroutine
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions
from std_srvs.srv import Trigger

from composer.runtime.node.interruption import CallbackInterrupted
from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, finished, running, wait_until

SUBJECT = """
system: subject
nodes:
  subject:
    lifecycle: {autostart: unconfigured}
    behavior: subject:Subject
  other:
    services:
      trigger: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}
"""
QUIET = """
from composer.behavior import Behavior

class Subject(Behavior):
    pass
"""


def test_services_and_events_report_every_state_and_transition(tmp_path: Path, peer: Peer) -> None:
    with running(SUBJECT, tmp_path, subject=QUIET) as system:
        events = peer.listen(TransitionEvent, "/subject/transition_event")
        wait_until(lambda: peer.node.count_publishers("/subject/transition_event"))
        assert peer.state("/subject") == "unconfigured"
        for transition, state in (
            ("configure", "inactive"),
            ("activate", "active"),
            ("deactivate", "inactive"),
            ("cleanup", "unconfigured"),
            ("shutdown", "finalized"),
        ):
            assert peer.change("/subject", transition)
            assert peer.state("/subject") == state
        wait_until(lambda: len(events) == 10)
        states = peer.call(GetAvailableStates, "/subject/get_available_states").available_states
        legal = peer.call(GetAvailableTransitions, "/other/get_available_transitions")
        graph = peer.call(GetAvailableTransitions, "/other/get_transition_graph")
    assert [(event.start_state.label, event.goal_state.label) for event in events[:4]] == [
        ("unconfigured", "configuring"),
        ("configuring", "inactive"),
        ("inactive", "activating"),
        ("activating", "active"),
    ]
    assert len(states) == 11
    labels = {entry.transition.label for entry in legal.available_transitions}
    assert labels == {"deactivate", "shutdown"}
    assert len(graph.available_transitions) > 20
    assert system.states("/subject") == [
        "/subject inactive",
        "/subject active",
        "/subject inactive",
        "/subject unconfigured",
        "/subject finalized",
    ]


def test_invalid_requests_are_refused_and_change_nothing(tmp_path: Path, peer: Peer) -> None:
    with running("{system: subject, nodes: {subject: {}}}", tmp_path) as system:
        for transition in (
            0, 99, 255, Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CONFIGURE,
            Transition.TRANSITION_CREATE, Transition.TRANSITION_DESTROY,
            Transition.TRANSITION_INACTIVE_SHUTDOWN, Transition.TRANSITION_ON_CONFIGURE_SUCCESS,
            Transition.TRANSITION_ON_ERROR_ERROR, "nonsense", "transition_success", "activate",
        ):  # fmt: skip
            assert not peer.change("/subject", transition)
            assert peer.state("/subject") == "active"
        assert (
            "refused 'activate': the node is active; available transitions: deactivate, shutdown"
            in system.log()
        )
        assert peer.change("/subject", Transition.TRANSITION_ACTIVE_SHUTDOWN)
        assert peer.state("/subject") == "finalized"
        assert not peer.change("/subject", "shutdown")


def test_a_late_interrupt_of_a_transition_leaves_no_coroutine_behind(
    tmp_path: Path,
    peer: Peer,
    monkeypatch: pytest.MonkeyPatch,
    recwarn: pytest.WarningsRecorder,
) -> None:
    failing = QUIET.replace("pass", "def on_configure(self):\n        raise ValueError('no map')")
    gc.collect()
    recwarn.clear()  # warnings about earlier tests
    with running(SUBJECT, tmp_path, subject=failing) as system:
        node = system.node("subject")
        loop = node.loop
        run_task = loop.run_task

        def interrupt(work: Coroutine[Any, Any, Any]) -> Any:
            if node.state == "errorprocessing":
                raise CallbackInterrupted
            return run_task(work)

        monkeypatch.setattr(loop, "run_task", interrupt)
        assert not peer.change("/subject", "configure")
        assert peer.state("/subject") == "finalized"
        gc.collect()
    assert [str(warning.message) for warning in recwarn if "awaited" in str(warning.message)] == []


OUTCOMES = [
    ("pass", "success"),
    ("return True", "success"),
    ("return False", "failure"),
    ("raise TransitionFailed('not now')", "failure"),
    ("return 'nonsense'", "error"),
    ("raise ValueError('broken')", "error"),
    ("raise SystemExit(1)", "error"),
    ("raise KeyboardInterrupt", "error"),
    ("raise GeneratorExit", "error"),
    ("raise WithoutText", "error"),
]
#: transition -> (transitions before it, state after success, after a refusal, after an error)
TRANSITIONS = {
    "configure": ([], "inactive", "unconfigured", "unconfigured"),
    "activate": (["configure"], "active", "inactive", "unconfigured"),
    "deactivate": (["configure", "activate"], "inactive", "active", "unconfigured"),
    "cleanup": (["configure"], "unconfigured", "inactive", "unconfigured"),
    "shutdown": (["configure", "activate"], "finalized", "finalized", "unconfigured"),
}
DOWN = {"inactive": ("cleanup",), "active": ("deactivate", "cleanup")}
OUTCOMES_SYSTEM = """
system: outcomes
nodes:
  plain:
    lifecycle: {autostart: unconfigured}
    parameters: {outcome: -1}
    behavior: subject:Plain
  async:
    lifecycle: {autostart: unconfigured}
    parameters: {outcome: -1}
    behavior: subject:Async
  other:
    services:
      trigger: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}
"""


def has_event(events: list[TransitionEvent], state: str) -> bool:
    return bool(events) and events[-1].goal_state.label == state


def outcomes_module(transition: str) -> str:
    """Return behaviors whose handler of a transition has each outcome, plain and ``async``."""
    module = """
from composer.behavior import Behavior, TransitionFailed

class WithoutText(Exception):
    def __str__(self):
        raise RuntimeError("no text")

class Subject(Behavior):
    def on_error(self, cause):
        self.log.info(f"cause: {type(cause).__name__}")
"""
    for name, prefix, wait in (("Plain", "", ""), ("Async", "async ", "await ")):
        module += f"""
class {name}(Subject):
    {prefix}def on_{transition}(self):
        if self.parameters.outcome >= 0:
            return {wait}getattr(self, f"outcome_{{self.parameters.outcome}}")()
"""
        for number, (body, _) in enumerate(OUTCOMES):
            module += f"\n    {prefix}def outcome_{number}(self):\n        {body}\n"
    return module


@pytest.mark.parametrize("transition", TRANSITIONS)
def test_every_outcome_of_a_handler_leads_to_a_primary_state(
    tmp_path: Path, peer: Peer, transition: str
) -> None:
    before, *ends = TRANSITIONS[transition]
    with running(OUTCOMES_SYSTEM, tmp_path, subject=outcomes_module(transition)) as system:
        for node in ("/plain", "/async"):
            events = peer.listen(TransitionEvent, f"{node}/transition_event")
            for number, (body, outcome) in enumerate(OUTCOMES):
                if transition == "shutdown" and outcome != "error":
                    continue  # no transition leaves finalized
                for step in before:
                    assert peer.change(node, step)
                assert peer.set_parameter(node, "outcome", number) == ""
                answer = peer.change(node, transition)
                assert answer is (outcome == "success"), body
                end = ends[("success", "failure", "error").index(outcome)]
                assert peer.state(node) == end, body
                wait_until(partial(has_event, events, end), f"the event of {end}")
                assert peer.set_parameter(node, "outcome", -1) == ""
                for step in DOWN.get(end, ()):
                    assert peer.change(node, step)
                assert peer.call(Trigger, "/trigger").success, "the other node still works"
    for node in ("plain", "async"):
        lines = [event.message for event in system.reported(Logged) if event.logger == node]
        log = "\n".join(lines)
        assert f"on_{transition}: ValueError: broken\nTraceback" in log
        assert f"on_{transition}: WrongReturn: on_{transition} returned 'nonsense'" in log
        assert "cause: SystemExit" in log
        if transition != "shutdown":
            assert f"on_{transition} refused the transition: not now" in log


def test_requests_during_a_transition_are_refused_and_endless_ones_fail(
    tmp_path: Path, peer: Peer
) -> None:
    module = """
    from composer.behavior import Behavior
    from composer.runtime.executors.futures import Future

    class Subject(Behavior):
        async def on_configure(self):
            self.log.info("begin")
            while not self.parameters.may_end:
                await self.clock.sleep(0.01)

    class Endless(Behavior):
        async def on_configure(self):
            await Future()
    """
    text = SUBJECT.replace("    behav", "    parameters: {may_end: false}\n    behav")
    limits = "{autostart: unconfigured, timeout_ms: 200}"
    text += f"  endless: {{behavior: subject:Endless, lifecycle: {limits}}}\n"
    with running(text, tmp_path, subject=module) as system:
        client = peer.client(ChangeState, "/subject/change_state")
        request = ChangeState.Request(transition=Transition(label="configure"))
        pending = client.call_async(request)
        system.wait_for_log("begin")
        assert peer.state("/subject") == "configuring"
        assert not finished(client.call_async(request)).success
        assert not pending.done(), "refused at once"
        assert peer.set_parameter("/subject", "may_end", True) == ""
        assert finished(pending).success
        assert peer.state("/subject") == "inactive"
        assert not peer.change("/endless", "configure")
        assert peer.state("/endless") == "unconfigured"
    log = system.log_text()
    assert "refused 'configure': the node is configuring; available transitions: none" in log
    assert "on_configure: TransitionTimeout: timed out after 0.2 s" in log


def test_repeated_requests_that_are_refused_do_not_fill_the_log(tmp_path: Path, peer: Peer) -> None:
    with running("{system: calm, nodes: {subject: {}}}", tmp_path) as system:
        client = peer.client(ChangeState, "/subject/change_state")
        peer.wait_until_known("/subject")
        for number in range(100):
            label = f"\x1b[2J{number}" + 900 * "x"  # longer ones are refused unread
            request = ChangeState.Request(transition=Transition(label=label))
            assert not finished(client.call_async(request)).success
        assert not peer.change("/subject", "activate")
        refused = [line for line in system.log() if line.startswith("refused")]
        assert 2 <= len(refused) < 20
        assert "refused 'activate': the node is active" in refused[-1]
        assert max(map(len, refused)) < 500
        assert all(map(str.isprintable, refused))
        assert refused[0].startswith(r"refused '\x1b[2J0xxx")
