"""What the views of systems show, besides the golden pictures of ``depot.yaml``."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from composer.graph.diagram import Graph, Mark, Problem, worst
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load_bytes
from tests.unit.support.resolving import system_of


def drawn(text: str, view: View = View.NODES) -> Graph:
    return build_graph(scene_of([system_of(text)]), view)


def test_namespaces_are_frames_and_one_that_holds_one_other_is_none() -> None:
    nodes = "{one: {namespace: a/b/c}, two: {namespace: a/b/d}, three: {namespace: x/y/z}}"
    clusters = drawn(f"system: nested\nnodes: {nodes}\n").clusters
    assert {cluster.key: cluster.parent for cluster in clusters} == {
        "/a/b": "",
        "/a/b/c": "/a/b",
        "/a/b/d": "/a/b",
        "/x/y/z": "",
    }


def test_a_timer_with_a_condition_promises_no_rate() -> None:
    edges = drawn("""
        system: talk
        nodes:
          talker:
            publishers: {chatter: {type: std_msgs/msg/String, qos: sensor_data}}
            timers: {tick: {rate_hz: 4, when: count > 3, publish: {chatter: {data: hello}}}}
    """).edges
    assert [edge.lines for edge in edges] == [("sensor_data",)]


def test_the_deployment_view_draws_components_in_their_containers() -> None:
    component = 'component: {package: demo, plugin: "demo::Camera"}'
    text = f"""
        system: robot
        processes: {{vision: {{nodes: [box, camera]}}}}
        nodes:
          box: {{external: true}}
          camera: {{{component}, container: box}}
          outer: {{executable: {{command: [sh]}}}}
          lidar: {{{component}, container: outer}}
          lost: {{{component}}}
    """
    graph = drawn(text, View.DEPLOYMENT)
    frames = {cluster.key: (cluster.label, cluster.parent) for cluster in graph.clusters}
    placed = {vertex.key: frames[vertex.cluster] for vertex in graph.vertices}
    vision = next(key for key, (label, _) in frames.items() if label == "process vision")
    assert placed == {
        "node:/box": ("container box", vision),
        "node:/camera": ("container box", vision),
        "node:/outer": ("container outer", ""),
        "node:/lidar": ("container outer", ""),
        "node:/lost": ("components", ""),
    }


@pytest.mark.parametrize("view", [View.CONNECTIONS, View.DEPLOYMENT])
def test_a_topic_with_many_ports_has_few_arrows(view: View) -> None:
    port = "{type: std_msgs/msg/String, topic: /status}"
    text = f"""
        system: crowd
        nodes:
          in${{i}}: {{for_each: {{i: 30}}, publishers: {{out: {port}}}}}
          out${{i}}: {{for_each: {{i: 30}}, subscriptions: {{in: {port}}}}}
    """
    edges = drawn(text, view).edges
    assert len(edges) == 59
    assert all("not all are drawn" in "\n".join(edge.lines) for edge in edges)
    nodes = {name.partition("/")[2] for edge in edges for name in (edge.source, edge.target)}
    assert len(nodes) == 60


def test_the_position_of_a_diagnostic_is_marked() -> None:
    text = """
        system: broken
        nodes:
          fine: {publishers: {out: {type: std_msgs/msg/String, topic: /talk, qos: sensor_data}}}
          strict: {subscriptions: {talk: {type: std_msgs/msg/String, topic: /talk, qos: command}}}
          lost: {lifecycle: {depends_on: [missing]}}
    """
    loading = load_bytes(dedent(text).encode(), Path("/nowhere"), shown="broken.yaml")
    graph = build_graph(scene_of([loading.system], loading.diagnostics))
    marked = {item.key: item.problem.mark for item in graph.vertices if item.problem}
    assert marked == {"node:/lost": Mark.WRONG}
    found = {edge.target: edge.problem for edge in graph.edges if edge.problem}
    marks = {target: problem.mark for target, problem in found.items()}
    assert marks == dict.fromkeys(("topic:/talk", "node:/strict"), Mark.WRONG)
    assert "reliab" in found["node:/strict"].text


@pytest.mark.parametrize("view", View)
def test_a_node_without_a_name_is_drawn(view: View) -> None:
    text = 'system: a\nnodes: {"": {publishers: {"": {type: std_msgs/msg/String}}}}\n'
    picture = render([drawn(text, view)], Format.SVG)
    assert picture.startswith(b"<svg")


def test_an_error_marks_a_part_also_if_a_warning_comes_first() -> None:
    warning, error = Problem("doubtful", Mark.DOUBTFUL), Problem("wrong")
    assert worst((None, warning, error)) == error
    assert worst((None, warning)) == warning
    assert worst((None,)) is None
