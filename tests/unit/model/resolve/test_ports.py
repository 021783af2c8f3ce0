from __future__ import annotations

import pytest

from composer.model import Node
from tests.unit.support.resolving import quoted, resolve_text, system_of


def node_of(body: str) -> Node:
    """Return the inline node that a flow map declares."""
    return system_of(f"system: robot\nnodes:\n  robot: {body}\n").nodes[0]


def test_clients_wait_five_seconds_by_default() -> None:
    node = node_of(
        "{clients: {a: {type: a/srv/B}, b: {type: a/srv/B, timeout_ms: 200}},"
        " action_clients: {c: {type: a/action/B, result_timeout_ms: 60000}},"
        " services: {d: {type: a/srv/B}}}"
    )
    waits = {
        port.name.value: (
            port.timeout_ms.value if port.timeout_ms else None,
            port.result_timeout_ms.value if port.result_timeout_ms else None,
        )
        for port in node.ports
    }
    assert waits == {"a": (5000, None), "b": (200, None), "c": (5000, 60000), "d": (None, None)}


@pytest.mark.parametrize(
    ("body", "at"),
    [
        ('{subscriptions: {a: {type: x/msg/X, when: "message.data >"}}}', ">"),
        ('{subscriptions: {a: {type: x/msg/X, log: "so {message.}"}}}', "."),
        ('{timers: {t: {period_ms: "{1 +}"}}}', "+"),
        ('{timers: {t: {period_ms: "{count} ms"}}}', '"{count} ms"'),
        ('{on_activate: {set: {a: "{import os}"}}}', "import"),
        ('{action_servers: {g: {type: x/action/X, accept: "__import__"}}}', "__import__"),
    ],
)
def test_a_syntax_error_is_reported_at_its_place(body: str, at: str) -> None:
    _, diagnostics = resolve_text(f"system: robot\nnodes:\n  robot: {body}\n")
    assert [diagnostic.rule.name for diagnostic in diagnostics] == ["invalid-expression"]
    assert at in quoted(diagnostics[0].primary) or quoted(diagnostics[0].primary) in at


def test_a_node_keeps_the_valid_ports() -> None:
    system, _ = resolve_text("""\
        system: robot
        nodes:
          robot:
            publishers: {a: std_msgs/msg/String, b: {type: [1]}, c: {type: x/msg/X}}
            timers: {t: fast, u: {rate_hz: [1]}}
            services: 7
          other: 5
        connections: {a: b}
        """)
    robot, other = system.nodes
    # An unchecked placeholder replaces the missing part: one mistake, one diagnostic.
    assert [str(port.interface) for port in robot.ports] == ["${}", "${}", "x/msg/X"]
    assert [timer.name.value for timer in robot.timers] == ["t", "u"]
    assert other.ports == ()
    assert system.connections == ()
