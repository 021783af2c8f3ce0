"""The classes of nodes, read as syntax and never imported."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TypeAlias

from composer.diagnostics import Diagnostic, Label, Rule
from composer.fast_dataclass import dataclass
from composer.model import HostedClass, Node, System
from composer.python_code.source import BehaviorSource, Method, find_behavior
from composer.python_code.source.trees import SCOPES, span_of, walk
from composer.resolve.tree_values import is_opaque
from composer.source import Span

#: What may leave out the code in it, or stop it.
_CONDITIONAL = (
    *SCOPES,
    *(ast.If, ast.IfExp, ast.BoolOp, ast.Match, ast.Try, ast.TryStar, ast.With),
    *(ast.For, ast.While, ast.ListComp, ast.GeneratorExp),
)


#: A node, and the source of its behavior or class.
NodeClass: TypeAlias = tuple[Node, BehaviorSource]


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
    def constructor(self) -> Method | None:
        """The constructor of the class or of its bases outside of rclpy, if it is known."""
        method = self.source.method("__init__")
        is_nearest = any(method in class_.methods for _, class_ in self.source.classes[:1])
        return method if is_nearest or self.source.complete else None

    def is_certain(self, span: Span) -> bool:
        """Return whether the constructor makes the call at a place whatever happens before."""
        constructor = self.constructor
        if constructor is None or constructor.node is None or constructor.span.file != span.file:
            return False
        nodes = walk(constructor.node.body, closed=_CONDITIONAL)
        calls = (span_of(node, span.file) for node in nodes if isinstance(node, ast.Call))
        return any((call.line, call.column) == (span.line, span.column) for call in calls)

    def diagnostic(self, rule: Rule, message: str, where: Span, hint: str) -> Diagnostic:
        """Return a diagnostic about the class, with its place in the Python file."""
        related = (Label(where, "here"),)
        return Diagnostic(rule, message, self.span, related=related, hint=hint)


def node_classes(system: System) -> tuple[NodeClass, ...]:
    """Return every node with a behavior or a class, and its source; each class is read once."""
    read: dict[tuple[str, Path], BehaviorSource] = {}
    classes = []
    for node in system.nodes:
        hosted = node.hosted_class if node.external is None else None
        reference = node.behavior or (hosted.reference if hosted is not None else None)
        if reference is None or is_opaque(reference.text.value):
            continue
        if not (reference.module and reference.class_name):
            continue  # a rule reports it
        key = (reference.text.value, reference.folder)
        if key not in read:
            read[key] = find_behavior(reference)
        classes.append((node, read[key]))
    return tuple(classes)
