"""The base class of behaviors has slots, which do not restrict derived classes.

And imports that import-linter does not see: the node types are not part of the package.
"""

from __future__ import annotations

import ast
import sys
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import composer.typed
from composer.base import folders
from composer.behavior import Behavior
from composer.typed import ArmBehavior
from composer.typed import PlannerBehavior as Base


class Counter(Behavior):
    limit = 3

    def on_configure(self) -> None:
        self.seen = 0


class Named(Behavior):
    name = "until another is set"


@dataclass
class Point(Behavior):
    x: float = 1.0


@pytest.mark.parametrize("kind", [Behavior, Counter, Named, Point])
def test_any_attribute_may_be_set(kind: type[Any]) -> None:
    behavior = kind()
    with pytest.raises(AttributeError, match="publishers"):
        _ = behavior.publishers
    behavior.publishers = "stands in"
    behavior.name = "/mine"
    behavior.anything = 1
    assert (behavior.publishers, behavior.name, behavior.anything) == ("stands in", "/mine", 1)
    assert weakref.ref(behavior)() is behavior


def test_every_class_of_composer_typed_is_the_base_class() -> None:
    assert ArmBehavior is Base is Behavior
    for name in ("Planner", "planner_behavior", "_Behaviors"):
        with pytest.raises(AttributeError, match=name):
            getattr(composer.typed, name)


BEHAVIORS = sorted(folders.nodes_folder().glob("*.py"))


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


def test_node_types_import_the_behavior_protocol_and_messages_only() -> None:
    imported = [(path.name, name) for path in BEHAVIORS for name in _imported_modules(path)]
    assert len(imported) > len(BEHAVIORS) > 0
    assert [(path, module) for path, module in imported if not _is_allowed(module)] == []
    for module in ("rclpy", "rclpy.node", "composer.runtime.host", "numpy"):
        assert not _is_allowed(module)
