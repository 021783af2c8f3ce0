"""Commands that are not answered at first: what they send again, what they do not, what they say.

The peer loses the first request to each of its services, as far as a command can tell: Fast DDS
loses an answer for a client that the server has not met yet. A second request it answers.
"""

from __future__ import annotations

import subprocess
from collections import Counter
from collections.abc import Iterator

import pytest

from tests.ros.commands import error, hand_written, said


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


@pytest.mark.parametrize(
    ("command", "service"),
    [
        ("service call /lab/switch", "switch"),
        ("lifecycle set forgetful configure", "change_state"),
        ("param set forgetful speed 2", "set_parameters"),
    ],
)
def test_what_changes_something_is_sent_once(
    forgetful: subprocess.Popen[str], command: str, service: str
) -> None:
    # A second request would be answered, and the command would succeed.
    assert "did not answer within 8 s" in error(*command.split(), "--timeout", "8")
    assert requests(forgetful)[service] == 1
