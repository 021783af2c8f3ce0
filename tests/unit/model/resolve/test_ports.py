"""Ports and timers: their times, their QoS, and the mistakes in them."""

from __future__ import annotations

import math

import pytest

from composer.base.source import SourceFile, Span
from composer.language.expressions import compile_expression
from composer.model import Period, PeriodError, PeriodUnit
from composer.model.qos import PRESETS, Durability, QosProfile, Reliability
from tests.unit.support.resolving import quoted, resolve_text, system_of


def test_clients_wait_five_seconds_by_default() -> None:
    system = system_of("""\
        system: robot
        nodes:
          robot:
            clients: {a: {type: a/srv/B}, b: {type: a/srv/B, timeout_ms: 200}}
            action_clients: {c: {type: a/action/B, result_timeout_ms: 60000}}
            services: {d: {type: a/srv/B}}
        """)
    waits = {
        port.name.value: [
            limit and limit.value for limit in (port.timeout_ms, port.result_timeout_ms)
        ]
        for port in system.nodes[0].ports
    }
    assert waits == {"a": [5000, None], "b": [200, None], "c": [5000, 60000], "d": [None, None]}


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
    assert (other.ports, system.connections) == ((), ())


SPAN = Span(SourceFile("system.yaml", ""), 1, 1)
MILLISECONDS, HERTZ = PeriodUnit


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (20.0, MILLISECONDS, 0.02),
        (20.0, HERTZ, 0.05),
        (compile_expression("parameters.rate * 2"), HERTZ, 0.1),
        *((value, unit, "must be positive and finite, not")
          for value in (0.0, -1.0, math.inf, math.nan) for unit in PeriodUnit),
        (compile_expression("1 / parameters.none"), MILLISECONDS, "period_ms cannot be"),
    ],
)  # fmt: skip
def test_periods_are_finite_and_above_0(
    value: float, unit: PeriodUnit, expected: float | str
) -> None:
    period = Period(value, unit, SPAN)
    parameters = {"rate": 5, "none": 0}
    if isinstance(expected, str):
        with pytest.raises(PeriodError, match=expected):
            period.seconds(parameters)
    else:
        assert period.seconds(parameters) == pytest.approx(expected)


PROFILES = """\
    system: robot
    qos_profiles:
      fast: {extends: slow, depth: 1}
      slow: {extends: sensor_data, deadline_ms: 200, lifespan_ms: null}
      bare: {durability: transient_local}
    nodes:
      robot:
        publishers:
          by_profile: {type: x/msg/X, qos: fast}
          by_preset: {type: x/msg/X, qos: state}
          inline: {type: x/msg/X, qos: {extends: fast, reliability: reliable}}
          plain: {type: x/msg/X, qos: {depth: 3}}
          implicit: {type: x/msg/X}
          unknown: {type: x/msg/X, qos: nothing}
        services:
          service: {type: x/srv/X}
    """


def test_profiles_are_built_on_what_they_extend() -> None:
    system = system_of(PROFILES)
    fast, slow, bare = (named.qos.profile for named in system.qos_profiles)
    assert fast == QosProfile(depth=1, reliability=Reliability.BEST_EFFORT, deadline_ms=200)
    assert slow == QosProfile(depth=5, reliability=Reliability.BEST_EFFORT, deadline_ms=200)
    assert bare == QosProfile(durability=Durability.TRANSIENT_LOCAL)
    assert [str(named.extends) for named in system.qos_profiles] == ["slow", "sensor_data", "None"]


def test_ports_take_profiles_by_name_or_inline_and_have_rclpys_defaults() -> None:
    qos = {port.name.value: port.qos for port in system_of(PROFILES).nodes[0].ports}
    assert qos["by_profile"].profile.deadline_ms == 200
    assert qos["by_preset"].profile == PRESETS["state"]
    inline = qos["inline"].profile
    assert (inline.depth, inline.reliability) == (1, Reliability.RELIABLE)
    assert qos["plain"].profile == QosProfile(depth=3)
    for name, preset in (("implicit", "command"), ("service", "services_default")):
        assert (qos[name].profile, qos[name].explicit) == (PRESETS[preset], False)
    # Every policy knows where it was decided.
    assert quoted(qos["implicit"].span) == "implicit"
    by_profile = qos["by_profile"]
    assert quoted(by_profile.span) == "fast"
    assert quoted(by_profile.policy_span("depth")) == "1"
    assert quoted(by_profile.policy_span("deadline_ms")) == "200"
    assert by_profile.policy_span("reliability") == by_profile.span
    assert quoted(qos["inline"].policy_span("reliability")) == "reliable"
    assert quoted(qos["inline"].policy_span("depth")) == "1"


def test_profiles_that_extend_each_other_in_a_circle_still_give_something() -> None:
    system = system_of("""\
        system: robot
        qos_profiles:
          a: {extends: b, depth: 1}
          b: {extends: c, depth: 2}
          c: {extends: a, reliability: best_effort}
          itself: {extends: itself, depth: 7}
          lost: {extends: nowhere, depth: 8}
        nodes: {robot: {}}
        """)
    profiles = {named.name.value: named.qos.profile for named in system.qos_profiles}
    assert profiles["a"] == QosProfile(depth=1, reliability=Reliability.BEST_EFFORT)
    assert profiles["itself"] == QosProfile(depth=7)
    assert profiles["lost"] == QosProfile(depth=8)


def test_a_long_chain_of_profiles_is_resolved() -> None:
    lines = [f"  p{number}: {{extends: p{number + 1}}}" for number in range(1500)]
    text = "\n".join(["system: robot", "qos_profiles:", *lines, "  p1500: {depth: 3}"])
    system = system_of(text + "\nnodes: {robot: {}}\n")
    assert {named.qos.profile.depth for named in system.qos_profiles} == {3}
