"""The differences between a declared system and an observed graph, without ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from composer.model import PortKind, PrimaryState
from composer.model.qos import Durability, QosProfile, Reliability
from composer.plan.drift import (
    Debouncer,
    Drift,
    DriftChange,
    DriftKind,
    ObservedEndpoint,
    ObservedNode,
    Snapshot,
    compare,
)
from tests.unit.support.resolving import system_of

SYSTEM = system_of("""
    system: shop
    nodes:
      clerk:
        namespace: front
        parameters: {speed: 1.5, on: true, tags: [a, b]}
        publishers: {bill: {type: std_msgs/msg/String, topic: /bill, qos: state}}
        services: {ask: {type: std_srvs/srv/Trigger, respond: {success: true}}}
      guard:
        lifecycle: {autostart: inactive}
        subscriptions: {bill: {type: std_msgs/msg/String, topic: /bill, qos: command}}
      sleeper:
        lifecycle: {autostart: unconfigured}
        publishers: {dream: {type: std_msgs/msg/String}}
""")
STRING = "std_msgs/msg/String"
STATE = QosProfile(durability=Durability.TRANSIENT_LOCAL)
BILL = ObservedEndpoint(PortKind.PUBLISHER, "/bill", STRING, STATE)
ASK = ObservedEndpoint(PortKind.SERVICE, "/front/ask", "std_srvs/srv/Trigger")
VALUES = {"speed": 1.5, "on": True, "tags": ["a", "b"]}
CLERK = ObservedNode("/front/clerk", (BILL, ASK), "active", VALUES)
SILENT = ("lifecycle state", "parameters")
GUARD = ObservedNode(
    "/guard", (ObservedEndpoint(PortKind.SUBSCRIPTION, "/bill", STRING, QosProfile()),), "inactive"
)
SLEEPER = ObservedNode("/sleeper", (), "unconfigured")
ALL = (CLERK, GUARD, SLEEPER)


def differences(*nodes: ObservedNode, **options: object) -> list[str]:
    return [drift.message for drift in found(*nodes, **options)]


def found(*nodes: ObservedNode, **options: object) -> tuple[Drift, ...]:
    return compare(SYSTEM, Snapshot(nodes), **options)  # type: ignore[arg-type]


def test_a_missing_node_is_reported_with_the_most_similar_one() -> None:
    (missing, _) = found(replace(CLERK, full_name="/clerk"), GUARD, SLEEPER)
    assert "'/clerk' exists" in missing.hint, "in another namespace"
    clark = replace(CLERK, full_name="/front/clark")
    missing, extra = found(clark, GUARD, SLEEPER)
    assert missing.message == "/front/clerk: the node does not exist"
    assert missing.hint == "'/front/clark' exists: did you mean that?"
    assert missing.span is not None
    assert extra.message == "/front/clark: the node exists, but is not declared"


def test_undeclared_nodes_are_extra_unless_ignored_hidden_or_the_manager() -> None:
    manager = ObservedNode(
        "/shop/manager",
        (ObservedEndpoint(PortKind.SERVICE, "/shop/manager/is_active", "std_srvs/srv/Trigger"),),
    )
    assert differences(*ALL, manager, ObservedNode("/_ros2cli_7")) == []
    assert differences(*ALL, ObservedNode("/other/manager")) == [
        "/other/manager: the node exists, but is not declared"
    ]
    assert differences(*ALL, ObservedNode("/rviz2"), ignored=["/rviz*"]) == []
    for name in ("/rviz2", "/_ros2cli_7"):  # another type is reported for any node
        other = ObservedEndpoint(PortKind.PUBLISHER, "/bill", "std_msgs/msg/Int8")
        text = f"{name}: type of its publisher /bill is std_msgs/msg/Int8, declared {STRING}"
        assert text in differences(*ALL, ObservedNode(name, (other,)), ignored=["/rviz*"])


def test_a_missing_endpoint_is_reported_with_the_most_similar_one() -> None:
    bills = replace(BILL, name="/bills")
    missing, extra = found(replace(CLERK, endpoints=(bills, ASK)), GUARD, SLEEPER)
    assert missing.kind is DriftKind.MISSING_ENDPOINT
    assert missing.message == "/front/clerk: publisher /bill is missing"
    assert missing.hint == "it has '/bills': did you mean that?"
    assert extra.message == "/front/clerk: publisher /bills exists, but is not declared"


def test_only_an_unconfigured_node_needs_no_endpoints() -> None:
    gone = found(replace(CLERK, endpoints=(), state="unconfigured"), GUARD, SLEEPER)
    assert [drift.message for drift in gone] == [
        "/front/clerk: lifecycle state is unconfigured, declared active",
        "/front/clerk: publisher /bill is missing",
        "/front/clerk: service /front/ask is missing",
    ]
    assert gone[1].hint == "the node is unconfigured: it has no ports"
    assert differences(CLERK, GUARD, replace(SLEEPER, state="inactive")) == [
        "/sleeper: lifecycle state is inactive, declared unconfigured",
        "/sleeper: publisher /dream is missing",
    ]
    inactive = replace(CLERK, state="inactive")
    assert differences(inactive, GUARD, SLEEPER, autostart=PrimaryState.INACTIVE) == []


def bill(**changes: Any) -> dict[str, Any]:
    """Return the endpoints of the clerk, with a change of one of them or of its profile."""
    if not changes.keys() & {"type", "name"}:
        changes = {"qos": replace(STATE, **changes)}
    return {"endpoints": (replace(BILL, **changes), ASK)}


def values(**changes: Any) -> dict[str, Any]:
    return {"parameters": {**VALUES, **changes}}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, []),
        (
            bill(type="std_msgs/msg/Int8"),
            [f"type of publisher /bill is std_msgs/msg/Int8, declared {STRING}"],
        ),
        (
            bill(reliability=Reliability.BEST_EFFORT),
            ["reliability of publisher /bill is best_effort, declared reliable"],
        ),
        (
            bill(durability=Durability.VOLATILE),
            ["durability of publisher /bill is volatile, declared transient_local"],
        ),
        (bill(deadline_ms=20.0), ["deadline_ms of publisher /bill is 20, declared no limit"]),
        (bill(depth=77), []),  # discovery does not report it
        (values(speed=2.5), ["parameter speed is 2.5, declared 1.5"]),
        (values(on=1), ["parameter on is 1, declared true"]),
        (values(tags=["a"]), ["parameter tags is ['a'], declared ['a', 'b']"]),
        (values(use_sim_time=True), []),
        ({"parameters": {"on": True, "tags": ["a", "b"]}}, ["parameter speed is missing"]),
        ({"count": 2}, ["2 nodes have this name"]),
        ({"state": ""}, ["lifecycle state is none: it is not a lifecycle node, declared active"]),
        (
            {"state": None, "parameters": None},
            [f"no response to the request for its {what}" for what in SILENT],
        ),
    ],
)
def test_differences_of_a_node(change: dict[str, Any], expected: list[str]) -> None:
    clerk = replace(CLERK, **change)
    assert differences(clerk, GUARD, SLEEPER) == [f"/front/clerk: {text}" for text in expected]


@pytest.mark.parametrize(
    ("kind", "name", "type_name"),
    [
        (PortKind.PUBLISHER, "/rosout", "rcl_interfaces/msg/Log"),
        (PortKind.PUBLISHER, "/a/transition_event", "lifecycle_msgs/msg/TransitionEvent"),
        (PortKind.SERVICE, "/a/get_parameters", "rcl_interfaces/srv/GetParameters"),
        (PortKind.CLIENT, "/a/change_state", "lifecycle_msgs/srv/ChangeState"),
    ],
)
def test_endpoints_for_tools_are_recognized(kind: PortKind, name: str, type_name: str) -> None:
    assert ObservedEndpoint(kind, name, type_name).is_for_tools
    assert not ObservedEndpoint(kind, name, "example_interfaces/msg/Other").is_for_tools
    assert not ObservedEndpoint(kind, f"{name}_more", type_name).is_for_tools


@pytest.mark.parametrize(
    ("settings", "nodes", "expected"),
    [
        ("}", [ObservedNode("/driver", (BILL,))], []),
        # its ports are compared only if some are declared
        (
            "}, services: {ask: {type: std_srvs/srv/Trigger}}",
            [ObservedNode("/driver", (BILL,))],
            ["service /ask is missing", "publisher /bill exists, but is not declared"],
        ),
        (
            ", nodes: [base, drive/wheels]}",
            [ObservedNode("/base"), ObservedNode("/drive/wheels")],
            [],
        ),
        (", nodes: [base, drive/wheels]}", [ObservedNode("/base")], ["the node does not exist"]),
    ],
)
def test_nodes_and_ports_of_other_programs(
    settings: str, nodes: list[ObservedNode], expected: list[str]
) -> None:
    text = f"system: shop\nnodes: {{driver: {{executable: {{command: [driver]{settings}}}}}\n"
    found = compare(system_of(text), Snapshot(tuple(nodes)))
    assert [drift.message.partition(": ")[2] for drift in found] == expected


def test_a_parameter_that_is_only_passed_on_may_be_missing() -> None:
    system = system_of("{system: robot, nodes: {arm: {executable: {command: [arm]}}}}")
    passed_on = SYSTEM.nodes[0].parameters[:1]
    system = replace(system, nodes=(replace(system.nodes[0], undeclared_parameters=passed_on),))
    assert compare(system, Snapshot((ObservedNode("/arm"),))) == ()
    (wrong,) = compare(system, Snapshot((ObservedNode("/arm", parameters={"speed": 2.0}),)))
    assert wrong.message == "/arm: parameter speed is 2.0, declared 1.5"


SPEED = Drift(DriftKind.WRONG_PARAMETER, "/clerk", "parameter speed", "1.0", "2.0")
GONE = Drift(DriftKind.MISSING_NODE, "/guard")
NOTHING = DriftChange((), ())


def test_a_short_difference_is_never_reported() -> None:
    debouncer = Debouncer(2.0)
    assert debouncer.update(0.0, [SPEED]) == NOTHING
    assert debouncer.update(1.9, [SPEED]) == NOTHING
    assert debouncer.update(2.5, []) == NOTHING
    assert debouncer.update(3.0, [SPEED]) == NOTHING  # counted from the beginning again
    assert debouncer.reported == ()


def test_a_lasting_difference_is_reported_once_and_again_when_resolved() -> None:
    debouncer = Debouncer(2.0)
    faster = replace(SPEED, live="3.0")
    debouncer.update(0.0, [SPEED])
    assert not debouncer.is_settled([SPEED])
    assert debouncer.update(2.0, [SPEED, GONE]) == DriftChange((SPEED,), ())
    assert debouncer.is_settled([SPEED])
    assert not debouncer.is_settled([SPEED, GONE])
    assert debouncer.is_settled([])
    assert debouncer.update(3.0, [SPEED, GONE]) == NOTHING
    assert debouncer.update(3.1, [faster, GONE]) == DriftChange((faster,), ()), "at once"
    assert debouncer.update(4.0, [GONE]) == DriftChange((GONE,), (faster,))
    assert debouncer.reported == (GONE,)
    assert debouncer.update(5.0, []) == DriftChange((), (GONE,))


def test_transforms_are_published_by_their_node_and_received_by_the_manager() -> None:
    system = system_of("""
        system: frames
        nodes:
          mounts:
            transforms:
              static: {laser: {parent: base_link, translation_m: {x: 1}}}
              lookup: [laser]
          viewer:
            external: true
            publishers: {bill: {type: std_msgs/msg/String, topic: /bill, qos: state}}
            transforms: {lookup: [laser]}
    """)
    message, latched = "tf2_msgs/msg/TFMessage", QosProfile(durability=Durability.TRANSIENT_LOCAL)
    static = ObservedEndpoint(PortKind.PUBLISHER, "/tf_static", message, latched)
    listens = ObservedEndpoint(PortKind.SUBSCRIPTION, "/tf_static", message, latched)
    viewer = ObservedNode("/viewer", (BILL, listens), "")
    mounts = ObservedNode("/mounts", (static,), "active")
    missing = compare(system, Snapshot((mounts, viewer)))
    assert [item.subject for item in missing if "/tf" in item.subject] == ["subscription /tf"]
    missing = compare(system, Snapshot((replace(mounts, endpoints=()), viewer)))
    subjects = [item.subject for item in missing if item.node == "/mounts"]
    assert subjects == ["publisher /tf_static"]
