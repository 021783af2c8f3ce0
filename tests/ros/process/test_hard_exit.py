"""A process ends in time even if a call hangs, leaves the ROS graph, and nothing of it remains."""

from __future__ import annotations

import re
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from composer.runtime.middleware.local_resources import SHARED_MEMORY
from tests.ros.support.commands import COMPOSE
from tests.ros.support.in_process import PATIENCE_S, Peer, running, wait_until
from tests.ros.support.system_process import RunningSystem, write_system

#: Functions of rcl that never return, with the GIL held, if a variable names them.
HANGING_RCL = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void hang_in(const char *name)
{
  const char *hanging = getenv("HANG_IN");
  if (hanging && !strcmp(hanging, name) && write(2, "hanging\\n", 8)) {
    for (;;) pause();
  }
}

#define HANG(name) \\
  int name(void *a, void *b, void *c, void *d, void *e) \\
  { \\
    hang_in(#name); \\
    int (*real)() = dlsym(dlopen("librcl.so", RTLD_LAZY), #name); \\
    return real(a, b, c, d, e); \\
  }

HANG(rcl_node_init)
HANG(rcl_node_fini)
"""


@pytest.fixture(scope="module")
def hanging_rcl(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hanging_rcl")
    source, library = folder / "hanging_rcl.c", folder / "libhanging_rcl.so"
    source.write_text(HANGING_RCL, encoding="utf-8")
    command = ["gcc", "-shared", "-fPIC", "-w", "-o", str(library), str(source), "-ldl"]
    subprocess.run(command, check=True)
    return library


@pytest.mark.parametrize(
    ("function", "last_line", "said"),
    [
        # The start of a system gets at least 5 s.
        ("rcl_node_init", "hanging", ("Timeout (0:00:05)!", "manager/node.py")),
        ("rcl_node_fini", "1 of 1 nodes active", ("Timeout (0:00:01)!", "in destroy_node")),
    ],
)
def test_a_start_or_an_end_that_hangs_in_the_middleware_ends(
    hanging_rcl: Path,
    monkeypatch: pytest.MonkeyPatch,
    function: str,
    last_line: str,
    said: tuple[str, ...],
) -> None:
    monkeypatch.setenv("LD_PRELOAD", str(hanging_rcl))
    monkeypatch.setenv("HANG_IN", function)
    # The default is 10 s.
    with RunningSystem("minimal", "--grace", "1", program=COMPOSE) as run:
        run.wait_for(last_line)
        run.process.send_signal(signal.SIGTERM)
        assert run.wait() == 1
    for part in said:  # and the Python stack
        assert part in run.output


def test_a_thread_of_a_behavior_does_not_delay_the_end(tmp_path: Path) -> None:
    text = """
    system: worker
    lifecycle: {timeout_ms: 1.0e+15}  # longer than any timer of C
    nodes: {worker: {behavior: "worker:Worker"}}
    """
    module = """
    import threading, time
    from composer.behavior import Behavior

    class Worker(Behavior):
        def on_activate(self):
            threading.Thread(target=work_forever, daemon=False).start()

    def work_forever():
        while True:
            time.sleep(0.1)
    """
    path = write_system(tmp_path, text, worker=module)
    with RunningSystem(str(path), "--for", "0.1", "--grace", "1", program=COMPOSE) as run:
        run.wait_for("shutting down: --for elapsed")
        assert run.wait() == 1
    assert "Timeout (0:00:01)!" in run.output
    assert "in work_forever" in run.output


NODES = 24
#: The lease of a participant, after which others remove it.
LEASE_S = 20.0
ATTEMPTS = 3


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
    path = write_system(tmp_path, LARGE)
    # A goodbye message is not acknowledged, so a busy machine may lose one.
    assert any(is_gone_at_once(path, peer) for _ in range(ATTEMPTS))


def is_gone_at_once(path: Path, peer: Peer) -> bool:
    """Run and stop the system; return whether the peer noticed before the lease ended."""
    before = set(SHARED_MEMORY.iterdir())
    with RunningSystem(str(path)) as run:
        run.wait_for(f"{NODES} of {NODES} nodes active")
        client = peer.client(Trigger, "/node_7/answer")
        ours = shared_memory_of(run.process.pid) - before
        run.process.send_signal(signal.SIGINT)
        code = run.wait()
    text = run.output
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
