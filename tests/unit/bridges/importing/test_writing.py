"""Descriptions as YAML: canonical, commented, and valid."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from composer.bridges.importing import FoundNode, FoundParameter, FoundPort, FoundSystem
from composer.bridges.importing.live import describe_graph
from composer.bridges.importing.writing import readable, write_node_type, write_system
from composer.interfaces import Interfaces
from composer.language.tree import Plain
from composer.model import PortKind
from composer.model.qos import PRESETS, Durability, QosProfile, Reliability
from composer.plan.drift import ObservedEndpoint, ObservedNode, Snapshot
from tests.unit.support.checking import valid_system

STRING = "std_msgs/msg/String"
TRIGGER = "std_srvs/srv/Trigger"
LATCHED = QosProfile(durability=Durability.TRANSIENT_LOCAL)
SENSOR = QosProfile(reliability=Reliability.BEST_EFFORT)


def topic(kind: PortKind, name: str, qos: QosProfile = SENSOR) -> ObservedEndpoint:
    return ObservedEndpoint(kind, name, STRING, qos)


def graph(*nodes: ObservedNode, selected: tuple[str, ...] = ()) -> str:
    types = {STRING, TRIGGER}
    settings: dict[str, dict[str, dict[str, Plain]]] = {
        "/a/talker": {"rate": {"type": "double", "minimum": 1.0, "description": "Rate."}}
    }
    return write_system(describe_graph("s", Snapshot(nodes), settings, types, selected))


TALKER = ObservedNode(
    "/a/talker",
    (
        topic(PortKind.PUBLISHER, "/a/chatter"),
        topic(PortKind.PUBLISHER, "/a/talker/status", LATCHED),
        topic(PortKind.PUBLISHER, "/tf", QosProfile(deadline_ms=5.0)),
        topic(PortKind.PUBLISHER, "/b/tf", QosProfile()),
        ObservedEndpoint(PortKind.SERVICE, "/a/reset", TRIGGER),
    ),
    parameters={"rate": 5.0, "use_sim_time": False, "empty": [], "qos_overrides./tf.depth": 3},
)
LISTENER = ObservedNode(
    "/b/talker",
    (
        topic(PortKind.SUBSCRIPTION, "/a/chatter"),
        ObservedEndpoint(PortKind.SUBSCRIPTION, "/odd", "other_msgs/msg/Odd", SENSOR),
    ),
    state="inactive",
    parameters=None,
)


def test_live_nodes_are_written_as_external_nodes() -> None:
    hidden = ObservedNode("/a/_tool")
    manager = ObservedNode(
        "/s/manager", (ObservedEndpoint(PortKind.SERVICE, "/s/manager/is_active", TRIGGER),)
    )
    text = graph(TALKER, LISTENER, hidden, manager)
    assert (
        text
        == """\
# Imported from the ROS graph by 'compose import live'.
# The ROS graph does not show the depth of queues.
#
# Left out:
# - parameter empty of /a/talker: it has no value
# - subscription /odd of /b/talker: its type other_msgs/msg/Odd is not known here
# - parameters of /b/talker: it did not respond
system: s
nodes:
  a_talker:
    name: talker
    namespace: /a
    external: true
    parameters: {rate: {type: double, default: 5.0, minimum: 1.0, description: Rate.}}
    publishers:
      chatter: {type: std_msgs/msg/String, qos: sensor_data}
      status: {type: std_msgs/msg/String, topic: "~/status", qos: state, external: true}
      tf: {type: std_msgs/msg/String, topic: /tf, qos: {deadline_ms: 5.0}, external: true}
      tf_2: {type: std_msgs/msg/String, topic: /b/tf, qos: command, external: true}
    services: {reset: {type: std_srvs/srv/Trigger, external: true}}
  b_talker:
    name: talker
    namespace: /b
    external: true
    lifecycle: {autostart: inactive}
    subscriptions: {chatter: {type: std_msgs/msg/String, topic: /a/chatter, qos: sensor_data}}
"""
    )


def test_nodes_are_selected_and_their_counterparts_become_external() -> None:
    text = graph(TALKER, LISTENER, selected=("/b/*",))
    assert "/b" in text
    assert "namespace: /a" not in text
    assert "qos: sensor_data, external: true" in text


def test_what_is_written_is_read_without_diagnostics(tmp_path: Path) -> None:
    assert {STRING} <= {*Interfaces.load().names("msg")}
    nodes = valid_system(tmp_path, {"s.yaml": graph(TALKER, LISTENER)}).nodes
    assert [node.full_name for node in nodes] == ["/a/talker", "/b/talker"]
    names = [port.full_name for port in nodes[0].ports]
    assert names == ["/a/chatter", "/a/talker/status", "/tf", "/b/tf", "/a/reset"]


def test_comments_and_texts_cannot_break_out_of_their_places(tmp_path: Path) -> None:
    node = FoundNode(
        "talker",
        keys={"class": "talker:Talker"},
        ports=(
            FoundPort(PortKind.PUBLISHER, "a", STRING, PRESETS["state"], comments=("x\nnode: y",)),
        ),
        parameters=(FoundParameter("p", "string", "${x} # \n"),),
        comments=("one\rtwo\u202e",),
    )
    text = write_node_type("talker", node)
    assert (
        text
        == """\
# one\\rtwo\\u202e
node: talker
class: "talker:Talker"
parameters:
  p: {type: string, default: "$${x} # \\n"}
publishers:
  # x\\nnode: y
  a: {type: std_msgs/msg/String, qos: state}
"""
    )


LARGE = 3_000_000


LIMITS: list[tuple[str, object, dict[str, object]]] = [
    ("bool", True, {"description": "\u202e"}),
    ("integer", 3, {"minimum": 5, "maximum": 1}),
    ("double", 3.0, {"minimum": 5.0}),
    ("double_array", [1.0, 3.0], {"maximum": 2.0}),
    ("integer", 3, {"minimum": 0, "step": 7}),
    ("integer", 3, {"step": -1}),
    ("double", 3.0, {"minimum": -math.inf, "maximum": math.nan}),
    ("double", 0.3, {"minimum": 0.0, "step": 0.1}),
]
NAMES = ("exposure.1", "1st gain", "a..b.", "/topic", "", "a\x1b[2J", "${text}")


@pytest.mark.slow  # megabytes are written and read
@pytest.mark.parametrize(
    ("parameters", "left_out"),
    [
        ([FoundParameter("text", "string", "x" * LARGE)], ["text"]),
        ([FoundParameter("numbers", "integer_array", [1] * 300_000)], ["numbers"]),
        ([FoundParameter("broken", "string", "a\x1b[2J")], ["broken"]),
        ([FoundParameter("broken", "double_array", [1.0, math.nan])], ["broken"]),
        ([FoundParameter(name, "integer", 1) for name in NAMES], ["", "a\x1b[2J", "${text}"]),
        *(([FoundParameter("a", *limits)], []) for limits in LIMITS),
    ],
)
def test_large_and_odd_values(
    parameters: list[FoundParameter], left_out: list[str], tmp_path: Path
) -> None:
    small = FoundParameter("small", "integer", 1)
    node = FoundNode("driver", keys={"external": True}, parameters=(small, *parameters))
    found = readable(FoundSystem("large", (node,)))
    [read] = valid_system(tmp_path, {"large.yaml": write_system(found)}).nodes
    names = {parameter.name.value for parameter in read.parameters}
    assert "small" in names
    missing = [item.name for item in parameters if item.name not in names]
    assert missing == left_out
    assert len(found.left_out) == len(missing)


@pytest.mark.slow
def test_nodes_that_a_file_cannot_hold_are_left_out() -> None:
    nodes = tuple(FoundNode(f"n{number}", keys={"external": True}) for number in range(3_000))
    found = readable(FoundSystem("large", nodes))
    assert len(found.nodes) == 2_500
    assert found.left_out[0] == "node /n2500: the file is full"
    assert write_system(found).count("the file is full") == 200
