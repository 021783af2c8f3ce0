"""Services for parameters and log levels respond as rclpy's; large requests block nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import LoggerLevel, Parameter, ParameterDescriptor, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetLoggerLevels,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetLoggerLevels,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from type_description_interfaces.srv import GetTypeDescription

from composer.runtime.ros import service_requests
from composer.runtime.supervision.events import Logged
from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until

LOGGED = """
system: logged
namespace: /a
nodes:
  plain: {behavior: code:Plain, log_level: warn}
  hosted: {class: "code:Hosted"}
  served: {behavior: code:Plain, introspection: {logger_services: true}}
  enabled: {class: "code:Enabled"}
  both: {class: "code:Enabled", introspection: {logger_services: true}}
"""
CODE = """
from composer.behavior import Behavior
from rclpy.node import Node
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

class Plain(Behavior):
    def on_configure(self):
        self.log.debug("configured")
        self.log.info("info")

class Hosted(LifecycleNode):
    def __init__(self):
        super().__init__("hosted")

    def on_configure(self, state):
        self.get_logger().debug("configured")
        self.get_logger().get_child("child").debug("child configured")
        return TransitionCallbackReturn.SUCCESS

class Enabled(Node):
    def __init__(self):
        super().__init__("enabled", enable_logger_service=True)
"""
MANAGER = "/a/logged/manager"


def logged(system: RunningSystem, logger: str) -> list[str]:
    return [item.message for item in system.reported(Logged) if item.logger == logger]


def services(peer: Peer) -> set[str]:
    found = dict(peer.node.get_service_names_and_types())
    return {name for name in found if name.endswith("/set_logger_levels")}


def set_levels(peer: Peer, node: str, **levels: int) -> list[tuple[bool, str]]:
    items = [LoggerLevel(name=f"a.{name}", level=level) for name, level in levels.items()]
    answer = peer.call(
        SetLoggerLevels, f"{node}/set_logger_levels", SetLoggerLevels.Request(levels=items)
    )
    return [(item.successful, item.reason) for item in answer.results]


def levels(peer: Peer, node: str, *names: str) -> list[tuple[str, int]]:
    request = GetLoggerLevels.Request(names=list(names))
    answer = peer.call(GetLoggerLevels, f"{node}/get_logger_levels", request)
    return [(item.name, item.level) for item in answer.levels]


def test_levels_follow_the_services_which_refuse_huge_requests(tmp_path: Path, peer: Peer) -> None:
    names = [f"a.{name}" for name in ("plain", "hosted", "served", "other")]
    with running(LOGGED, tmp_path, code=CODE) as system:
        for node in (MANAGER, "/a/served"):
            found = levels(peer, node, *names)
            assert found == list(zip(names, (30, 20, 20, 0), strict=True))
        nodes = (MANAGER, "/a/served", "/a/enabled", "/a/both")
        wait_until(lambda: services(peer) == {f"{node}/set_logger_levels" for node in nodes})
        refusal = "'get_logger_levels': 10001 names in one request, at most 10000"
        for number, node in enumerate(nodes, 1):
            assert levels(peer, node, *["x"] * 10_001) == []
            wait_until(lambda n=number: system.log_text().count(refusal) == n, "the refusal")
        assert set_levels(peer, MANAGER, plain=10, hosted=10, served=25) == [
            (True, ""),
            (True, ""),
            (False, "25 is not a valid LoggingSeverity"),
        ]
        assert set_levels(peer, "/a/served", served=40) == [(True, "")]
        assert "configured" not in logged(system, "a.hosted") + logged(system, "a.plain")
        for name in ("plain", "hosted", "served"):
            # also while unconfigured, and the level stays
            system.change(name, "deactivate", "cleanup", "configure")
        assert logged(system, "a.plain") == ["configured", "info"]
        assert logged(system, "a.hosted") == ["configured"]
        assert logged(system, "a.hosted.child") == ["child configured"]
        info, refused = logged(system, "a.served")
        assert info == "info"
        assert refusal in refused
        assert levels(peer, MANAGER, *names[:3]) == [(names[0], 10), (names[1], 10), (names[2], 40)]


# The tests from here on share a system. The one before them runs a system of its own.


SYSTEM = """
system: served
executors: {events: {kind: events}, multi_threaded: {kind: multi_threaded}}
nodes:
  compared_${kind}:
    for_each: {kind: [events, multi_threaded]}
    executor: ${kind}
    parameters:
      speed: {type: double, default: 1.5, maximum: 5.0}
      label: {type: string, default: here, read_only: true}
      arm.joint.count: {type: integer, default: 3}
  subject:
    parameters:
      speed: {type: double, default: 1.5, maximum: 5.0}
      label: {type: string, default: here, read_only: true}
      arm.joint.count: {type: integer, default: 3}
      route: {type: double_array, default: []}
      tags: {type: string_array, default: [], read_only: true}
  hosted: {class: "tests.ros.support.node_classes:Counter"}
  ticker: {behavior: ticker:Ticker, timers: {tick: {period_ms: 5}}}
"""
TICKER = """
import time
from composer.behavior import Behavior

class Ticker(Behavior):
    def on_activate(self):
        self.last_s, self.longest_s, self.ticks = time.thread_time(), 0.0, 0

    def on_tick(self):
        # What the loop has worked, not what it has waited for a processor.
        now_s = time.thread_time()
        self.longest_s = max(self.longest_s, now_s - self.last_s)
        self.last_s = now_s
        self.ticks += 1
"""
#: Far more than a slice, far less than the seconds that rclpy takes.
LONGEST_S = 1.0


@pytest.fixture(scope="module")
def system(
    tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int
) -> Iterator[RunningSystem]:
    with running(SYSTEM, tmp_path_factory.mktemp("served"), ticker=TICKER) as system:
        yield system


@pytest.mark.parametrize("node", ["/subject", "/hosted"])
def test_a_huge_request_is_refused_and_holds_up_no_callback(
    system: RunningSystem, node: str
) -> None:
    ticker = system.behavior("ticker")
    ticker.longest_s, before = 0.0, ticker.ticks
    with hand_written("hand_written_huge_requests.py", node) as process:
        assert process.stdout is not None
        answers = [json.loads(process.stdout.readline()) for _ in range(10)]
    assert ticker.ticks > before
    assert ticker.longest_s < LONGEST_S
    items = "1500000 array items and characters in one request, at most 1000000"
    assert answers == [
        ["get_parameters", "0"],
        ["get_parameter_types", "0"],
        ["describe_parameters", "0"],
        ["list_parameters", "0"],
        ["set_parameters", "20000 parameters in one request, at most 1000"],
        ["set_parameters_atomically", "20000 parameters in one request, at most 1000"],
        ["set_parameters", items],
        ["set_parameters", items],
        ["change_state", "False"],
        ["get_type_description", "3000000 characters in one request, at most 1000"],
    ]
    log = [event.message for event in system.reported(Logged) if event.logger == node[1:]]
    refusal = "refused a request of 'get_parameters': 100000 names in one request, at most"
    assert refusal in "\n".join(log)


def test_long_texts_are_refused(system: RunningSystem, peer: Peer) -> None:
    for length in (1001, 1000):
        request = ChangeState.Request(transition=Transition(label="x" * length))
        assert not peer.call(ChangeState, "/subject/change_state", request).success
    log = system.log_text()
    assert "refused 'xxx" in log
    assert "refused a request of 'change_state': " in log
    for node in ("/subject", "/served/manager"):
        reasons = []
        for type_hash in ("x", "x" * 1000):
            asked = GetTypeDescription.Request(type_name="a/msg/B", type_hash=type_hash)
            answer = peer.call(GetTypeDescription, f"{node}/get_type_description", asked)
            assert not answer.successful
            reasons.append(answer.failure_reason)
        refused = "1007 characters in one request, at most 1000"
        assert reasons == ["Failed to parse type hash", refused]


def change(name: str, kind: int, **fields: Any) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=kind, **fields))


@pytest.mark.parametrize("kind", [10, 77, 255])
def test_an_unknown_type_is_refused_with_a_reason(
    system: RunningSystem, peer: Peer, kind: int
) -> None:
    changes = [change("speed", kind), change("speed", 3, double_value=4.5)]
    request = SetParameters.Request(parameters=changes)
    for node in ("/subject", "/served/manager"):
        refused, other = peer.call(SetParameters, f"{node}/set_parameters", request).results
        assert not refused.successful
        assert refused.reason == f"parameter 'speed' has the unknown type {kind}"
        assert other.successful is (node == "/subject")
    together = SetParametersAtomically.Request(parameters=changes)
    result = peer.call(SetParametersAtomically, "/subject/set_parameters_atomically", together)
    assert f"unknown type {kind}" in result.result.reason


def test_an_empty_array_has_its_declared_type(system: RunningSystem, peer: Peer) -> None:
    # rclpy takes an empty array for one of bytes, and would refuse all others from then on.
    asked = GetParameters.Request(names=["route", "tags"])
    values = peer.call(GetParameters, "/subject/get_parameters", asked).values
    described = DescribeParameters.Request(names=["route", "tags"])
    descriptors = peer.call(DescribeParameters, "/subject/describe_parameters", described)
    assert [value.type for value in values] == [8, 9]
    assert [(item.type, item.read_only) for item in descriptors.descriptors] == [
        (8, False),
        (9, True),
    ]
    changes = [
        change("route", 8, double_array_value=[1.0, 2.0]),
        change("tags", 9, string_array_value=["new"]),
        change("route", 8),
    ]
    request = SetParameters.Request(parameters=changes)
    results = peer.call(SetParameters, "/subject/set_parameters", request).results
    assert [result.successful for result in results] == [True, False, True]


def test_many_requested_values_are_limited(system: RunningSystem, peer: Peer) -> None:
    """A request may name a long value many times."""
    long = "x" * 1000
    system.ros_node("subject").declare_parameter("long", long)
    response = peer.call(
        GetParameters, "/subject/get_parameters", GetParameters.Request(names=["long"] * 1000)
    )
    assert [len(value.string_value) for value in response.values] == [1000] * 1000
    refusal = "more than 1000000 array items and characters in one response"

    def is_refused() -> bool:
        request = GetParameters.Request(names=["long"] * 1001)
        assert not peer.call(GetParameters, "/subject/get_parameters", request).values
        return refusal in system.log_text()

    wait_until(is_refused, "the log")  # one line per second and service, also of other tests


def test_the_layout_of_requests_is_known(peer: Peer) -> None:
    """The size of a request is read from C structures of rosidl_generator_c."""
    requests: list[Any] = []

    def respond(request: Any, response: Any) -> Any:
        requests.append(request)
        return response

    service = service_requests.limited(SetParameters)
    peer.node.create_service(service, "/laid_out", respond)
    values = {
        "string_value": "abc", "byte_array_value": [b"1"] * 5, "bool_array_value": [True] * 7,
        "integer_array_value": [1] * 11, "double_array_value": [1.0] * 13,
        "string_array_value": ["x"] * 17,
    }  # fmt: skip
    changes = [change("a", 3, **values), change("b", 4, string_value="y" * 19)]
    request = SetParameters.Request(parameters=changes)
    checked: list[int] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(service_requests, "excess_of", lambda *given: checked.append(given[0]))
        peer.call(SetParameters, "/laid_out", request)
    assert checked == [2, 3 + 5 + 7 + 11 + 13 + 17 + 19]
    assert requests[0] == request
    assert RosParameter.from_parameter_msg(requests[0].parameters[1]).value == "y" * 19


def test_the_manager_node_has_parameter_services(system: RunningSystem, peer: Peer) -> None:
    listed = peer.call(ListParameters, "/served/manager/list_parameters").result
    assert set(listed.names) == {"use_sim_time", "start_type_description_service"}
    assert peer.set_parameter("/served/manager", "use_sim_time", False) == ""
    names = GetParameters.Request(names=["use_sim_time"])
    (value,) = peer.call(GetParameters, "/served/manager/get_parameters", names).values
    assert (value.type, value.bool_value) == (1, False)


def plain_node(peer: Peer) -> Node:
    """Return a node of rclpy with the same parameters."""
    node = peer.join("plain")
    node.declare_parameter("speed", 1.5)
    node.declare_parameter("label", "here", ParameterDescriptor(read_only=True))
    node.declare_parameter("arm.joint.count", 3)
    return node


REQUESTS: list[tuple[Any, str, dict[str, Any]]] = [
    (GetParameters, "get_parameters", {"names": ["speed", "arm.joint.count", "speed"]}),
    (GetParameters, "get_parameters", {"names": ["speed", "missing"]}),
    (GetParameters, "get_parameters", {"names": []}),
    (GetParameterTypes, "get_parameter_types", {"names": ["label", "use_sim_time"]}),
    (GetParameterTypes, "get_parameter_types", {"names": ["missing"]}),
    (DescribeParameters, "describe_parameters", {"names": ["use_sim_time"]}),
    (DescribeParameters, "describe_parameters", {"names": ["missing"]}),
    (ListParameters, "list_parameters", {"prefixes": ["arm", "arm"], "depth": 2}),
    (ListParameters, "list_parameters", {"prefixes": ["arm"], "depth": 1}),
    (ListParameters, "list_parameters", {"prefixes": ["missing"]}),
    (SetParameters, "set_parameters", {"parameters": [change("speed", 3, double_value=2.5)]}),
    (SetParameters, "set_parameters", {"parameters": [change("missing", 3, double_value=2.5)]}),
    (SetParameters, "set_parameters", {"parameters": [change("label", 4, string_value="x")]}),
    (SetParameters, "set_parameters", {"parameters": [change("speed", 2, integer_value=2)]}),
    (SetParameters, "set_parameters", {"parameters": []}),
    (
        SetParametersAtomically,
        "set_parameters_atomically",
        {"parameters": [change("speed", 3, double_value=3.5), change("missing", 1)]},
    ),
]


@pytest.mark.parametrize("node", ["/compared_events", "/compared_multi_threaded"])
@pytest.mark.usefixtures("system")
def test_responses_are_those_of_rclpy_on_executors_of_every_kind(peer: Peer, node: str) -> None:
    plain = plain_node(peer)
    own = plain.get_fully_qualified_name()
    for kind, name, fields in REQUESTS:
        request = kind.Request(**fields)
        expected = str(peer.call(kind, f"{own}/{name}", request)).replace(own, node)
        assert str(peer.call(kind, f"{node}/{name}", request)) == expected, (name, fields)
