from __future__ import annotations

import time

import pytest

from composer.model import PrimaryState
from composer.model.dependencies import dependency_cycles, dependency_edges, in_dependency_order
from composer.plan import Plan, bring_up, tear_down
from tests.unit.support.plans import steps
from tests.unit.support.resolving import system_of


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


def test_a_node_goes_no_further_than_its_own_autostart_and_what_it_depends_on() -> None:
    system = system_of(
        system_with(
            "needs_active: {lifecycle: {depends_on: [waiting]}}",
            "needs_inactive: {lifecycle: {depends_on: {waiting: inactive}}}",
            "needs_late: {lifecycle: {depends_on: [late]}}",
            "waiting: {lifecycle: {autostart: inactive}}",
            "late: {lifecycle: {autostart: unconfigured}}",
            "alone: {lifecycle: {autostart: inactive}}",
            "eager: {lifecycle: {autostart: active}}",
        )
    )
    plan = bring_up(system)
    names = ("waiting", "needs_active", "needs_inactive", "alone", "eager")
    configured = [f"configure {name}" for name in names]
    assert steps(plan) == [*configured, "activate needs_inactive", "activate eager"]
    assert causes(plan)["alone"] == "its own autostart is inactive"
    assert steps(bring_up(system, PrimaryState.INACTIVE)) == configured


SERVING = (
    "client: {clients: {ask: {type: x/srv/X}}}",
    "goer: {action_clients: {go: {type: x/action/X}}}",
    "server: {services: {ask: {type: x/srv/X}}, action_servers: {go: {type: x/action/X}}}",
)


def test_servers_start_before_their_clients_unless_they_depend_on_them() -> None:
    plan = bring_up(system_of(system_with(*SERVING)))
    assert steps(plan)[:3] == ["configure server", "configure client", "configure goer"]
    cause = "goer and client call it, and servers start before their clients"
    assert causes(plan)["server"] == cause
    server = SERVING[2].removesuffix("}") + ", lifecycle: {depends_on: [client]}}"
    plan = bring_up(system_of(system_with(SERVING[0], SERVING[1], server)))
    assert steps(plan)[:3] == ["configure client", "configure server", "configure goer"]


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
