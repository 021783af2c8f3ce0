"""What other participants announce in the ROS graph is input: odd names and forged messages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.serialization import serialize_message
from std_srvs.srv import Trigger

from composer.client.systems.callback_reports import parse_callbacks
from composer.client.systems.system_reports import InvalidReportError, parse_state
from composer.runtime.metrics.figures import CallbackFigures, to_statuses
from composer.runtime.ros.diagnostic_arrays import write_array
from composer.runtime.ros.manager_protocol import CALLBACKS_QOS, STATE_QOS
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
SKIPPED = "skipped a message on /forged/manager/state: not a report of this version"


@pytest.fixture(scope="module")
def hostile(talker: None, shared_domain_id: int) -> Iterator[Peer]:
    """A participant with odd names, and the forged manager node of a system."""
    peer = Peer()
    peer.node.create_service(Trigger, "/forged/manager/is_active", lambda _, response: response)
    for topic, qos in (("state", STATE_QOS), ("callbacks", CALLBACKS_QOS)):
        publisher = peer.node.create_publisher(DiagnosticArray, f"/forged/manager/{topic}", qos)
        message = DiagnosticArray(status=[DiagnosticStatus(values=[KeyValue(key="activity")])])
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
        expected = [1, int(command.startswith("ps"))]
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


STATE = {
    "state": "active", "desired": "active", "since": "1.0", "restarts": "0", "errors": "0",
    "last_error": "", "held_down": "", "condition": "", "sent_hz": "1.0", "received_hz": "1.0",
    "busy": "0.1", "slowest": "", "overruns": "0", "queue_drops": "0", "qos_events": "lost=1",
    "depends_on": "", "sent": "", "received": "", "dropped": "", "process": "",
}  # fmt: skip


def report(**changes: str) -> bytes:
    system = {"activity": "running", "host": "here", "pid": "1"}
    message = DiagnosticArray(
        status=[
            DiagnosticStatus(values=[KeyValue(key=key, value=system[key]) for key in system]),
            DiagnosticStatus(
                name="lab: /lab/node",
                values=[
                    KeyValue(key=key, value=value) for key, value in {**STATE, **changes}.items()
                ],
            ),
        ]
    )
    return serialize_message(message)


def test_a_report_has_no_control_characters() -> None:
    (node,) = parse_state("/lab", report(last_error="red\x1b[31m")).nodes
    assert (node.node, node.state, node.qos_events) == ("/lab/node", "active", {"lost": 1})
    assert node.last_error == "red\\x1b[31m"


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"since": "nan"}, "'nan' is not a number"),
        ({"since": "x"}, "'x' is not a number"),
        ({"busy": "1e999"}, "'1e999' is not a number"),
        ({"errors": "many"}, "'many' is not an integer"),
        ({"qos_events": "lost"}, "'' is not an integer"),
    ],
)
def test_values_of_another_kind_are_not_a_report(changes: dict[str, str], problem: str) -> None:
    with pytest.raises(InvalidReportError, match=f"not a report of this version.*{problem}"):
        parse_state("/lab", report(**changes))


def test_messages_of_another_shape_are_not_a_report() -> None:
    with pytest.raises(InvalidReportError, match="invalid: it is empty"):
        parse_state("/lab", serialize_message(DiagnosticArray()))
    with pytest.raises(InvalidReportError, match="it ends early"):
        parse_state("/lab", report()[:-200])
    with pytest.raises(InvalidReportError, match="missing: 'activity'"):
        parse_state("/lab", serialize_message(DiagnosticArray(status=[DiagnosticStatus()])))
    (timed,) = to_statuses("lab", [CallbackFigures("/lab/node", "timer", "tick", count=3)])
    assert parse_callbacks(write_array(0, [timed])).callbacks[0].count == 3
    for key, value in (("count", "3.5"), ("total_ms", "inf"), ("other", "1")):
        changed = timed._replace(values={**timed.values, key: value})
        with pytest.raises(InvalidReportError):
            parse_callbacks(write_array(0, [changed]))
    with pytest.raises(InvalidReportError):
        parse_callbacks(write_array(0, [timed])[:-20])


def test_ps_lists_what_a_system_of_another_version_reports(hostile: Peer) -> None:
    message = report(overruns="of another kind", state="inactive\x1b")
    name = "/older/manager"
    hostile.node.create_service(Trigger, f"{name}/is_active", lambda _, response: response)
    publisher = hostile.node.create_publisher(DiagnosticArray, f"{name}/state", STATE_QOS)
    timer = hostile.node.create_timer(0.1, lambda: publisher.publish(message))
    title = "/older: of another version of ros2-composer, only states known (host here, process 1)"
    skipped = "a message on /older/manager/state: not a report of this version"
    commands = {
        ("ps", "--timeout", "5"): lambda done: title in done.stdout,
        ("ps", "older", "--json"): lambda done: skipped in done.stderr,
        ("ps", "older", "--ready"): lambda done: title in done.stdout,
    }
    with ThreadPoolExecutor(len(commands)) as pool:
        listed, as_json, ready = pool.map(lambda words: repeated(commands[words], *words), commands)
    hostile.node.destroy_timer(timer)
    assert [done.returncode for done in (listed, as_json, ready)] == [0, 0, 1]
    assert title in listed.stdout
    assert "/lab/node  inactive\\x1b" in listed.stdout
    assert skipped in as_json.stderr
    (system,) = json.loads(as_json.stdout)["systems"]
    assert system == {
        "name": "/older", "host": "here", "pid": "1", "is_ready": False, "another_version": True,
        "nodes": [{"node": "/lab/node", "state": "inactive\\x1b"}],
    }  # fmt: skip
