"""The functions of a node's files, and the messages that their expressions name.

Only plain syntax counts: constructors of messages, arguments of handlers and callbacks,
annotations, names that are assigned once, and paths through fields. Other expressions have no known
type, because a type checker runs as well.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from composer.fast_dataclass import dataclass
from composer.interfaces import Field, FieldType, Interfaces, Message, parts
from composer.model import Node
from composer.python_code.checker.callbacks import callback_signatures
from composer.python_code.problems import Family, Problem
from composer.python_code.source import BehaviorSource, Function, Method, Module
from composer.python_code.source.method_body import dotted
from composer.python_code.source.spans import span_of
from composer.python_code.source.traversal import walk
from composer.python_code.stubs.behaviors import signatures

_FOLDERS = ("msg", "srv", "action")
#: Maximum number of names and fields to follow.
_MAXIMUM_STEPS = 16
_MAXIMUM_BITS = 128

Type: TypeAlias = Message | FieldType | None
Constant: TypeAlias = str | bytes | int | float | None


@dataclass(eq=False)
class Code:
    """The functions in the project's files for one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces

    @cached_property
    def modules(self) -> Mapping[Path, Scope]:
        """The statements of each file outside of functions."""
        return {module.path: Scope(self, module) for module in self.source.own_modules}

    @cached_property
    def scopes(self) -> Sequence[Scope]:
        """All files and functions."""
        return (*self.modules.values(), *self._functions())

    @cached_property
    def methods(self) -> Mapping[str, Scope]:
        """The methods of the node, by name, as far as they are in the project's files."""
        nearest = {id(method) for method in self.source.methods}
        own = (scope for scope in self.scopes if id(scope.method) in nearest)
        return {scope.method.name: scope for scope in own if scope.method is not None}

    def _functions(self) -> Iterator[Scope]:
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
        for home in self.modules.values():
            for node in home.nodes:
                if isinstance(node, Function):
                    yield Scope(self, home.module, node, *own.get(id(node), ()))

    @cached_property
    def assigned(self) -> frozenset[str]:
        """The attributes of ``self`` that methods assign."""
        return frozenset(
            node.attr
            for scope in self.scopes
            for node in scope.nodes
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
            if scope.method is not None and dotted(node) == f"self.{node.attr}"
        )


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

    @cached_property
    def bindings(self) -> Mapping[str, list[ast.AST | None]]:
        """What is bound to each name, expressions and functions; None for what is not plain."""
        bound: dict[str, list[ast.AST | None]] = {}
        values: dict[int, ast.expr] = {}
        for node in self.nodes:
            match node:
                case ast.Assign(targets=targets, value=value):
                    values |= {id(target): value for target in targets}
                case ast.AnnAssign(target=target, value=ast.expr() as value):
                    values[id(target)] = value
                case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
                    bound.setdefault(name, []).append(values.get(id(node)))
                case (
                    ast.ClassDef(name=name)
                    | ast.FunctionDef(name=name)
                    | ast.AsyncFunctionDef(name=name)
                ):
                    bound.setdefault(name, []).append(node)
                case ast.arg(arg=name) | ast.ExceptHandler(name=str() as name):
                    bound.setdefault(name, []).append(None)
                case ast.Global(names=names) | ast.Nonlocal(names=names):
                    for name in names:  # other functions assign it too
                        bound.setdefault(name, []).extend((None, None))
        return bound

    def value(self, name: str) -> ast.expr | None:
        """Return what is assigned to a name, if that happens once."""
        if name in self.bindings:
            value, *others = self.bindings[name]
            return value if isinstance(value, ast.expr) and not others else None
        outside = self.code.modules[self.module.path]
        is_changed = outside is self or "global " in self.module.source.text
        return None if is_changed else outside.value(name)

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
        names = (node if isinstance(node, str) else dotted(node)).split(".")
        if self.function is not None and names[0] in self.bindings:
            return ""
        for count in range(len(names), 0, -1):
            imported = self.module.imports.get(".".join(names[:count]))
            if imported is not None:
                return ".".join(filter(None, (imported.module, imported.name, *names[count:])))
        return ".".join(names)

    def message_class(self, node: ast.expr | str) -> Message | None:
        """Return the message whose class an expression is."""
        names = self.full_name(node).split(".")
        if len(names) not in (3, 4) or names[1] not in _FOLDERS:
            return None
        definition = self.code.interfaces.find("/".join(names[:3]))
        part = names[3].lower() if len(names) == 4 else "message"
        return parts(definition).get(part) if definition is not None else None

    def message(self, node: ast.expr, steps: int = 0) -> Message | None:
        """Return the message that an expression is."""
        type_ = self.type(node, steps)
        if isinstance(type_, FieldType) and not type_.is_array and not type_.is_primitive:
            return self.code.interfaces.message(type_.name)
        return type_ if isinstance(type_, Message) else None

    def field(self, node: ast.Attribute, steps: int = 0) -> tuple[Message, Field] | None:
        """Return the field that an attribute is, with its message."""
        message = self.message(node.value, steps + 1)
        found = message.field(node.attr) if message is not None else None
        return (message, found) if message is not None and found is not None else None

    def type(self, node: ast.expr, steps: int = 0) -> Type:
        """Return the type of an expression, None if it is not known."""
        if steps > _MAXIMUM_STEPS:
            return None
        match node:
            case ast.Name(id=name):
                value = self.value(name)
                return self._argument(name) if value is None else self.type(value, steps + 1)
            case ast.Attribute():
                found = self.field(node, steps)
                return found[1].type if found is not None else None
            case ast.Subscript(value=owner, slice=index) if not isinstance(index, ast.Slice):
                array = self.type(owner, steps + 1)
                return array.element if isinstance(array, FieldType) and array.is_array else None
            case ast.Call(func=function):
                return self.message_class(function)
        return None

    def _argument(self, name: str) -> Message | None:
        if self.function is None or len(self.bindings.get(name, ())) != 1:
            return None
        given = (*self.function.args.posonlyargs, *self.function.args.args)
        annotation = next((item.annotation for item in given if item.arg == name), None)
        return self.message_class(annotation or self.passed.get(name, ""))
