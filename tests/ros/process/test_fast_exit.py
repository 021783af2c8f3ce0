"""A large system leaves the ROS graph at once, and nothing of it remains."""

from __future__ import annotations

import re
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from composer.runtime.middleware.shared_memory import SHARED_MEMORY
from tests.ros.support.commands import COMPOSE
from tests.ros.support.in_process import PATIENCE_S, Peer, running, wait_until

NODES = 24
#: The lease of a participant, after which others remove it.
LEASE_S = 20.0
ATTEMPTS = 3
COUNT = f"{NODES} of {NODES} nodes active"


#: Its nodes have a publisher, a subscription and a service each.
LARGE = f"""
system: large
introspection: {{parameters: false, type_description: false}}
nodes:
  node_${{index}}:
    for_each: {{index: {NODES}}}
    publishers: {{output: {{type: std_msgs/msg/String, external: true}}}}
    subscriptions: {{input: {{type: std_msgs/msg/String, external: true}}}}
    services:
      answer:
        type: std_srvs/srv/Trigger
        service: /node_${{index}}/answer
        external: true
        respond: {{success: true}}
    on_cleanup: {{log: cleaned up}}
"""


@pytest.mark.timeout(200)
def test_a_large_system_leaves_the_graph_as_soon_as_it_ends(tmp_path: Path, peer: Peer) -> None:
    path = tmp_path / "large.yaml"
    path.write_text(LARGE, encoding="utf-8")
    # A goodbye message is not acknowledged, so a busy machine may lose one.
    assert any(is_gone_at_once(path, peer) for _ in range(ATTEMPTS))


def is_gone_at_once(path: Path, peer: Peer) -> bool:
    """Run and stop the system; return whether the peer noticed before the lease ended."""
    before = set(SHARED_MEMORY.iterdir())
    command = [*COMPOSE, "run", str(path)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        output = []
        for line in process.stderr:
            output.append(line)
            if COUNT in line:
                break
        client = peer.client(Trigger, "/node_7/answer")
        ours = shared_memory_of(process.pid) - before
        process.send_signal(signal.SIGINT)
        output += process.stderr.readlines()
        code = process.wait(PATIENCE_S)
    text = "".join(output)
    assert code == 0, text
    assert text.count("cleaned up") == NODES
    assert text.index("/node_23 finalized") < text.index("/node_0 finalized")
    assert ours
    assert not [path for path in ours if path.exists()]
    ended_s = time.monotonic()
    while client.service_is_ready() or "node_7" in peer.node.get_node_names():
        assert time.monotonic() - ended_s < 2 * LEASE_S
        time.sleep(0.01)
    return time.monotonic() - ended_s < LEASE_S / 2


def test_a_state_can_be_read_while_the_node_is_destroyed(tmp_path: Path) -> None:
    text = "{system: small, nodes: {'node_${index}': {for_each: {index: 10}}}}"
    states: set[str] = set()
    over = threading.Event()
    with running(text, tmp_path) as system:
        running_nodes = [system.node(f"node_{index}") for index in range(10)]

        def poll() -> None:
            while not over.wait(0.001):
                states.update(node.state for node in running_nodes)

        poller = threading.Thread(target=poll)
        poller.start()
        outcome = system.stop()
        wait_until(lambda: "finalized" in states, "the final state")
        over.set()
        poller.join(PATIENCE_S)
    assert (outcome.exit_code, outcome.hung) == (0, False)
    assert {node.state for node in running_nodes} == {"finalized"}


def shared_memory_of(pid: int) -> set[Path]:
    """Return Fast DDS's files in shared memory that a process uses, except for ports.

    A port remains while another process writes to it.
    """
    text = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8")
    return set(map(Path, re.findall(rf"{SHARED_MEMORY}/fastrtps_[0-9a-f]+\b", text)))
