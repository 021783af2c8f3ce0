"""Commands where something is wrong: mismatches, lost responses, forged messages, no security."""

from __future__ import annotations

import json
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.client.doctor import Level
from composer.client.doctor.graph import check_types_built
from composer.client.systems.local_queries import parse_state
from composer.runtime.protocol.codec import VERSION, encode
from composer.runtime.protocol.reports import NodeReport, SystemReport
from composer.runtime.ros.service_requests import CALLBACKS_QOS, STATE_QOS
from tests.ros.support.commands import (
    PATIENCE_S,
    compose,
    errors,
    expect_error,
    hand_written,
    listed,
    repeated,
    start,
)
from tests.ros.support.in_process import Peer


@pytest.fixture(scope="module")
def incompatible_nodes(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written_incompatible.py") as process:
        yield process


def test_problems_of_the_graph_are_reported_with_remedies(
    incompatible_nodes: subprocess.Popen[str],
) -> None:
    expected = ("/lab/scan: ", "topic /lab/mixed has more than one type", "/lab/twin: ")
    done = repeated(lambda done: all(part in done.stdout for part in expected), "doctor", "--json")
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)

    def messages(area: str, level: str) -> list[str]:
        return [item["message"] for item in found if (item["area"], item["level"]) == (area, level)]

    assert all(item["remedy"] for item in found if item["level"] != "ok")
    assert messages("qos", "error") == [
        "/lab/scan: /lab/scanner offers reliability best_effort, /lab/mapper requests reliable:"
        " no messages are delivered"
    ]
    (mixed,) = messages("graph", "error")
    assert mixed.startswith("topic /lab/mixed has more than one type: std_msgs/msg/Int32, ")
    (twins,) = messages("graph", "warning")
    assert twins.startswith("2 nodes have the name /lab/twin")
    assert messages("middleware", "ok") == ["rmw_fastrtps_cpp"]
    (discovered,) = messages("discovery", "ok")
    assert discovered.startswith("two participants discovered each other within")
    assert messages("interfaces", "warning") == []


def test_a_lost_action_server_is_reported(incompatible_nodes: subprocess.Popen[str]) -> None:
    goal = ("action", "send-goal", "/lab/endless", "composer_interfaces/action/Navigate", "{}")
    process = start(*goal, "--timeout", "20")
    assert process.stderr is not None
    assert any("goal accepted" in line for line in process.stderr)
    incompatible_nodes.send_signal(signal.SIGINT)  # the last test with these nodes
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "the server of '/lab/endless' is gone, so the goal is lost" in err


def test_a_missing_type_is_reported_once() -> None:
    used = [
        ("topic", "/grip", ("arm_interfaces/msg/Grip",)),
        ("topic", "/grips", ("arm_interfaces/msg/Grip", "std_msgs/msg/String")),
    ]
    (result,) = check_types_built(used)
    assert result.level is Level.WARNING
    assert result.message.startswith("arm_interfaces/msg/Grip (topic /grip) is not installed")


KEYS = (
    "cert.pem",
    "governance.p7s",
    "identity_ca.cert.pem",
    "key.pem",
    "permissions.p7s",
    "permissions_ca.cert.pem",
)


def test_security_without_its_libraries_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Security is enabled, but the middleware cannot do it, as in the wheels from PyPI."""
    enclaves = tmp_path / "keys" / "enclaves"
    enclaves.mkdir(parents=True)
    for name in KEYS:
        (enclaves / name).touch()
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keys"))
    path = tmp_path / "lamp.yaml"
    path.write_text("system: lamp\nnodes:\n  one: {on_activate: {log: started}}\n")
    reason = "security is enabled, but this build of Fast DDS has no security libraries"
    for command in (("node", "list"), ("run", path)):
        done = compose(*command)
        assert done.returncode == 1
        assert f"compose: ROS does not start: {reason}\n" in done.stderr
        assert "unset ROS_SECURITY_ENABLE" in done.stderr
        assert "internal error" not in done.stderr
    done = compose("doctor")
    assert done.returncode == 1
    assert f"error    middleware   ROS does not start: {reason}\n" in done.stdout


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
