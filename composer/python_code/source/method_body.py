"""The calls and names in the body of a method, collected in one walk over its syntax tree."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.python_code.source.spans import span_of
from composer.python_code.source.traversal import children
from composer.source import SourceFile, Span

Function = ast.FunctionDef | ast.AsyncFunctionDef

_PUBLISHERS = "self.publishers"
#: Code in one of these may run later, or in a thread.
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
#: Maximum number of aliases to follow from a name.
_MAXIMUM_ALIASES = 4


@dataclass(frozen=True, slots=True)
class Call:
    """A call: the dotted name of the callee, and whether it is awaited.

    Imports and local names of publishers are resolved in the name. ``deferred`` is true in a nested
    function, which may run later, or in a thread.
    """

    name: str
    span: Span
    awaited: bool
    deferred: bool = False


@dataclass(slots=True)
class Body:
    """The calls and names in a method.

    ``calls`` are in source order. ``mentioned`` are the names that the method uses without calling
    them. ``names`` maps its imports and local names to full names.
    """

    calls: tuple[Call, ...]
    mentioned: tuple[str, ...]
    names: Mapping[str, str]

    def full_name(self, node: ast.expr) -> str:
        """Return the full dotted name of an expression; "" for other expressions."""
        return _resolved(dotted(node), self.names)


def read_body(function: Function, imports: Mapping[str, str], source: SourceFile) -> Body:
    """Read a method; ``imports`` maps the names in its file to full names."""
    visitor = _BodyVisitor(dict(imports))
    visitor.assigned.update(
        inner.arg for inner in ast.walk(function.args) if isinstance(inner, ast.arg)
    )
    pending: list[tuple[ast.AST, bool]] = [(node, False) for node in reversed(function.body)]
    while pending:
        node, deferred = pending.pop()
        within = deferred or isinstance(node, _SCOPES)
        pending.extend((child, within) for child in reversed(visitor.visit(node, deferred)))
    names = visitor.names()
    return Body(
        calls=tuple(
            Call(
                _resolved(name, names),
                span_of(node.func, source),
                id(node) in visitor.awaited,
                deferred,
            )
            for name, node, deferred in visitor.calls
        ),
        mentioned=tuple(_resolved(name, names) for name in visitor.mentioned_except(names)),
        names=names,
    )


def argument(call: ast.Call, position: int, name: str) -> ast.expr | None:
    """Return what a call passes for a parameter, by its position or its name."""
    if len(call.args) > position:
        return call.args[position]
    return next((item.value for item in call.keywords if item.arg == name), None)


def dotted(node: ast.expr) -> str:
    """Return a dotted name as written; "" for other expressions."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join((node.id, *reversed(parts)))


def is_none(node: ast.expr | None) -> bool:
    """Return whether an expression is None as written."""
    return isinstance(node, ast.Constant) and node.value is None


def catches(handler: ast.ExceptHandler, errors: frozenset[str]) -> bool:
    """Return whether an ``except`` catches everything, or names one of these exceptions."""
    if handler.type is None:
        return True
    return any(isinstance(x, ast.Name) and x.id in errors for x in ast.walk(handler.type))


@dataclass(slots=True)
class _BodyVisitor:
    """The names and calls collected so far; names are as written."""

    imports: dict[str, str]
    calls: list[tuple[str, ast.Call, bool]] = field(default_factory=list)
    awaited: set[int] = field(default_factory=set)
    mentioned: list[str] = field(default_factory=list)
    aliases: list[tuple[str, str]] = field(default_factory=list)
    assigned: Counter[str] = field(default_factory=Counter)

    def visit(self, node: ast.AST, deferred: bool) -> Sequence[ast.AST]:
        """Record ``node``, and return the children that remain to be visited."""
        below: Sequence[ast.AST] = []
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                self.mentioned.append(name)
            case ast.Name(id=name) | ast.arg(arg=name):
                self.assigned[name] += 1
            case ast.Attribute():
                below = self._attribute(node)
            case ast.Call():
                below = self._call(node, deferred)
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if dotted(value):
                self.assigned[name] += 1
                self.aliases.append((name, dotted(value)))
            case ast.Import() | ast.ImportFrom():
                self.imports.update(imported_names(node))
            case ast.Await(value=value):
                self.awaited.add(id(value))
                below = [value]
            case _:
                below = children(node)
        return below

    def names(self) -> Mapping[str, str]:
        """Return the full names of imports and of local names of publishers.

        A name that is assigned twice is ambiguous, so it is not resolved.
        """
        local = {name: value for name, value in self.aliases if self.assigned[name] == 1}
        followed = {name: _resolved(value, local) for name, value in local.items()}
        publishers = {
            name: value
            for name, value in followed.items()
            if f"{value}.".startswith(f"{_PUBLISHERS}.")
        }
        return self.imports | publishers

    def mentioned_except(self, names: Mapping[str, str]) -> Iterator[str]:
        """Yield the mentioned names, except those assigned to one of ``names``."""
        yield from self.mentioned
        yield from (value for name, value in self.aliases if name not in names)

    def _attribute(self, node: ast.Attribute) -> list[ast.AST]:
        name = dotted(node)
        if not name:
            return [node.value]
        self.mentioned.append(name)
        return []

    def _call(self, node: ast.Call, deferred: bool) -> list[ast.AST]:
        given: list[ast.AST] = [*node.args, *(keyword.value for keyword in node.keywords)]
        name = dotted(node.func)
        if not name:
            return [node.func, *given]
        self.calls.append((name, node, deferred))
        return given


def imported_names(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, str]]:
    """Yield imported names with their full names: ``sleep`` with ``time.sleep``."""
    if isinstance(node, ast.Import):
        yield from ((item.asname, item.name) for item in node.names if item.asname)
    elif node.module and not node.level:
        for item in node.names:
            yield item.asname or item.name, f"{node.module}.{item.name}"


def _resolved(name: str, names: Mapping[str, str]) -> str:
    for _ in range(_MAXIMUM_ALIASES):
        head, dot, rest = name.partition(".")
        if head not in names:
            break
        name = f"{names[head]}{dot}{rest}"
    return name
