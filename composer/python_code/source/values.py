"""What expressions in the source of a class are, as far as syntax shows it."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from composer.fast_dataclass import dataclass
from composer.interfaces.sources import FOLDERS
from composer.python_code.source.syntax import Class, Module
from composer.python_code.source.trees import Function, bindings, dotted, walk
from composer.tree import Plain

T = TypeVar("T")

_MAXIMUM_STEPS = 8
_MAXIMUM_ITEMS = 1000


class NotLiteral(Exception):
    """Only running the code would show the value. The text is the code."""

    def __init__(self, node: ast.expr) -> None:
        super().__init__(ast.unparse(node)[:80])


@dataclass(frozen=True, slots=True)
class Scope:
    """Where an expression is: in a method of a class of a module."""

    module: Module
    cls: ast.ClassDef
    method: Function

    @property
    def nodes(self) -> Iterator[ast.AST]:
        """The syntax of the method, without classes in it."""
        return walk(self.method.body, closed=(ast.ClassDef,))

    def full_name(self, node: ast.expr) -> str:
        """Return the full dotted name of an expression, imports resolved; "" for other ones."""
        first, dot, rest = dotted(node).partition(".")
        return f"{self.module.names.get(first, first)}{dot}{rest}"

    def known(self, read: Callable[[ast.expr], T], node: ast.expr | None) -> T | None:
        """Return what an expression is, None if only running the code would show it."""
        try:
            return read(node) if node is not None else None
        except NotLiteral:
            return None

    def literal(self, node: ast.expr) -> Plain:
        """Return the value of an expression. Raises NotLiteral."""
        match self.followed(node):
            case ast.Constant(value=bool() | int() | float() | str() | None as value):
                return value
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                number = self.literal(operand)
                if isinstance(number, int | float) and not isinstance(number, bool):
                    return -number
            case ast.List(elts=items) | ast.Tuple(elts=items) if len(items) <= _MAXIMUM_ITEMS:
                return [self.literal(item) for item in items]
        raise NotLiteral(node)

    def text(self, node: ast.expr) -> str:
        """Return the text that an expression is. Raises NotLiteral."""
        value = self.literal(node)
        if not isinstance(value, str):
            raise NotLiteral(node)
        return value

    def interface(self, node: ast.expr) -> str:
        """Return the interface that an expression names: ``std_msgs/msg/String``.

        Raises NotLiteral.
        """
        parts = self.full_name(self.followed(node)).split(".")
        if len(parts) == 3 and parts[1] in FOLDERS:
            return "/".join(parts)
        raise NotLiteral(node)

    def followed(self, node: ast.expr) -> ast.expr:
        """Return the expression that a name stands for, if it is assigned once."""
        start = node
        for _ in range(_MAXIMUM_STEPS):
            assigned = self._assigned(dotted(node))
            if assigned is None:
                return node
            node = assigned
        raise NotLiteral(start)

    def _assigned(self, name: str) -> ast.expr | None:
        """Return the only value that is assigned to a name, or None."""
        prefix, _, last = name.rpartition(".")
        if prefix in ("self", self.cls.name):  # the class may set it, or a method
            of_class = bindings(self.cls)
            values = [*of_class.get(f"self.{last}", ()), *of_class.get(last, ())]
        elif prefix:
            return None
        else:
            values = bindings(self.method).get(name) or bindings(self.module.tree).get(name) or []
        return values[0] if len(values) == 1 else None


def scopes_in(classes: Iterable[tuple[Module, Class]]) -> Iterator[Scope]:
    """Yield the methods of classes."""
    for module, class_ in classes:
        for method in class_.methods:
            if method.node is not None:
                yield Scope(module, class_.node, method.node)
