"""Imports that import-linter does not see: the node types are not part of the package."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from composer.base import resources

BEHAVIORS = sorted(resources.nodes_folder().glob("*.py"))


def _imported_modules(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or "."


def _is_allowed(module: str) -> bool:
    package, *rest = module.split(".")
    is_interface = rest[:1] in (["msg"], ["srv"], ["action"])
    is_api = module in ("composer.behavior", "composer.typed")
    return is_api or is_interface or package in sys.stdlib_module_names


def test_there_are_behaviors_to_look_at() -> None:
    assert BEHAVIORS


@pytest.mark.parametrize("path", BEHAVIORS, ids=lambda path: path.name)
def test_a_node_type_imports_the_behavior_protocol_and_messages_only(path: Path) -> None:
    assert [module for module in _imported_modules(path) if not _is_allowed(module)] == []


@pytest.mark.parametrize(
    ("module", "allowed"),
    [
        ("composer.behavior", True),
        ("composer.typed", True),
        ("math", True),
        ("__future__", True),
        ("geometry_msgs.msg", True),
        ("composer_interfaces.srv", True),
        ("rclpy", False),
        ("rclpy.node", False),
        ("composer.runtime.host", False),
        ("numpy", False),
    ],
)
def test_the_rule_itself(module: str, allowed: bool) -> None:
    assert _is_allowed(module) is allowed
