"""What nodes need of the nodes that they depend on."""

from __future__ import annotations

from pathlib import Path

from composer.loading import load
from composer.model import PrimaryState
from composer.model.dependencies import needed_states

SERVED = """
system: served
nodes:
  client:
    clients: {ask: {type: std_srvs/srv/Trigger}}
    lifecycle: {depends_on: {server: inactive}}
  server: {services: {answer: {type: std_srvs/srv/Trigger, respond: {success: true}}}}
connections:
  - {service: /ask, server: server.answer, clients: [client.ask]}
"""


def test_of_two_dependencies_on_a_node_the_higher_state_counts(tmp_path: Path) -> None:
    """The service implies that the server is active."""
    path = tmp_path / "served.yaml"
    path.write_text(SERVED, "utf-8")
    system = load(path).system
    assert system is not None
    assert needed_states(system) == {"client": {"server": PrimaryState.ACTIVE}, "server": {}}
