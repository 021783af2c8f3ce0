"""What rounds of inference find and rest on."""

from __future__ import annotations

import ast
from dataclasses import field

from composer.behavior_source import Function
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import Collection, OwnObject, Value
from composer.fast_dataclass import dataclass


@dataclass(slots=True)
class Assumed:
    """What a round of inference takes from the one before it.

    These are the types of arguments, by the id of the function and by name, and of the attributes
    that are empty at first. ``filled`` are the latter without their elements.
    """

    arguments: dict[int, dict[str, Value]] = field(default_factory=dict)
    fillings: dict[str, Collection] = field(default_factory=dict)
    filled: dict[str, Collection] = field(default_factory=dict)
    is_settled: bool = True


def lacks(found: Value, node: ast.expr | None, name: str) -> bool:
    """Return whether an expression reads what an attribute lacks, so that it gives no value."""
    known = known_attributes(found.of) if isinstance(found, OwnObject) else None
    match node:
        case ast.Call(func=ast.Attribute(value=ast.Attribute(attr=owner), attr=read)):
            return known is not None and owner == name and read not in known
        case _:
            return False


def is_open(function: Function) -> bool:
    """Return whether a parameter other than the object has no annotation."""
    arguments = function.args
    positional = (*arguments.posonlyargs, *arguments.args)
    parameters = (*positional[1:], *arguments.kwonlyargs, *positional[:1])
    first = positional[0].arg if positional else ""
    is_method = first in {"self", "cls"}
    return any(item.annotation is None for item in parameters[: -1 if is_method else None])
