from __future__ import annotations

import pytest

from composer.language.expressions import Expression
from composer.language.templates import Computed, Constant, Record, Text
from composer.model import Event, LogLevel, Node, PeriodUnit, PortKind
from tests.unit.support.resolving import quoted, resolve_text, system_of


def node_of(body: str) -> Node:
    """Return the inline node that a flow map declares."""
    return system_of(f"system: robot\nnodes:\n  robot: {body}\n").nodes[0]


def test_every_kind_of_port_has_its_section() -> None:
    sections = ", ".join(
        f"{kind.section}: {{p{number}: {{type: a/b/C}}}}" for number, kind in enumerate(PortKind)
    )
    node = node_of("{" + sections + "}")
    assert [(port.name.value, port.kind) for port in node.ports] == [
        (f"p{number}", kind) for number, kind in enumerate(PortKind)
    ]
    assert node.ports_of(PortKind.CLIENT, PortKind.SERVICE) == (node.ports[2], node.ports[3])


def test_a_port_says_what_it_is() -> None:
    node = node_of(
        "{subscriptions: {scan: {type: a/msg/B, topic: ~/raw, external: true, required: false,"
        " reentrant: true, description: From the laser.}}}"
    )
    (scan,) = node.ports
    assert (str(scan.name), str(scan.interface), str(scan.ros_name)) == ("scan", "a/msg/B", "~/raw")
    assert scan.full_name == "/robot/raw"
    assert (scan.external, scan.required, scan.reentrant) == (True, False, True)
    assert scan.description == "From the laser."
    assert [quoted(item.span) for item in (scan, scan.interface, scan.ros_name)] == [
        "scan",
        "a/msg/B",
        "~/raw",
    ]


def test_a_port_is_called_as_its_kind_of_channel_says() -> None:
    node = node_of(
        "{services: {plan: {type: a/srv/B, service: /plans}},"
        " action_clients: {go: {type: a/action/B, action: /going}}}"
    )
    assert [port.full_name for port in node.ports] == ["/plans", "/going"]


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


def test_reactions_belong_to_events() -> None:
    node = node_of(
        "{subscriptions: {a: {type: x/msg/X, log: a}, quiet: {type: x/msg/X}},"
        " services: {b: {type: x/srv/X, respond: {success: true}}},"
        " clients: {c: {type: x/srv/X, on_response: {log: c}, on_failure: {log: c}}},"
        " action_servers: {d: {type: x/action/X, log: d}},"
        " action_clients: {e: {type: x/action/X, on_feedback: {log: e}, on_result: {log: e},"
        " on_failure: {log: e}}},"
        " timers: {t: {period_ms: 5, log: t}},"
        " on_configure: {log: x}, on_activate: {log: x}, on_deactivate: {log: x},"
        " on_cleanup: {log: x}}"
    )
    assert {port.name.value: [event for event, _ in port.reactions] for port in node.ports} == {
        "a": [Event.MESSAGE],
        "quiet": [],
        "b": [Event.REQUEST],
        "c": [Event.RESPONSE, Event.FAILURE],
        "d": [Event.GOAL],
        "e": [Event.FEEDBACK, Event.RESULT, Event.FAILURE],
    }
    assert [event for event, _ in node.reactions] == [
        Event.CONFIGURE,
        Event.ACTIVATE,
        Event.DEACTIVATE,
        Event.CLEANUP,
    ]
    assert node.timers[0].reaction is not None


def test_a_reaction_says_what_is_done() -> None:
    node = node_of(
        "{state: {n: 0}, clients: {ask: {type: x/srv/X}}, publishers: {out: {type: x/msg/X}},"
        " subscriptions: {in: {type: x/msg/X,"
        ' when: "message.data > 1", set: {n: "{state.n + 1}"},'
        ' log: {level: warn, message: "got {message.data:.2f}"},'
        ' publish: {out: "{message}"}, call: {ask: {data: 3}}}}}'
    )
    port = node.port("in")
    assert port is not None
    reaction = port.reaction(Event.MESSAGE)
    assert reaction is not None
    assert str(reaction.when) == "message.data > 1"
    assert reaction.when_span is not None
    assert quoted(reaction.when_span) == "message.data > 1"
    ((state, value),) = reaction.state
    assert state.value == "n"
    assert isinstance(value, Computed)
    assert isinstance(reaction.log, Text)
    assert reaction.log_level is LogLevel.WARN
    (publish,) = reaction.publish
    assert quoted(publish.port.span) == "out"
    assert isinstance(publish.content, Computed)
    (call,) = reaction.call
    assert isinstance(call.content, Record)
    assert reaction.respond is None


def test_an_action_server_declares_goal_feedback_and_result() -> None:
    node = node_of(
        "{action_servers: {go: {type: x/action/X, accept: goal.order > 0,"
        ' feedback: {count: 10, period_ms: 50, message: {step: "{count}"}}, result: {ok: true}}}}'
    )
    (go,) = node.ports
    assert str(go.accept) == "goal.order > 0"
    assert go.accept_span is not None
    assert quoted(go.accept_span) == "goal.order > 0"
    assert go.feedback is not None
    assert (go.feedback.count.value, go.feedback.period_ms.value) == (10, 50)
    assert isinstance(go.result, Record)
    assert isinstance(go.result.fields[0][1], Constant)


@pytest.mark.parametrize(
    ("written", "value", "unit"),
    [
        ("period_ms: 20", 20, PeriodUnit.MILLISECONDS),
        ("period_ms: 0.5", 0.5, PeriodUnit.MILLISECONDS),
        ("rate_hz: 30", 30, PeriodUnit.HERTZ),
        ('rate_hz: "{parameters.rate_hz}"', "parameters.rate_hz", PeriodUnit.HERTZ),
    ],
)
def test_a_timer_says_how_often(written: str, value: object, unit: PeriodUnit) -> None:
    period = node_of(f"{{timers: {{tick: {{{written}}}}}}}").timers[0].period
    shown = str(period.value) if isinstance(period.value, Expression) else period.value
    assert (shown, period.unit) == (value, unit)
    assert quoted(period.span) in written


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
