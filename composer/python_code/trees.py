"""Syntax trees: walks, names, arguments, and spans in characters (Python counts UTF-8 bytes)."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span

Function = ast.FunctionDef | ast.AsyncFunctionDef

#: Code in one of these does not run where it is written.
SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
#: Columns in longer lines are not exact, because counting takes quadratic time.
_LONGEST_LINE = 10_000


@dataclass(frozen=True, slots=True)
class Import:
    """``from module import name``, or ``import module`` with an empty name."""

    module: str
    name: str
    level: int = 0


def walk(body: Iterable[ast.AST], *, closed: tuple[type[ast.AST], ...] = ()) -> Iterator[ast.AST]:
    """Yield the nodes of ``body`` in source order, without those inside nodes of a closed class."""
    pending = [*body][::-1]
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, closed):
            pending += children(node)[::-1]


def children(node: ast.AST) -> list[ast.AST]:
    """Return the nodes in a node, except how names are used. ``ast.iter_child_nodes`` is slower."""
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, list):
            found += [item for item in value if isinstance(item, ast.AST)]
        elif isinstance(value, ast.AST) and name != "ctx":
            found.append(value)
    return found


def dotted(node: ast.AST) -> str:
    """Return a dotted name as written; "" for other expressions."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return ""
    return ".".join((node.id, *reversed(parts)))


def imports_in(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, Import]]:
    """Yield the names that import statements bind, with their origins."""
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            for item in node.names:
                yield item.asname or item.name, Import(node.module or "", item.name, node.level)
        elif isinstance(node, ast.Import):
            yield from ((item.asname or item.name, Import(item.name, "")) for item in node.names)


def full_names(imports: Iterable[tuple[str, Import]]) -> dict[str, str]:
    """Return the full names of what absolute imports bind."""
    absolute = ((name, item) for name, item in imports if not item.level)
    return {
        name: f"{item.module}.{item.name}" if item.name else item.module for name, item in absolute
    }


def argument(call: ast.Call, position: int, name: str) -> ast.expr | None:
    """Return what a call passes for a parameter, by its position or its name."""
    if len(call.args) > position:
        return call.args[position]
    return next((item.value for item in call.keywords if item.arg == name), None)


def positional_arguments(function: Function) -> list[ast.arg]:
    """Return the arguments of a function that may be passed by position, with ``self``."""
    return [*function.args.posonlyargs, *function.args.args]


def called_name(node: ast.AST) -> str:
    """Return the last part of the name of the function that ``node`` calls, or ""."""
    return last_name(node.func) if isinstance(node, ast.Call) else ""


def last_name(node: ast.AST) -> str:
    """Return the last part of a name, also of one that belongs to an expression; else ""."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def is_none(node: ast.expr | None) -> bool:
    """Return whether an expression is None as written."""
    return isinstance(node, ast.Constant) and node.value is None


def is_empty(body: Iterable[ast.stmt]) -> bool:
    """Return whether a body only has a docstring, 'pass' or '...'."""
    return all(
        isinstance(item, ast.Pass)
        or (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
        for item in body
    )


def catches(handler: ast.ExceptHandler, errors: frozenset[str]) -> bool:
    """Return whether an ``except`` catches everything, or names one of these exceptions."""
    if handler.type is None:
        return True
    return any(isinstance(x, ast.Name) and x.id in errors for x in ast.walk(handler.type))


def span_of(node: ast.stmt | ast.expr, source: SourceFile) -> Span:
    """Return the span of a node; of one with several lines, its first character."""
    line = source.line(node.lineno)
    start = characters(line, node.col_offset)
    if node.end_lineno != node.lineno or node.end_col_offset is None:
        return Span(source, node.lineno, start + 1)
    length = characters(line, node.end_col_offset) - start
    return Span(source, node.lineno, start + 1, max(length, 1))


def start_span(
    node: ast.stmt | ast.expr | ast.keyword | ast.alias, length: int, source: SourceFile
) -> Span:
    """Return the span of the first ``length`` characters of a node."""
    start = characters(source.line(node.lineno), node.col_offset)
    return Span(source, node.lineno, start + 1, length)


def name_span(node: Function | ast.ClassDef, keyword: str, source: SourceFile) -> Span:
    """Return the span of the name after ``def`` or ``class``."""
    span = start_span(node, len(node.name), source)
    line = source.line(span.line)
    at = line.find(node.name, line.find(keyword, span.column - 1) + len(keyword))
    return Span(source, span.line, at + 1, span.length) if at >= 0 else span


def characters(line: str, size_bytes: int) -> int:
    """Return the number of characters in the first ``size_bytes`` bytes of a line, as UTF-8."""
    if line.isascii() or len(line) > _LONGEST_LINE:
        return size_bytes
    return len(line.encode()[:size_bytes].decode(errors="replace"))


@lru_cache(maxsize=256)
def bindings(place: ast.AST) -> Mapping[str, list[ast.expr | None]]:
    """Return what a place assigns to each name; None for what only running it would show."""
    bound: dict[str, list[ast.expr | None]] = {}
    values: dict[ast.expr, ast.expr | None] = {}
    for node in walk(place.body, closed=SCOPES) if isinstance(place, ast.Module) else walk([place]):
        match node:
            case ast.Assign(targets=targets, value=value):
                values |= dict.fromkeys(targets, value)
            case ast.AnnAssign(target=target, value=value):
                values[target] = value
            case ast.arg(arg=name) if not isinstance(place, ast.ClassDef):
                bound.setdefault(name, []).append(None)
            case ast.Name() | ast.Attribute() | ast.Subscript() if _is_changed(node, values):
                bound.setdefault(dotted(node), []).append(values.get(node))
                if not isinstance(node, ast.Name):  # a part of the value, as in 'qos.depth = 5'
                    bound.setdefault(dotted(node.value), []).append(None)
    return bound


def _is_changed(
    node: ast.Name | ast.Attribute | ast.Subscript, values: Mapping[ast.expr, ast.expr | None]
) -> bool:
    """Return whether an expression gets a value; an annotation alone gives none."""
    is_annotation = node in values and values[node] is None
    return not (isinstance(node.ctx, ast.Load) or is_annotation)
