"""Lost responses: reads are retried, writes are sent once.

The peer ignores the first request to each of its services and responds to the second one. Fast DDS
drops a response if the server has not discovered the client yet.
"""

from __future__ import annotations

import signal
import subprocess
from collections import Counter
from collections.abc import Iterator

import pytest

from tests.ros.support.commands import PATIENCE_S, errors, hand_written, listed, start

READS = {
    "lifecycle list forgetful": "configure\n",
    "lifecycle nodes": "/lab/forgetful  unconfigured\n",
    "param get forgetful speed": "1.5\n",
    "param describe forgetful speed": "name:  speed\ntype:  double\n",
}
SERVICES_OF_READS = (
    "get_available_transitions",
    "get_state",
    "list_parameters",
    "get_parameters",
    "describe_parameters",
)
WRITES = {
    "service call /lab/switch": "switch",
    "lifecycle set forgetful configure": "change_state",
    "param set forgetful speed 2": "set_parameters",
}


@pytest.fixture
def forgetful(ros_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_forgetful.py") as process:
        yield process


def test_reads_are_retried_and_writes_are_sent_once(forgetful: subprocess.Popen[str]) -> None:
    for command, expected in READS.items():
        assert listed((expected,), *command.split(), "--timeout", "20") == expected
    # With a second request, these commands would succeed.
    for text in errors(*((*command.split(), "--timeout", "8") for command in WRITES)):
        assert "did not respond within 8 s" in text
    forgetful.kill()
    assert forgetful.stdout is not None
    received = Counter(forgetful.stdout.read().split())
    assert [received[service] for service in WRITES.values()] == [1] * len(WRITES)
    assert all(received[service] >= 2 for service in SERVICES_OF_READS), received


def test_a_missing_acknowledgment_prints_a_warning(forgetful: subprocess.Popen[str]) -> None:
    # Slow, so that the peer stops between the two messages, also on a busy machine.
    arguments = ("--times", "2", "--rate", "0.25", "/lab/in", "std_msgs/msg/String")
    process = start("topic", "pub", *arguments)
    assert process.stderr is not None
    assert any("published #1" in line for line in process.stderr)
    forgetful.send_signal(signal.SIGSTOP)
    _, rest = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, rest
    published, warning, hint = rest.splitlines()
    assert published.startswith("published #2: ")
    assert warning == (
        "warning: not every reliable subscription to '/lab/in' acknowledged all messages within 1 s"
    )
    assert "may be stopped" in hint
