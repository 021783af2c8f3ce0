"""What other participants announce in the ROS graph is input: odd names and forged messages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.client.systems.local_queries import parse_state
from composer.runtime.protocol.codec import VERSION, encode
from composer.runtime.protocol.reports import NodeReport, SystemReport
from composer.runtime.ros.manager_interface import CALLBACKS_QOS, STATE_QOS
from tests.ros.support.commands import (
    PATIENCE_S,
    compose,
    expect_error,
    hand_written,
    repeated,
    start,
)
from tests.ros.support.in_process import Peer

#: With a part of their output. Discovery of the odd participant never ends, so its time is limited.
COMMANDS = {
    "node list --timeout 2": "/lab/talker",
    "topic list --timeout 2": "/lab/text",
    "lifecycle nodes --timeout 2": "",
    "graph --live --timeout 2": "talker",
    "ps --timeout 3": "/forged: no response",
}
INVALID = "not a valid name in ROS"
SKIPPED = "skipped a message on /forged/manager/state: it is not a report of this version"


@pytest.fixture(scope="module")
def hostile(talker: None, shared_domain_id: int) -> Iterator[Peer]:
    """A participant with odd names, and the forged manager node of a system."""
    peer = Peer()
    peer.node.create_service(Trigger, "/forged/manager/is_active", lambda _, response: response)
    for topic, qos in (("state", STATE_QOS), ("callbacks", CALLBACKS_QOS)):
        publisher = peer.node.create_publisher(String, f"/forged/manager/{topic}", qos)
        message = String(data='{"activity": "running"}')
        peer.node.create_timer(0.1, lambda to=publisher, message=message: to.publish(message))
    with hand_written("hand_written_odd_names.py"):
        yield peer
    peer.close()


def warnings(text: str) -> list[int]:
    """Count the warnings of invalid names, and of skipped messages."""
    return [sum(part in line for line in text.splitlines()) for part in (INVALID, SKIPPED)]


def test_invalid_names_and_messages_are_skipped(hostile: Peer) -> None:
    started = {command: start(*command.split()) for command in COMMANDS}
    for command, part in COMMANDS.items():
        expected = [1, int(command.startswith(("lifecycle", "graph", "ps")))]  # they read reports
        output, text = started[command].communicate(timeout=PATIENCE_S)
        assert started[command].returncode == 0, (command, text)
        if part not in output or warnings(text) != expected:  # a busy machine needs more time
            done = compose(*command.split()[:-1], "15")
            output, text = done.stdout, done.stderr
        assert part in output, (command, output, text)
        assert "\x1b" not in output + text
        assert warnings(text) == expected


def test_parameter_responses_that_do_not_fit_are_errors(hostile: Peer) -> None:
    odd = hostile.join("odd")

    def list_all(_: object, response: ListParameters.Response) -> ListParameters.Response:
        response.result.names = ["speed"]
        return response

    name = odd.get_fully_qualified_name()
    for kind, last, callback in (
        (ListParameters, "list_parameters", list_all),
        (GetParameters, "get_parameters", lambda _, response: response),
        (DescribeParameters, "describe_parameters", lambda _, response: response),
    ):
        service = next(item for item in odd.services if item.srv_name.endswith(last))
        assert service.srv_type is kind
        service.callback = callback
    for command in ("get", "describe"):
        wrong = f"{name} responded with 0 values for 1 parameters"
        expect_error(wrong, "param", command, name, "speed")


REPORT = SystemReport(
    "lab", "running", (NodeReport("/lab/node", "active", last_error="red\x1b[31m"),), "here", "1"
)


def test_a_report_has_no_control_characters() -> None:
    report = parse_state("/lab", encode(REPORT))
    (node,) = report.nodes
    assert (report.name, node.node, node.host) == ("/lab", "/lab/node", "here")
    assert node.last_error == "red\\x1b[31m"


def test_ps_says_what_to_update_for_a_system_of_another_version(hostile: Peer) -> None:
    document = json.loads(encode(REPORT)) | {"version": VERSION + 1, "release": "9.0\x1b"}
    message = String(data=json.dumps(document))
    name = "/newer/manager"
    hostile.node.create_service(Trigger, f"{name}/is_active", lambda _, response: response)
    publisher = hostile.node.create_publisher(String, f"{name}/state", STATE_QOS)
    timer = hostile.node.create_timer(0.1, lambda: publisher.publish(message))
    problem = f" (protocol {VERSION + 1}), this is "
    commands = {
        ("ps", "--timeout", "5"): lambda done: problem in done.stdout,
        ("ps", "newer", "--json"): lambda done: "another_version" in done.stdout,
        ("ps", "newer", "--ready"): lambda done: problem in done.stdout,
        ("lifecycle", "startup", "newer", "--timeout", "3"): lambda done: problem in done.stderr,
    }
    with ThreadPoolExecutor(len(commands)) as pool:
        done = list(pool.map(lambda words: repeated(commands[words], *words), commands))
    hostile.node.destroy_timer(timer)
    assert [command.returncode for command in done] == [0, 0, 1, 1]
    assert not any("\x1b" in command.stdout + command.stderr for command in done)
    (line,) = (line for line in done[0].stdout.splitlines() if line.startswith("/newer"))
    assert line.startswith("/newer: it is of ros2-composer '9.0")
    assert line.endswith("update this one")
    (system,) = json.loads(done[1].stdout)["systems"]
    assert system.keys() == {"name", "another_version", "message"}
