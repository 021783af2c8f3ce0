"""Connections and remappings: the names, the QoS and the delivery of ports."""

from __future__ import annotations

import pytest

from composer.model import Delivery, Isolation, System
from tests.unit.support.resolving import quoted, system_of

NODES = """\
    system: robot
    namespace: robot1
    qos_profiles: {odometry: {extends: sensor_data, depth: 1}}
    nodes:
      a:
        namespace: left
        publishers: {out: {type: x/msg/X, qos: state}, spare: {type: x/msg/X}}
        services: {ask: {type: x/srv/X}}
        remappings: {out: /remapped, spare: other}
      b:
        subscriptions: {in: {type: x/msg/X}}
        clients: {ask: {type: x/srv/X}}
"""


def connected(*connections: str) -> System:
    lines = [f"      - {connection}\n" for connection in connections]
    return system_of(f"{NODES}    connections:\n{''.join(lines)}")


def full_names(system: System) -> dict[str, str]:
    return {
        f"{node.name.value}.{port.name.value}": port.full_name
        for node in system.nodes
        for port in node.ports
    }


def test_without_connections_names_are_expanded_and_remapped() -> None:
    assert full_names(system_of(NODES)) == {
        "a.out": "/remapped",
        "a.spare": "/robot1/left/other",
        "a.ask": "/robot1/left/ask",
        "b.in": "/robot1/in",
        "b.ask": "/robot1/ask",
    }


def test_a_remapping_matches_by_the_expanded_name() -> None:
    system = system_of("""\
        system: robot
        nodes:
          a:
            namespace: left
            publishers: {x: {type: x/msg/X, topic: /left/y}, z: {type: x/msg/X, topic: ~/z}}
            remappings: {y: w, /left/a/z: ~/v, never: mind}
        """)
    assert full_names(system) == {"a.x": "/left/w", "a.z": "/left/a/v"}
    first = system.nodes[0].remappings[0]
    assert (quoted(first.source.span), quoted(first.target.span)) == ("y", "w")


def test_a_connections_profile_wins_over_the_ports() -> None:
    system = connected("{topic: data, from: a.out, to: b.in, qos: odometry}")
    for end in (system.node("a").port("out"), system.node("b").port("in")):
        assert (end.qos.profile.depth, end.qos.explicit) == (1, True)
        assert quoted(end.qos.span) == "odometry"
        assert quoted(end.qos.policy_span("depth")) == "1"
    assert [reference.name.value for reference in system.qos_references].count("odometry") == 1


def test_an_unknown_name_in_a_connection_stays_as_written() -> None:
    system = connected("{topic: data, from: missing.out, to: [b.no, b, '']}")
    (data,) = system.connections
    assert [str(end.text) for end in data.sinks] == ["b.no", "b", ""]
    assert [(end.node, end.port) for end in data.sinks] == [("b", "no"), ("", "b"), ("", "")]
    assert all(system.port(end) is None for end in (*data.sources, *data.sinks))


@pytest.mark.parametrize(
    ("connections", "port", "full_name"),
    [
        pytest.param(
            ["{topic: data, from: a.ask, to: b.in}"], "a.ask", "/robot1/left/ask", id="other kind"
        ),
        pytest.param(
            ["{topic: one, from: a.out}", "{topic: two, from: a.out, qos: state}",
             "{topic: one, from: a.out, to: b.in, qos: odometry}"],
            "a.out", "/robot1/one", id="the first of two counts",
        ),
    ],
)  # fmt: skip
def test_names_with_doubtful_connections(connections: list[str], port: str, full_name: str) -> None:
    system = connected(*connections)
    assert full_names(system)[port] == full_name
    assert system.nodes[0].port("out").qos.profile.depth == 1


def test_a_connection_says_how_its_ports_are_joined_and_others_follow_the_system() -> None:
    system = system_of("""
    system: ways
    delivery: dds
    nodes:
      talker: {publishers: {a: {type: std_msgs/msg/String}, b: {type: std_msgs/msg/String}}}
      listener: {subscriptions: {a: {type: std_msgs/msg/String}}}
    connections:
      - {topic: /a, from: talker.a, to: listener.a, delivery: auto, isolation: copy}
    """)
    assert system.delivery is Delivery.DDS
    for port in (system.node("talker").port("a"), system.node("listener").port("a")):
        assert (port.delivery, port.isolation) == (Delivery.AUTO, Isolation.COPY)
    free = system.node("talker").port("b")
    assert (free.delivery, free.isolation) == (None, Isolation.SHARE)
