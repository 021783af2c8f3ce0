"""The functions of a node's files, and the messages that their expressions name.

Only plain syntax counts: constructors of messages, arguments of handlers and callbacks,
annotations, names that are assigned once, and paths through fields. Other expressions have no known
type, because a type checker runs as well.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

from composer.base.fast_dataclass import dataclass
from composer.interfaces import Field, FieldType, Interfaces, Message, parts
from composer.interfaces.field_types.types import ANYTHING, ValueType, fields_of
from composer.interfaces.sources import FOLDERS
from composer.model import Node
from composer.python_code.checker.callbacks import callback_signatures
from composer.python_code.lookup import BehaviorSource
from composer.python_code.scopes import Scope
from composer.python_code.trees import Function, bindings, positional_arguments

#: Maximum number of names and fields to follow.
_MAXIMUM_STEPS = 16


@dataclass(eq=False)
class Code:
    """The functions in the project's files for one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces

    @cached_property
    def scopes(self) -> Sequence[NodeScope]:
        """All files and functions."""
        own: dict[ast.AST | None, tuple[ast.ClassDef, Mapping[str, str]]] = {}
        for module, class_ in self.source.own_classes:
            known = callback_signatures(class_.node, module, self.node, self.interfaces)
            for method in class_.methods:
                signature = known.get(method.name)
                types = [type_ for _, type_ in signature.arguments] if signature else []
                passed = dict(zip(method.arguments, types, strict=False))
                own[method.node] = class_.node, passed
        scopes = [
            NodeScope(module.source, module.tree, module.names, code=self)
            for module in self.source.own_modules
        ]
        functions = ((home, x) for home in scopes for x in home.nodes if isinstance(x, Function))
        for home, node in tuple(functions):
            place, arguments = own.get(node, (None, {}))
            scopes.append(replace(home, function=node, class_=place, passed=arguments))
        return tuple(scopes)

    @cached_property
    def assigned(self) -> frozenset[str]:
        """The attributes of ``self`` that methods assign."""
        names = (name for _, class_ in self.source.own_classes for name in bindings(class_.node))
        return frozenset(name.removeprefix("self.") for name in names if name.startswith("self."))


@dataclass(eq=False)
class NodeScope(Scope):
    """A function in the files of a node, or the statements of a file outside of functions.

    ``passed`` are the arguments that the composer or rclpy passes, with their types.
    """

    code: Code = field(kw_only=True, repr=False)
    passed: Mapping[str, str] = field(default_factory=dict)

    def constant(self, node: ast.expr | None) -> str | int | float | None:
        """Return the value of a number or text, None if it is not known."""
        value = self.known(self.literal, node)
        return value if isinstance(value, str | int | float) else None

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
