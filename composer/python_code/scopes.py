"""What names in a function stand for, and what the function calls, as far as syntax shows it."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TypeVar

from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span
from composer.interfaces.sources import FOLDERS
from composer.language.tree import Plain
from composer.python_code.trees import (
    SCOPES,
    Function,
    bindings,
    dotted,
    full_names,
    imports_in,
    span_of,
    walk,
)

T = TypeVar("T")

#: Maximum number of names to follow.
_MAXIMUM_STEPS = 8
_MAXIMUM_ITEMS = 1000
_MAXIMUM_BITS = 128


class NotLiteral(Exception):
    """Only running the code would show the value. The text is the code."""

    def __init__(self, node: ast.expr) -> None:
        super().__init__()
        self._node = node

    def __str__(self) -> str:
        return ast.unparse(self._node)[:80]


@dataclass(frozen=True, slots=True)
class Call:
    """A call: the full dotted name of the callee, and whether it is awaited.

    ``deferred`` is true in a nested function, which may run later, or in a thread.
    """

    name: str
    span: Span
    awaited: bool
    deferred: bool
    node: ast.Call


@dataclass(eq=False)
class Scope:
    """A function, or the statements of a file outside of functions.

    ``imports`` maps the imports of the file to full names. A method has its class.
    """

    source: SourceFile
    tree: ast.Module
    imports: Mapping[str, str]
    function: Function | None = None
    class_: ast.ClassDef | None = None

    @cached_property
    def nodes(self) -> Sequence[ast.AST]:
        """All syntax in the function, or all of the file that is outside of functions."""
        if self.function is not None:
            return tuple(walk([self.function]))
        return tuple(walk(self.tree.body, closed=(ast.FunctionDef, ast.AsyncFunctionDef)))

    @cached_property
    def calls(self) -> tuple[Call, ...]:
        """The calls of functions that have a name, in source order."""
        awaited = {node.value for node in self.nodes if isinstance(node, ast.Await)}
        inner = (node for node in self.nodes if isinstance(node, SCOPES))
        deferred = {node for place in inner if place is not self.function for node in walk([place])}
        return tuple(
            Call(
                self.full_name(node.func),
                span_of(node.func, self.source),
                node in awaited,
                node in deferred,
                node,
            )
            for node in self.nodes
            if isinstance(node, ast.Call) and dotted(node.func)
        )

    @cached_property
    def mentioned(self) -> tuple[str, ...]:
        """The full names that are used without being called or assigned to a name."""
        hidden: set[ast.AST | None] = {x.value for x in self.nodes if isinstance(x, ast.Attribute)}
        hidden |= {node.func for node in self.nodes if isinstance(node, ast.Call)}
        names = bindings(self.function) if self.function is not None else ()
        hidden |= {self.value(name) for name in names if "." not in name}
        loads = (x for x in self.nodes if isinstance(getattr(x, "ctx", None), ast.Load))
        return tuple(filter(None, (self.full_name(x) for x in loads if x not in hidden)))

    def bound(self, name: str) -> Sequence[ast.expr | None]:
        """Return what is assigned to a name; None for changes and for what is not plain."""
        if self.function is not None and name in bindings(self.function):
            return bindings(self.function)[name]
        return () if "global " in self.source.text else bindings(self.tree).get(name, ())

    def value(self, name: str) -> ast.expr | None:
        """Return what is assigned to a name or own attribute, if that happens only once."""
        prefix, _, last = name.rpartition(".")
        values = self.bound(name) if name and not prefix else ()
        if self.class_ is not None and prefix in ("self", self.class_.name):
            of_class = bindings(self.class_)  # the class may set it, or a method
            values = [*of_class.get(f"self.{last}", ()), *of_class.get(last, ())]
        return values[0] if len(values) == 1 else None

    def full_name(self, node: ast.AST | str) -> str:
        """Return a dotted name with imports and local names resolved; "" for other expressions."""
        name = node if isinstance(node, str) else dotted(node)
        for _ in range(_MAXIMUM_STEPS):
            head, dot, rest = name.partition(".")
            value = self.value(head)
            if value is None or not dotted(value):
                break
            name = f"{dotted(value)}{dot}{rest}"
        head, dot, rest = name.partition(".")
        return f"{self._names.get(head, head)}{dot}{rest}"

    @cached_property
    def _names(self) -> Mapping[str, str]:
        return {**self.imports, **full_names(imports_in(self.nodes))}

    def known(self, read: Callable[[ast.expr], T], node: ast.expr | None) -> T | None:
        """Return what an expression is, None if only running the code would show it."""
        try:
            return read(node) if node is not None else None
        except NotLiteral:
            return None

    def literal(self, node: ast.expr) -> Plain:
        """Return the value of an expression. Raises NotLiteral."""
        match self.followed(node):
            case ast.Constant(value=int() as value) if value.bit_length() > _MAXIMUM_BITS:
                pass  # Python refuses to show it
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
            assigned = self.value(dotted(node))
            if assigned is None:
                return node
            node = assigned
        raise NotLiteral(start)
