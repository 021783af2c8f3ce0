"""Lifecycle requests from another process: many at once, repeated, and of nodes that hang."""

from __future__ import annotations

import re
import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from composer.runtime.supervision.events import BroughtUp, Stuck
from tests.ros.supervision.test_external_transitions import LifecycleManager
from tests.ros.support import commands, in_process
from tests.ros.support.in_process import Peer, finished, wait_until
from tests.ros.support.system_process import RunningSystem, write_system

SYSTEM = """
system: subject
nodes:
  subject:
    lifecycle: {autostart: unconfigured}
    subscriptions: {input: {type: std_msgs/msg/String, external: true, log: x}}
    publishers: {output: {type: std_msgs/msg/String, external: true}}
    services: {trigger: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}}
    clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
    action_servers:
      serve:
        {type: composer_interfaces/action/Navigate, external: true, result: {success: true}}
    action_clients: {send: {type: composer_interfaces/action/Navigate, external: true}}
    timers: {tick: {period_ms: 1000, log: x}}
  other:
    services: {alive: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}}
"""
SERVICES = "service list --all --show-types"
#: Commands that list the ROS graph and the node. Actions are among the topics and services.
LISTS = ("topic list --all --show-types", SERVICES, "node list", "node info /subject --all")
PORTS = ("input", "output", "trigger", "ask", "serve", "send")
CYCLE = ("configure", "activate", "deactivate", "cleanup")
#: The allowed growth of memory: at most 10 MB after a thousand cycles.
KILOBYTES_AT_ALL, KILOBYTES_PER_CYCLE = 2000, 8


@contextmanager
def running(folder: Path) -> Iterator[RunningSystem]:
    path = write_system(folder, SYSTEM)
    with RunningSystem(str(path)) as system:
        system.wait_for("1 of 2 nodes active")
        yield system


#: Enough that requests wait in the queue of the server, and each client sends all kinds.
CLIENTS, REQUESTS = 5, 80


def test_all_requests_get_a_response(tmp_path: Path, peer: Peer) -> None:
    """From several nodes at once, with wrong ids and in wrong states."""
    with running(tmp_path) as system:
        wanted = (*CYCLE, "nonsense", 99, 0, Transition.TRANSITION_DESTROY)
        requests = [("/subject", transition) for transition in wanted] * REQUESTS
        clients = [
            LifecycleManager(peer, ["/subject"], requests[first : first + REQUESTS])
            for first in range(CLIENTS)
        ]
        peer.wait_until_known("/subject")
        for client in clients:
            client.send()
        wait_until(
            lambda: all(len(client.answers) == REQUESTS for client in clients), "the answers"
        )
        answers = [answer for client in clients for answer in client.answers]
        assert any(answers)
        assert peer.state("/subject") in ("unconfigured", "inactive", "active")
        assert peer.call(Trigger, "/alive").success
        assert system.stop()[0] == 0
    stopping = next(place for place, line in enumerate(system.lines) if "shutting down:" in line)
    reported = [line for line in system.lines[:stopping] if "[compose] /subject" in line]
    assert sum(answers) == len(reported), "each success is a change of state, and vice versa"


class Usage:
    """The resources of the process of a system, and its endpoints in the ROS graph."""

    def __init__(self, system: RunningSystem, peer: Peer) -> None:
        self._process = Path("/proc", str(system.process.pid))
        self._peer = peer

    @property
    def resident_kilobytes(self) -> int:
        for line in (self._process / "status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1])
        raise AssertionError("no VmRSS")

    @property
    def open_files(self) -> Counter[str]:
        """Count the targets of the open file descriptors."""
        targets = Counter[str]()
        for descriptor in (self._process / "fd").iterdir():
            with suppress(FileNotFoundError):  # closed in the meantime
                targets[str(descriptor.readlink())] += 1
        return targets

    @property
    def graph(self) -> set[str]:
        """The known topics and services."""
        node = self._peer.node
        known = (*node.get_topic_names_and_types(), *node.get_service_names_and_types())
        return {name for name, _ in known}

    @property
    def ports(self) -> set[str]:
        """Those of them that the node creates when it is configured."""
        return {name for name in self.graph if name.split("/")[1] in PORTS}


def lists_of_a_new_process() -> dict[str, str]:
    """Return the lists in new processes, which know nothing of earlier endpoints."""
    processes = {words: commands.start(*words.split()) for words in LISTS}
    return {words: commands.finished(process) for words, process in processes.items()}


@pytest.mark.parametrize(
    "cycles", [60, pytest.param(1000, marks=[pytest.mark.soak, pytest.mark.timeout(900)])]
)
def test_cycles_leave_nothing_behind(tmp_path: Path, peer: Peer, cycles: int) -> None:
    with running(tmp_path) as system:
        usage, fresh = Usage(system, peer), lists_of_a_new_process()
        assert "/alive" in fresh[SERVICES]
        assert "/trigger" not in fresh[SERVICES]

        def cycle(times: int) -> None:
            for _ in range(times):
                for transition in CYCLE:
                    assert peer.change("/subject", transition), transition

        cycle(20)  # what is created once, and what an allocator keeps
        wait_until(lambda: "/alive" in usage.graph and not usage.ports, "no ports")
        kilobytes, files = usage.resident_kilobytes, usage.open_files
        cycle(cycles)
        grown = usage.resident_kilobytes - kilobytes
        print(f"{cycles} cycles: {grown} kB more, {files} became {usage.open_files}")
        assert grown < KILOBYTES_AT_ALL + KILOBYTES_PER_CYCLE * cycles
        # A reference cycle may keep a file open until the next collection, which an idle process
        # does not have.
        wait_until(lambda: cycle(1) or usage.open_files <= files, "no more open files")
        wait_until(lambda: not usage.ports, "no ports again")
        assert lists_of_a_new_process() == fresh
        assert peer.change("/subject", "configure")
        wait_until(lambda: len(usage.ports) > 10, "ports")
        assert system.stop()[0] == 0


FAILURES = {
    "events": "on_activate does not return",
    "single_threaded": "on_activate does not return",
    # Another thread ends the transition, although the handler never returns.
    "multi_threaded": "activate ended in an error: TransitionTimeout: timed out after 1 s",
}
KINDS = tuple(FAILURES)
STUCK = """
system: robot
executors: {events: {kind: events}, single_threaded: {kind: single_threaded},
  multi_threaded: {kind: multi_threaded}}
nodes:
  other:
    services: {alive: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}}
"""
STUCK_NODE = """
  KIND:
    executor: KIND
    behavior: stuck:Stuck
    lifecycle: {timeout_ms: 1000, autostart: inactive}
"""
STUCK_MODULE = """
import time
from composer.behavior import Behavior


class Stuck(Behavior):
    def on_activate(self):
        time.sleep(60.0)  # in C, which Python cannot interrupt
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    nodes = "".join(STUCK_NODE.replace("KIND", kind) for kind in KINDS)
    return write_system(tmp_path, STUCK + nodes, stuck=STUCK_MODULE)


def test_a_request_is_answered_and_other_nodes_continue(path: Path, peer: Peer) -> None:
    request = ChangeState.Request(transition=Transition(label="activate"))
    with RunningSystem(str(path)) as system:
        system.wait_for("1 of 4 nodes active")
        clients = [peer.client(ChangeState, f"/{kind}/change_state") for kind in KINDS]
        answers = [client.call_async(request) for client in clients]
        for kind in KINDS:
            system.wait_for(rf"/{kind} is stuck and did not return from on_activate within 3000 ms")
            system.wait_for(rf"/{kind}(, /\w+)* failed: {FAILURES[kind]}; isolating it")
        assert not any(finished(answer).success for answer in answers)
        wait_until(lambda: system.output.count("time.sleep(60.0)") >= 3, "the stacks")
        assert peer.call(Trigger, "/alive").success
        down = "/events is isolated: on_activate does not return"
        # The response and the report of the failure come before its handling.
        wait_until(lambda: down in peer.call(Trigger, "/robot/manager/is_active").message, down)

        code, _ = system.stop(signal.SIGTERM)  # waits less than the transitions would take
    assert code == 1
    assert "/other finalized" in system.output
    assert "never awaited" not in system.output
    for kind in KINDS:
        state = "finalized" if kind == "multi_threaded" else "activating"
        assert re.search(rf"^/{kind} +{state} ", system.output, re.MULTILINE), kind


def test_a_transition_that_waits_for_a_busy_executor_is_not_stuck(tmp_path: Path) -> None:
    """Each takes a part of its time limit; the last one waits longer than its limit."""
    nodes = "".join(f"  n{number}: {{behavior: slow:Slow}}\n" for number in range(12))
    text = f"system: slow\nlifecycle: {{timeout_ms: 3000}}\nnodes:\n{nodes}"
    slow = """
    import time

    class Slow:
        def on_configure(self):
            time.sleep(0.3)  # a tenth of its limit
    """
    with in_process.running(text, tmp_path, slow=slow) as system:
        (up,) = system.reported(BroughtUp)
        assert (up.active, up.is_complete, up.remarks) == (12, True, ())
        assert not system.reported(Stuck)
        assert system.stop().exit_code == 0
