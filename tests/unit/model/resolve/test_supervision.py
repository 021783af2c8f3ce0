"""Supervision: a node overrides its system, key by key."""

from __future__ import annotations

import pytest

from composer.model import OnFailure, PrimaryState, RestartBudget, Supervision, Watch
from composer.model.dependencies import dependency_edges
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


def of(name: str) -> Supervision:
    node = system_of(SYSTEM).node(name)
    assert node is not None
    return node.supervision


def test_a_node_overrides_it_key_by_key() -> None:
    own = of("own")
    assert (own.timeout_ms, own.policy) == (500, OnFailure.SHUTDOWN)
    assert own.restart == RestartBudget(
        max_attempts=3, window_ms=1000, backoff_ms=100, then=OnFailure.SHUTDOWN
    )
    assert own.restart.span is not None
    assert quoted(own.restart.span) == "restart"
    limits = {name.value: limit.value for name, limit in own.watch.topics}
    assert limits == {"scan": 100, "status": 900}
    assert own.watch.silence_ms is None
    assert own.watch.callback_ms is not None
    assert own.watch.callback_ms.value == 50


def test_without_a_word_nodes_that_fail_are_isolated_and_nothing_is_watched() -> None:
    system = system_of("system: robot\nnodes: {a: {}}\n")
    assert system.nodes[0].supervision == Supervision()
    assert system.supervision.policy is OnFailure.ISOLATE
    assert system.supervision.watch == Watch()
    assert system.supervision.timeout_ms == 10_000
    assert system.namespace == "/"


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
    lifecycle: {depends_on: {power: inactive}}
  server: {services: {plan: {type: std_srvs/srv/Trigger}}}
  power: {}
"""


@pytest.mark.parametrize(("switch", "implied"), [("true", {"server"}), ("false", set())])
def test_implied_dependencies_can_be_switched_off(switch: str, implied: set[str]) -> None:
    edges = dependency_edges(system_of(SERVED.replace("SWITCH", switch)))
    assert {edge.on for edge in edges if edge.implied} == implied
    declared = [edge for edge in edges if not edge.implied]
    assert [(edge.on, edge.state) for edge in declared] == [("power", PrimaryState.INACTIVE)]
