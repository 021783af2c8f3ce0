"""The classes of nodes, read as syntax and never imported."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from composer.diagnostics import Diagnostic, Label, Rule
from composer.fast_dataclass import dataclass
from composer.model import HostedClass, Node, System
from composer.project import Project
from composer.python_code.source import (
    BehaviorSource,
    Method,
    NearbyModules,
    find_behavior,
    imported_from,
    nearby_modules,
)
from composer.python_code.source.spans import span_of
from composer.resolve.tree_values import is_opaque
from composer.source import Span

#: Where rclpy's node classes come from.
_RCLPY = "rclpy"
_NODES = frozenset(
    {
        ("rclpy.node", "Node"),
        ("rclpy.lifecycle", "Node"),
        ("rclpy.lifecycle", "LifecycleNode"),
        ("rclpy.lifecycle.node", "LifecycleNode"),
    }
)


@dataclass(frozen=True, slots=True)
class ClassOfNode:
    """A node with the source of its class."""

    node: Node
    hosted: HostedClass
    source: BehaviorSource

    @property
    def span(self) -> Span:
        """Where the YAML file names the class."""
        return self.hosted.reference.text.span

    @property
    def nearby(self) -> NearbyModules | None:
        """The modules next to one that is not found, or None if it is."""
        if self.source.module_found or self.source.problem is not None:
            return None
        reference = self.hosted.reference
        return nearby_modules(reference.module, reference.folder, Project.at(reference.folder))

    @property
    def constructor(self) -> Method | None:
        """The constructor of the class or of its bases outside of rclpy, if it is known."""
        return next((item for item in self.methods if item.name == "__init__"), None)

    @property
    def methods(self) -> Iterator[Method]:
        """The methods of the class and of its bases outside of rclpy, nearest first."""
        seen: set[str] = set()
        for _, known in self.source.classes_outside_ros:
            for method in known.methods:
                if method.name not in seen:
                    seen.add(method.name)
                    yield method

    @property
    def is_node(self) -> bool:
        """Whether a base class comes from rclpy."""
        return is_rclpy_node(self.source)

    def diagnostic(self, rule: Rule, message: str, where: Span, hint: str) -> Diagnostic:
        """Return a diagnostic about the class, with its place in the Python file."""
        related = (Label(where, "here"),)
        return Diagnostic(rule, message, self.span, related=related, hint=hint)


def is_rclpy_node(source: BehaviorSource) -> bool:
    """Return whether a base class comes from rclpy."""
    return any(
        origin is not None and f"{origin.module}.".startswith(f"{_RCLPY}.")
        for module, known in source.classes
        for origin in (imported_from(module, base) for base in known.bases)
    )


def hosted_classes(system: System) -> tuple[ClassOfNode, ...]:
    """Return every node with a class and the source of it; each class is read once."""
    read: dict[tuple[str, Path], BehaviorSource] = {}
    classes = []
    for node in system.nodes:
        hosted = node.hosted_class
        if hosted is None or node.external is not None:
            continue
        reference = hosted.reference
        if is_opaque(reference.text.value) or not (reference.module and reference.class_name):
            continue
        key = (reference.text.value, reference.folder)
        if key not in read:
            read[key] = find_behavior(reference, _NODES)
        classes.append(ClassOfNode(node, hosted, read[key]))
    return tuple(classes)


def calls_in(method: Method) -> Iterator[tuple[ast.Call, Span]]:
    """Yield the calls that a method makes itself, not in a nested function, each with its span."""
    pending: list[ast.AST] = [] if method.node is None else [*method.node.body]
    while pending:
        node = pending.pop(0)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            continue
        if isinstance(node, ast.Call):
            yield node, span_of(node.func, method.span.file)
        pending.extend(ast.iter_child_nodes(node))
