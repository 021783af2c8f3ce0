"""What nodes offer to tools: what a node says, over its system, over its type."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.model import DEFAULT_INTROSPECTION, Introspection, System

NODE_TYPE = """
node: lean
introspection: {rosout: false, type_description: false}
"""
SYSTEM = """
system: robot
introspection: {parameters: false, rosout: true}
nodes:
  plain: {}
  logger: {introspection: {logger_services: true}}
  own: {introspection: {parameters: true, lifecycle_services: false}}
  typed: {type: lean}
  both: {type: lean, introspection: {rosout: false}}
"""


def load_system(folder: Path, text: str) -> System:
    nodes = folder / "nodes"
    nodes.mkdir()
    (nodes / "lean.yaml").write_text(NODE_TYPE, encoding="utf-8")
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    system = load(path).system
    assert system is not None
    return system


def test_everything_is_offered_by_default(tmp_path: Path) -> None:
    system = load_system(tmp_path, "system: robot\nnodes: {plain: {}}\n")
    assert system.nodes[0].introspection == DEFAULT_INTROSPECTION
    assert DEFAULT_INTROSPECTION.left_to_manager == ()


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        ("plain", Introspection(parameters=False)),
        ("logger", Introspection(parameters=False, logger_services=True)),
        ("own", Introspection(lifecycle_services=False)),
        ("typed", Introspection(parameters=False, type_description=False)),
        ("both", Introspection(parameters=False, rosout=False, type_description=False)),
    ],
)
def test_node_before_system_before_type_key_by_key(
    tmp_path: Path, node: str, expected: Introspection
) -> None:
    found = load_system(tmp_path, SYSTEM).node(node)
    assert found is not None
    assert found.introspection == expected


@pytest.mark.parametrize(
    ("introspection", "left"),
    [
        (Introspection(rosout=False, type_description=False), ()),
        (Introspection(parameters=False), ("parameters",)),
        (Introspection(lifecycle_services=False), ("lifecycle",)),
        (Introspection(parameters=False, lifecycle_services=False), ("lifecycle", "parameters")),
    ],
)
def test_the_manager_answers_for_parameters_and_lifecycle(
    introspection: Introspection, left: tuple[str, ...]
) -> None:
    assert introspection.left_to_manager == left
