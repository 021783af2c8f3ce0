from __future__ import annotations

from composer.model import Port, System
from composer.model.qos import PRESETS, Durability, QosProfile, Reliability
from tests.unit.support.resolving import quoted, system_of

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


def port(system: System, name: str) -> Port:
    found = system.nodes[0].port(name)
    assert found is not None
    return found


def test_profiles_are_built_on_what_they_extend() -> None:
    system = system_of(PROFILES)
    fast, slow, bare = (named.qos.profile for named in system.qos_profiles)
    assert fast == QosProfile(depth=1, reliability=Reliability.BEST_EFFORT, deadline_ms=200)
    assert slow == QosProfile(depth=5, reliability=Reliability.BEST_EFFORT, deadline_ms=200)
    assert bare == QosProfile(durability=Durability.TRANSIENT_LOCAL)
    assert [str(named.extends) for named in system.qos_profiles] == ["slow", "sensor_data", "None"]


def test_ports_take_profiles_by_name_or_inline() -> None:
    system = system_of(PROFILES)
    assert port(system, "by_profile").qos.profile.deadline_ms == 200
    assert port(system, "by_preset").qos.profile == PRESETS["state"]
    inline = port(system, "inline").qos
    assert (inline.profile.depth, inline.profile.reliability) == (1, Reliability.RELIABLE)
    assert port(system, "plain").qos.profile == QosProfile(depth=3)


def test_omitted_policies_have_rclpys_default_and_are_implicit() -> None:
    system = system_of(PROFILES)
    implicit = port(system, "implicit").qos
    assert (implicit.profile, implicit.explicit) == (PRESETS["command"], False)
    assert quoted(implicit.span) == "implicit"
    service = port(system, "service").qos
    assert (service.profile, service.explicit) == (PRESETS["services_default"], False)


def test_every_policy_knows_where_it_was_decided() -> None:
    system = system_of(PROFILES)
    qos = port(system, "by_profile").qos
    assert quoted(qos.span) == "fast"
    assert quoted(qos.policy_span("depth")) == "1"
    assert quoted(qos.policy_span("deadline_ms")) == "200"
    assert qos.policy_span("reliability") == qos.span
    inline = port(system, "inline").qos
    assert quoted(inline.policy_span("reliability")) == "reliable"
    assert quoted(inline.policy_span("depth")) == "1"


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
    lines = [f"  p{number}: {{extends: p{number + 1}}}" for number in range(5000)]
    text = "\n".join(["system: robot", "qos_profiles:", *lines, "  p5000: {depth: 3}"])
    system = system_of(text + "\nnodes: {robot: {}}\n")
    assert {named.qos.profile.depth for named in system.qos_profiles} == {3}
