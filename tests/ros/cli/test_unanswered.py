"""Commands that are not answered at first: what they send again, what they do not, what they say.

The peer loses the first request to each of its services, as far as a command can tell: Fast DDS
loses an answer for a client that the server has not met yet. A second request it answers.
"""

from __future__ import annotations

import signal
import subprocess
from collections import Counter
from collections.abc import Iterator

import pytest

from tests.ros.support.commands import PATIENCE_S, errors, hand_written, said, start


@pytest.fixture
def forgetful(ros_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_forgetful.py") as process:
        yield process


def requests(process: subprocess.Popen[str]) -> Counter[str]:
    """End the peer and return how many requests came to each of its services."""
    process.kill()
    assert process.stdout is not None
    return Counter(process.stdout.read().split())


@pytest.mark.parametrize(
    ("command", "expected", "services"),
    [
        ("lifecycle get forgetful", "unconfigured\n", ["get_state"]),
        ("lifecycle list forgetful", "configure\n", ["get_available_transitions"]),
        ("lifecycle nodes", "/lab/forgetful  unconfigured\n", ["get_state"]),
        ("param list", "/lab/forgetful:\n  speed\n", ["list_parameters"]),
        ("param get forgetful speed", "1.5\n", ["list_parameters", "get_parameters"]),
        (
            "param describe forgetful speed",
            "name:  speed\ntype:  double\n",
            ["list_parameters", "describe_parameters"],
        ),
    ],
)
def test_what_only_reads_is_asked_again(
    forgetful: subprocess.Popen[str], command: str, expected: str, services: list[str]
) -> None:
    assert said(*command.split(), "--timeout", "20") == expected
    came = requests(forgetful)
    assert all(came[service] >= 2 for service in services), came


def test_what_changes_something_is_sent_once(forgetful: subprocess.Popen[str]) -> None:
    commands = {
        "service call /lab/switch": "switch",
        "lifecycle set forgetful configure": "change_state",
        "param set forgetful speed 2": "set_parameters",
    }
    # A second request would be answered, and the command would succeed.
    for told in errors(*((*command.split(), "--timeout", "8") for command in commands)):
        assert "did not answer within 8 s" in told
    came = requests(forgetful)
    assert {service: came[service] for service in commands.values()} == dict.fromkeys(
        commands.values(), 1
    )


def test_a_subscription_that_acknowledges_nothing_is_told(
    forgetful: subprocess.Popen[str],
) -> None:
    arguments = ("--times", "2", "--rate", "0.5", "/lab/in", "std_msgs/msg/String")
    process = start("topic", "pub", *arguments)
    assert process.stderr is not None
    assert any("published #1" in line for line in process.stderr)
    forgetful.send_signal(signal.SIGSTOP)
    _, rest = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, rest
    published, warning, hint = rest.splitlines()
    assert published.startswith("published #2: ")
    assert warning == (
        "warning: not every reliable subscription to '/lab/in' has acknowledged what was"
        " published within 1 s"
    )
    assert "may be stopped" in hint
