"""The functions of a node's files, and the messages that their expressions name.

Only plain syntax counts: constructors of messages, arguments of handlers and callbacks,
annotations, names that are assigned once, and paths through fields. Other expressions have no known
type, because a type checker runs as well.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import TypeAlias

from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING, ValueType, fields_of
from composer.interfaces import Field, FieldType, Interfaces, Message, parts
from composer.interfaces.sources import FOLDERS
from composer.model import Node
from composer.python_code.checker.callbacks import callback_signatures
from composer.python_code.problems import Family, Problem
from composer.python_code.source import BehaviorSource, Function, Method, Module
from composer.python_code.source.trees import bindings, dotted, positional_arguments, span_of, walk
from composer.python_code.stubs.behaviors import signatures

#: Maximum number of names and fields to follow.
_MAXIMUM_STEPS = 16
_MAXIMUM_BITS = 128

Constant: TypeAlias = str | bytes | int | float | None


@dataclass(eq=False)
class Code:
    """The functions in the project's files for one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces

    @cached_property
    def scopes(self) -> Sequence[Scope]:
        """All files and functions."""
        own: dict[int, tuple[Method, Mapping[str, str]]] = {}
        for module, class_ in self.source.own_classes:
            if self.node.hosted_class is not None:
                known = callback_signatures(class_.node, module)
            else:
                known = signatures(self.node, self.interfaces)
            for method in class_.methods:
                signature = known.get(method.name)
                types = [type_ for _, type_ in signature.arguments] if signature else []
                own[id(method.node)] = method, dict(zip(method.arguments, types, strict=False))
        modules = [Scope(self, module) for module in self.source.own_modules]
        functions = (
            Scope(self, home.module, node, *own.get(id(node), ()))
            for home in modules
            for node in home.nodes
            if isinstance(node, Function)
        )
        return (*modules, *functions)

    @cached_property
    def assigned(self) -> frozenset[str]:
        """The attributes of ``self`` that methods assign."""
        names = (name for _, class_ in self.source.own_classes for name in bindings(class_.node))
        return frozenset(name.removeprefix("self.") for name in names if name.startswith("self."))


@dataclass(eq=False)
class Scope:
    """A function, or the statements of a file outside of functions.

    ``passed`` are the arguments that the composer or rclpy passes, with their types.
    """

    code: Code = field(repr=False)
    module: Module
    function: Function | None = None
    method: Method | None = None
    passed: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def nodes(self) -> Sequence[ast.AST]:
        """All syntax in the function, or all of the file that is outside of functions."""
        if self.function is not None:
            return tuple(walk([self.function]))
        return tuple(walk(self.module.tree.body, closed=(ast.FunctionDef, ast.AsyncFunctionDef)))

    def problem(
        self, family: Family, message: str, place: ast.expr, hint: str | None = None
    ) -> Problem:
        """Return a problem at an expression."""
        return Problem(family, message, span_of(place, self.module.source), hint)

    def doubt(self, message: str, place: ast.expr, hint: str | None = None) -> Problem:
        """Return the problem of a value that is probably wrong, but does not fail."""
        span = span_of(place, self.module.source)
        return Problem(Family.VALUE, message, span, hint, is_certain=False)

    def bound(self, name: str) -> Sequence[ast.expr | None]:
        """Return what is assigned to a name; None for changes and for what is not plain."""
        if self.function is not None and name in bindings(self.function):
            return bindings(self.function)[name]
        if "global " in self.module.source.text:
            return ()
        return bindings(self.module.tree).get(name, ())

    def value(self, name: str) -> ast.expr | None:
        """Return what is assigned to a name, if that happens once and is not changed."""
        bound = self.bound(name)
        return bound[0] if len(bound) == 1 else None

    def constant(self, node: ast.expr | None) -> Constant:
        """Return the value of a constant, or of a name for one."""
        if isinstance(node, ast.Name):
            node = self.value(node.id)
        match node:
            case ast.Constant(value=int() as value) if value.bit_length() > _MAXIMUM_BITS:
                return None  # Python refuses to show it
            case ast.Constant(value=str() | bytes() | int() | float() as value):
                return value
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant() as operand):
                number = self.constant(operand)
                return -number if isinstance(number, int | float) else None
        return None

    def full_name(self, node: ast.expr | str) -> str:
        """Return a dotted name with imports resolved: ``std_msgs.msg.Bool``; "" for others."""
        text = node if isinstance(node, str) else dotted(node)
        first, dot, rest = text.partition(".")
        is_local = self.function is not None and first in bindings(self.function)
        return "" if is_local else f"{self.module.names.get(first, first)}{dot}{rest}"

    def message_class(self, node: ast.expr | str) -> Message | None:
        """Return the message whose class an expression is."""
        names = self.full_name(node).split(".")
        if len(names) not in (3, 4) or names[1] not in FOLDERS:
            return None
        definition = self.code.interfaces.find("/".join(names[:3]))
        part = names[3].lower() if len(names) == 4 else "message"
        return parts(definition).get(part) if definition is not None else None

    def field(self, node: ast.expr, steps: int = 0) -> tuple[Message, Field] | None:
        """Return the field that an attribute is, with its message."""
        if not isinstance(node, ast.Attribute):
            return None
        message = fields_of(self.type(node.value, steps + 1), self.code.interfaces)
        found = message.field(node.attr) if message is not None else None
        return (message, found) if message is not None and found is not None else None

    def type(self, node: ast.expr, steps: int = 0) -> ValueType:
        """Return the type of an expression, ANYTHING if it is not known."""
        match node if steps <= _MAXIMUM_STEPS else None:
            case ast.Name(id=name):
                values = [value for value in self.bound(name) if value is not None]
                if len(values) == 1:
                    return self.type(values[0], steps + 1)
                return ANYTHING if values else self._argument(name)
            case ast.Attribute():
                found = self.field(node, steps)
                return found[1].type if found is not None else ANYTHING
            case ast.Subscript(value=owner, slice=index) if not isinstance(index, ast.Slice):
                array = self.type(owner, steps + 1)
                if isinstance(array, FieldType) and array.is_array:
                    return array.element
            case ast.Call(func=function):
                return self.message_class(function) or ANYTHING
        return ANYTHING

    def _argument(self, name: str) -> ValueType:
        if self.function is None:
            return ANYTHING
        given = positional_arguments(self.function)
        annotation = next((item.annotation for item in given if item.arg == name), None)
        return self.message_class(annotation or self.passed.get(name, "")) or ANYTHING
