from __future__ import annotations

import time

import pytest

from composer.model import PrimaryState
from composer.model.dependencies import dependency_cycles, dependency_edges, in_dependency_order
from composer.plan import Plan, bring_up, tear_down
from tests.unit.support.resolving import system_of


def steps(plan: Plan) -> list[str]:
    return [f"{step.transition} {step.node}" for step in plan.steps]


def causes(plan: Plan) -> dict[str, str]:
    return {step.node: step.cause for step in plan.steps}


def system_with(*nodes: str, head: str = "") -> str:
    lines = [f"  {node}" for node in nodes]
    return "\n".join(["system: robot", *([head] if head else []), "nodes:", *lines]) + "\n"


@pytest.mark.parametrize(
    ("own", "given", "expected"),
    [
        ("active", None, ["configure a", "activate a"]),
        ("inactive", None, ["configure a"]),
        ("unconfigured", None, []),
        ("active", PrimaryState.INACTIVE, ["configure a"]),
        ("inactive", PrimaryState.ACTIVE, ["configure a", "activate a"]),
        ("active", PrimaryState.UNCONFIGURED, []),
    ],
)
def test_autostart_says_how_far(own: str, given: PrimaryState | None, expected: list[str]) -> None:
    system = system_of(system_with("a: {}", head=f"lifecycle: {{autostart: {own}}}"))
    assert steps(bring_up(system, given)) == expected


def test_a_node_goes_no_further_than_its_own_autostart() -> None:
    system = system_of(
        system_with(
            "late: {lifecycle: {autostart: unconfigured}}",
            "waiting: {lifecycle: {autostart: inactive}}",
            "eager: {lifecycle: {autostart: active}}",
        )
    )
    plan = bring_up(system)
    assert steps(plan) == ["configure waiting", "configure eager", "activate eager"]
    assert causes(plan)["waiting"] == "its own autostart is inactive"
    assert steps(bring_up(system, PrimaryState.INACTIVE)) == [
        "configure waiting",
        "configure eager",
    ]


def test_a_node_goes_no_further_than_what_it_depends_on_lets_it() -> None:
    system = system_of(
        system_with(
            "needs_active: {lifecycle: {depends_on: [waiting]}}",
            "needs_inactive: {lifecycle: {depends_on: {waiting: inactive}}}",
            "needs_late: {lifecycle: {depends_on: [late]}}",
            "waiting: {lifecycle: {autostart: inactive}}",
            "late: {lifecycle: {autostart: unconfigured}}",
        )
    )
    assert steps(bring_up(system)) == [
        "configure waiting",
        "configure needs_active",
        "configure needs_inactive",
        "activate needs_inactive",
    ]


SERVING = (
    "client: {clients: {ask: {type: x/srv/X}}}",
    "goer: {action_clients: {go: {type: x/action/X}}}",
    "server: {services: {ask: {type: x/srv/X}}, action_servers: {go: {type: x/action/X}}}",
)


def test_servers_start_before_their_clients() -> None:
    system = system_of(system_with(*SERVING))
    plan = bring_up(system)
    assert steps(plan)[:3] == ["configure server", "configure client", "configure goer"]
    cause = "goer and client call it, and servers start before their clients"
    assert causes(plan)["server"] == cause


def test_declared_dependencies_override_the_wiring() -> None:
    server = SERVING[2].removesuffix("}") + ", lifecycle: {depends_on: [client]}}"
    system = system_of(system_with(SERVING[0], SERVING[1], server))
    assert steps(bring_up(system))[:3] == ["configure client", "configure server", "configure goer"]


def test_nodes_that_serve_each_other_keep_the_order_they_are_declared_in() -> None:
    system = system_of(
        system_with(
            "a: {services: {x: {type: x/srv/X}}, clients: {y: {type: x/srv/X}}}",
            "b: {services: {y: {type: x/srv/X}}, clients: {x: {type: x/srv/X}}}",
        )
    )
    assert dependency_edges(system) == ()
    assert steps(bring_up(system))[:2] == ["configure a", "configure b"]


def test_a_plan_ends_even_where_dependencies_go_round_in_a_circle() -> None:
    system = system_of(
        system_with(
            "after: {lifecycle: {depends_on: [a]}}",
            "a: {lifecycle: {depends_on: [b]}}",
            "b: {lifecycle: {depends_on: [a, b]}}",
        )
    )
    assert sorted(in_dependency_order(system)) == ["a", "after", "b"]
    assert len(bring_up(system).steps) == 6
    assert len(tear_down(system).steps) == 9


@pytest.mark.slow  # 3000 nodes
def test_a_long_chain_takes_no_time_and_no_stack() -> None:
    count = 3000
    chain = (
        f"n{number}: {{lifecycle: {{depends_on: [n{number + 1}]}}}}" for number in range(count)
    )
    system = system_of(system_with(*chain, f"n{count}: {{}}"))
    start = time.process_time()
    plan = bring_up(system)
    assert dependency_cycles(system) == ()
    assert time.process_time() - start < 20.0
    assert steps(plan)[0] == f"configure n{count}"
    assert steps(plan)[count] == "configure n0"


def test_the_nodes_of_a_process_go_down_in_the_order_of_the_whole_system() -> None:
    system = system_of(
        system_with(
            "arm: {process: other, lifecycle: {depends_on: [base]}}",
            "base: {lifecycle: {depends_on: [power]}}",
            "power: {process: other}",
            head="processes: {other: {}}",
        )
    )
    names = [step.node for step in tear_down(system, "other").steps]
    assert names == ["arm", "power"] * 3
