"""Supervision, dependencies and introspection: a node overrides its system, key by key."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.model import (
    DEFAULT_INTROSPECTION,
    Introspection,
    OnFailure,
    PrimaryState,
    RestartBudget,
    Supervision,
    Watch,
)
from composer.model.dependencies import dependency_edges, needed_states
from tests.unit.support.resolving import quoted, system_of

SYSTEM = """
system: robot
namespace: fleet/one
lifecycle:
  timeout_ms: 2000
  on_failure: restart
  restart: {max_attempts: 3, backoff_ms: 100}
  watch: {callback_ms: 50, max_errors: 4}
nodes:
  plain: {}
  own:
    lifecycle:
      timeout_ms: 500
      on_failure: shutdown
      restart: {window_ms: 1000, then: shutdown}
      watch: {topic_silence_ms: {scan: 100, status: 900}}
  whole: {lifecycle: {watch: {topic_silence_ms: 300, callback_ms: 9}}}
"""


def test_a_node_overrides_it_key_by_key() -> None:
    own = system_of(SYSTEM).node("own").supervision
    assert (own.timeout_ms, own.policy) == (500, OnFailure.SHUTDOWN)
    assert own.restart == RestartBudget(
        max_attempts=3, window_ms=1000, backoff_ms=100, then=OnFailure.SHUTDOWN
    )
    assert quoted(own.restart.span) == "restart"
    limits = {name.value: limit.value for name, limit in own.watch.topics}
    assert limits == {"scan": 100, "status": 900}
    assert own.watch.silence_ms is None
    assert own.watch.callback_ms.value == 50


def test_by_default_nodes_that_fail_are_isolated_and_nothing_is_watched() -> None:
    system = system_of("system: robot\nnodes: {a: {}}\n")
    assert system.nodes[0].supervision == Supervision()
    assert system.supervision.policy is OnFailure.ISOLATE
    assert system.supervision.watch == Watch()
    assert (system.supervision.timeout_ms, system.namespace) == (10_000, "/")
    assert system.nodes[0].introspection == DEFAULT_INTROSPECTION
    assert DEFAULT_INTROSPECTION.left_to_manager == ()


@pytest.mark.parametrize(
    ("attempts", "waits_s"), [(0, 0.5), (1, 1.0), (2, 2.0), (4, 8.0), (5, 10.0), (10**9, 10.0)]
)
def test_the_wait_before_a_restart_doubles_up_to_its_limit(attempts: int, waits_s: float) -> None:
    assert RestartBudget().backoff_s(attempts) == waits_s


SERVED = """
system: robot
lifecycle: {implied_dependencies: SWITCH}
nodes:
  client:
    clients: {plan: {type: std_srvs/srv/Trigger}}
    lifecycle: {depends_on: {power: inactive, server: inactive}}
  server: {services: {plan: {type: std_srvs/srv/Trigger}}}
  power: {}
"""


@pytest.mark.parametrize(
    ("switch", "implied", "state"),
    [("true", {"server"}, PrimaryState.ACTIVE), ("false", set(), PrimaryState.INACTIVE)],
)
def test_dependencies_that_are_implied(switch: str, implied: set[str], state: PrimaryState) -> None:
    """Of two dependencies on a node the higher state counts: a service needs an active server."""
    system = system_of(SERVED.replace("SWITCH", switch))
    edges = dependency_edges(system)
    assert {edge.on for edge in edges if edge.implied} == implied
    declared = {edge.on: edge.state for edge in edges if not edge.implied}
    assert declared == dict.fromkeys(("power", "server"), PrimaryState.INACTIVE)
    needed = {"power": PrimaryState.INACTIVE, "server": state}
    assert needed_states(system) == {"client": needed, "server": {}, "power": {}}


NODE_TYPE = """
node: lean
introspection: {rosout: false, type_description: false}
"""
OFFERING = """
system: robot
introspection: {parameters: false, rosout: true}
nodes:
  plain: {}
  logger: {introspection: {logger_services: true}}
  own: {introspection: {parameters: true, lifecycle_services: false}}
  typed: {type: lean}
  both: {type: lean, introspection: {rosout: false}}
"""


def test_introspection_of_a_node_is_before_the_systems_and_the_types(tmp_path: Path) -> None:
    (tmp_path / "lean.yaml").write_text(NODE_TYPE, encoding="utf-8")
    found = {node.name.value: node.introspection for node in system_of(OFFERING, tmp_path).nodes}
    assert found == {
        "plain": Introspection(parameters=False),
        "logger": Introspection(parameters=False, logger_services=True),
        "own": Introspection(lifecycle_services=False),
        "typed": Introspection(parameters=False, type_description=False),
        "both": Introspection(parameters=False, rosout=False, type_description=False),
    }


@pytest.mark.parametrize(
    ("introspection", "left"),
    [
        (Introspection(rosout=False, type_description=False), ()),
        (Introspection(parameters=False), ("parameters",)),
        (Introspection(lifecycle_services=False), ("lifecycle",)),
        (Introspection(parameters=False, lifecycle_services=False), ("lifecycle", "parameters")),
    ],
)
def test_what_is_left_to_the_manager(introspection: Introspection, left: tuple[str, ...]) -> None:
    assert introspection.left_to_manager == left
