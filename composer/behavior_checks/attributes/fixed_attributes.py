"""Checks what is assigned to attributes that cannot be set."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import attribute_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.own_classes import all_fields, is_frozen, known_attributes
from composer.behavior_types.values import OwnClass, OwnObject


def fixed_problems(node: ast.Attribute, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why an attribute cannot be set: it is one of a frozen object, or a property."""
    owner = scope.type_of(node.value)
    if not isinstance(owner, OwnObject) or is_rclpy(owner.of.home):
        return
    own = owner.of
    if known_attributes(own) is None or scope.owner.project_classes.derived(own):
        return
    span, name = attribute_span(node, scope.home.source), own.definition.name
    if is_frozen(own) and any(field.name == node.attr for field in all_fields(own)):
        message = f"'{name}' is frozen: '{node.attr}' cannot be set"
        hint = f"create another one: replace(..., {node.attr}=...)"
        yield CodeProblem(Kind.ATTRIBUTE, message, span, hint)
    elif _is_read_only(own, node.attr):
        message = f"'{node.attr}' is a property of '{name}' without a setter"
        yield CodeProblem(Kind.ATTRIBUTE, message, span, f"add a @{node.attr}.setter")


def _is_read_only(own: OwnClass, name: str) -> bool:
    """Return whether an attribute is a property of a class and nothing else."""
    found = [
        method
        for known in lineage(own).classes
        for method in known.definition.methods
        if method.name == name
    ]
    if len(found) != 1 or found[0].node is None:
        return False
    return [dotted(item) for item in found[0].node.decorator_list] == ["property"]
