"""What several systems, and a running graph, look like."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

from composer.graph.diagram import Format, Graph, Problem
from composer.graph.output import render
from composer.graph.views import View, build_graph, live_scene_of, scene_of
from composer.model import PortKind
from composer.model.qos import QosProfile, Reliability
from composer.plan.drift import ObservedEndpoint, ObservedNode, ObservedProcess, Snapshot
from tests.unit.support.checking import load_project
from tests.unit.support.resolving import system_of

STRING = "std_msgs/msg/String"
TALKING = """
    system: talking
    executors: {quick: {kind: single_threaded}}
    nodes:
      talker: {executor: quick, publishers: {chatter: {type: std_msgs/msg/String}}}
      echo:
        publishers: {loop: {type: std_msgs/msg/String}}
        subscriptions: {back: {type: std_msgs/msg/String, topic: loop}}
"""
LISTENING = """
    system: listening
    nodes:
      listener: {subscriptions: {chatter: {type: std_msgs/msg/String}}}
      talker: {}
"""


def both(view: View) -> Graph:
    return build_graph(scene_of([system_of(TALKING), system_of(LISTENING)]), view)


def test_several_systems_meet_on_their_topics_and_have_their_own_executors() -> None:
    graph = both(View.NODES)
    assert graph.title == "talking + listening"
    arrows = {(edge.source, edge.target) for edge in graph.edges}
    assert {("node:/talker", "topic:/chatter"), ("topic:/chatter", "node:/listener")} <= arrows
    lines = {vertex.key: vertex.lines for vertex in graph.vertices}
    assert lines["node:/listener"] == ("listener", "listening")
    # A name that two systems give is one node to ROS.
    wrong = {item.key: item.problem for item in graph.vertices if item.problem}
    assert wrong == {"node:/talker": Problem("two nodes are called '/talker'")}
    labels = [cluster.label for cluster in both(View.DEPLOYMENT).clusters]
    assert labels == [
        "talking · quick: single_threaded",
        "talking · default: events",
        "listening · default: events",
    ]


def test_a_node_that_subscribes_to_itself_has_an_arrow_to_itself() -> None:
    edges = build_graph(scene_of([system_of(TALKING)]), View.DEPLOYMENT).edges
    assert [(edge.source, edge.target) for edge in edges] == [("node:/echo", "node:/echo")]


def ends(kind: PortKind, topic: str, **policies: object) -> tuple[ObservedEndpoint, ...]:
    return (ObservedEndpoint(kind, topic, STRING, QosProfile(**policies)),)  # type: ignore[arg-type]


def seen() -> Snapshot:
    weak = {"reliability": Reliability.BEST_EFFORT}
    return Snapshot(
        (
            ObservedNode("/a/one", ends(PortKind.PUBLISHER, "/t", **weak), "active"),
            ObservedNode("/a/two", ends(PortKind.SUBSCRIPTION, "/t", **weak), None),
            ObservedNode("/b", ends(PortKind.PUBLISHER, "/u"), count=2),
            ObservedNode("/c", ends(PortKind.PUBLISHER, "/u")),
            ObservedNode("/_tool", ends(PortKind.SUBSCRIPTION, "/u")),
        )
    )


def test_a_running_graph_has_states_rates_and_reported_qos() -> None:
    graph = build_graph(live_scene_of(seen(), {"/t": 29.96, "/u": 5.0}))
    lines = {vertex.key: vertex.lines for vertex in graph.vertices}
    assert lines["node:/a/one"] == ("one", "active")
    assert lines["node:/a/two"] == ("two", "state unknown")
    assert lines["node:/c"] == ("c",)
    assert "node:/_tool" not in lines
    assert lines["topic:/u"] == ("/u", "String", "5 Hz")  # which of the two publishes is unknown
    wrong = {item.key: item.problem for item in graph.vertices if item.problem}
    assert wrong == {"node:/b": Problem("2 nodes have this name")}
    labels = {edge.key: edge.lines for edge in graph.edges}
    assert labels["publisher:/a/one./t"] == ("30 Hz", "best_effort, volatile")
    assert labels["subscription:/a/two./t"] == ()
    states = build_graph(live_scene_of(seen(), {}), View.STATES).vertices
    shown = {vertex.lines for vertex in states}
    assert {("active", "/a/one"), ("state unknown", "/a/two")} <= shown


def test_processes_and_hosts_of_a_running_graph() -> None:
    snapshot = replace(
        seen(),
        processes=(
            ObservedProcess("/s", "bench", "12", ("/a/one",)),
            ObservedProcess("/s/far", "", "", ("/a/two",)),
            ObservedProcess("/s/gone", "attic", "14", ("/gone",)),
        ),
    )
    graph = build_graph(live_scene_of(snapshot, {}), View.DEPLOYMENT)
    frames = [(frame.key, frame.label, frame.parent) for frame in graph.clusters]
    assert frames == [
        ("host:bench", "host bench", ""),
        ("process:/s", "/s: process 12", "host:bench"),
        ("process:/s/far", "/s/far: no response", ""),
    ]
    drawn = {vertex.key: (vertex.cluster, *vertex.lines) for vertex in graph.vertices}
    assert drawn["node:/a/one"] == ("process:/s", "/a/one", "active")
    assert drawn["node:/a/two"] == ("process:/s/far", "/a/two", "state unknown")
    assert drawn["node:/c"] == ("", "/c")


def test_parameters_that_are_not_finite_are_yaml_text(tmp_path: Path) -> None:
    parameters = "{a: {type: double, default: 1.0}, b: {type: double_array, default: [1.0]}}"
    files = {
        "s.yaml": "system: s\nparameter_files: [p.yaml]\n"
        f"nodes: {{n: {{parameters: {parameters}}}}}",
        "p.yaml": "n: {ros__parameters: {a: -.inf, b: [.nan, .inf, 2.0]}}",
    }
    declared = scene_of([load_project(tmp_path, files).system])
    live = live_scene_of(Snapshot((ObservedNode("/n", parameters={"a": math.nan}),)), {})
    shown = []
    for scene in (declared, live):
        (vertex,) = json.loads(render([build_graph(scene)], Format.JSON))["vertices"]
        shown.append(vertex["details"]["parameters"])
    assert shown == [{"a": "-.inf", "b": [".nan", ".inf", 2.0]}, {"a": ".nan"}]
